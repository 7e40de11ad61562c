// SPDX-License-Identifier: Apache-2.0
#include "io/igc.hpp"

#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "io/csv.hpp"
#include "trammel/core/error.hpp"

namespace {

using namespace trammel;
using namespace trammel::io;

// Two further digits of minutes in columns 36-37 and 38-39, a tenth of a second in column 40.
constexpr const char* kLog =
    "AXXX123 test recorder\r\n"
    "HFDTEDATE:311222,01\r\n"
    "HFALGALTGPS:ELL\r\n"
    "I033637LAD3839LOD4040TDS\r\n"
    "\r\n"
    "B2359583331234S07044987WA012600131056655\r\n"
    "B2359593331240S07044900WV012650131500001\r\n"
    "B2359593331240S07044900WA012650131500002\r\n"
    "B2359593331240S07044900WA012650131500002\r\n"
    "LXXX a remark\r\n"
    "B0000013331250S07044800WA-0100-001201029\r\n";

std::string error_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Igc, RecordsAndExtensionsAreRead) {
  const IgcLog log = parse_igc(kLog, "a.igc");
  EXPECT_EQ(format_epoch(log.date), "2022-12-31T00:00:00");
  EXPECT_EQ(log.gnss_reference, AltitudeReference::kEllipsoid);
  ASSERT_EQ(log.fixes.size(), 5U);
  EXPECT_NEAR(log.fixes[0].latitude_deg, -(33 + 31.23456 / 60), 1e-13);
  EXPECT_NEAR(log.fixes[0].longitude_deg, -(70 + 44.98765 / 60), 1e-13);
  EXPECT_EQ(log.fixes[0].pressure_altitude_m, 1260.0);
  EXPECT_EQ(log.fixes[0].gnss_altitude_m, 1310.0);
  EXPECT_EQ(log.fixes[0].line, 6);
  EXPECT_NEAR(log.fixes[0].t_s, 86398.5, 1e-9);
  EXPECT_FALSE(log.fixes[1].valid);
  EXPECT_NEAR(log.fixes[4].t_s, 86401.9, 1e-9);  // past midnight
  EXPECT_EQ(log.fixes[4].pressure_altitude_m, -100.0);
  EXPECT_EQ(log.fixes[4].gnss_altitude_m, -12.0);
}

// Coordinates from the closed formulas with 40 digits.
TEST(Igc, PathInTheLocalFrame) {
  const IgcLog log = parse_igc(kLog, "a.igc");
  const LocalFrame frame(geodetic_from_degrees(-33.5, -70.75, 500.0));
  const IgcPath path = local_path(log, frame, {});
  EXPECT_EQ(format_epoch(path.start), "2022-12-31T23:59:58.5");
  EXPECT_EQ(path.invalid, 1U);
  EXPECT_EQ(path.out_of_order, 1U);
  ASSERT_EQ(path.times_s.size(), 3U);
  EXPECT_NEAR(path.times_s[1], 0.7, 1e-9);
  EXPECT_NEAR(path.times_s[2], 3.4, 1e-9);
  const Eigen::Vector3d expected[] = {
      {19.125954033267189, -2282.6280774196316, 809.59010362824104},
      {154.86598421913814, -2292.6893581826963, 814.58463361009737},
      {309.63604505316295, -2310.7185111415334, -512.42761319253449},
  };
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LT((path.positions_m[i] - expected[i]).norm(), 1e-7) << i;
  }
}

TEST(Igc, AltitudesAreChosenAndShifted) {
  const IgcLog log = parse_igc(kLog, "a.igc");
  const LocalFrame frame(default_origin(log));
  EXPECT_EQ(frame.origin().height_m, 0.0);
  const IgcPath gnss = local_path(log, frame, {IgcAltitude::kGnss, 30.0});
  EXPECT_LT((gnss.positions_m[0] - Eigen::Vector3d(0, 0, 1340.0)).norm(), 1e-8);
  const IgcPath pressure = local_path(log, frame, {IgcAltitude::kPressure, 0.0});
  EXPECT_LT((pressure.positions_m[0] - Eigen::Vector3d(0, 0, 1260.0)).norm(), 1e-8);
  // Mean of GNSS minus pressure altitude over the four valid fixes: (50 + 50 + 50 + 88) / 4.
  const IgcPath shifted = local_path(log, frame, {IgcAltitude::kPressureShifted, 0.0});
  EXPECT_EQ(shifted.altitude_shift_m, 59.5);
  EXPECT_LT((shifted.positions_m[0] - Eigen::Vector3d(0, 0, 1319.5)).norm(), 1e-8);
}

TEST(Igc, TimesGoOnOverMidnights) {
  std::string log = "HFDTE281299\n";
  for (const char* time : {"235959", "000000", "235959", "000001", "120000", "235959", "000002"}) {
    log += "B" + std::string(time) + "3331240S07044900WA0126501315\n";
  }
  std::vector<double> times;
  for (const IgcFix& fix : parse_igc(log, "a.igc").fixes) {
    times.push_back(fix.t_s);
  }
  // The third fix came late, from before midnight; the last one is two days after the first.
  EXPECT_EQ(times, (std::vector<double>{86399, 86400, 86399, 86401, 129600, 172799, 172802}));
}

TEST(Igc, DatesOfBothFormsAndCenturies) {
  const std::string log = kLog;
  EXPECT_EQ(format_epoch(parse_igc(replaced(log, "HFDTEDATE:311222,01", "HFDTE010299"), "a").date),
            "1999-02-01T00:00:00");
  EXPECT_EQ(format_epoch(parse_igc(replaced(log, "HFDTEDATE:311222,01", "HFDTE010200"), "a").date),
            "2000-02-01T00:00:00");
}

TEST(Igc, ErrorsNameFileAndLine) {
  const std::string log = kLog;
  const auto message = [&](const std::string& from, const std::string& to) {
    return error_of([&] { (void)parse_igc(replaced(log, from, to), "a.igc"); });
  };
  const std::pair<std::pair<const char*, const char*>, const char*> cases[] = {
      {{"HFDTEDATE:311222", "HFDTEDATE:310222"}, "a.igc:2: date: found day 31, month 2, year 2022"},
      {{"HFDTEDATE:311222,01", "HFDTE"}, "a.igc:2: date"},
      {{"HFDTEDATE:311222,01", "HFXXX"},
       "a.igc:6: B record: found 'B235958', expected a header with the date"},
      {{"B2359583331234S", "B2460583331234S"}, "a.igc:6: time"},
      {{"B2359583331234S", "B2359583361234S"}, "a.igc:6: latitude"},
      {{"B2359583331234S", "B2359589131234S"}, "a.igc:6: latitude"},
      {{"B2359583331234S", "B2359583331234X"}, "a.igc:6: latitude: found 'X', expected N or S"},
      {{"07044987W", "18144987W"}, "a.igc:6: longitude"},
      {{"07044987WA", "07044987WB"}, "a.igc:6: validity"},
      {{"A012600131056655", "A01260013"}, "a.igc:6: B record"},
      {{"A012600131056655", "A01260013-056655"}, "a.igc:6: GNSS altitude"},
      {{"A012600131056655", "A0x2600131056655"}, "a.igc:6: pressure altitude"},
      {{"A012600131056655", "A0126001310"}, "a.igc:6: B record: found"},
      {{"I033637LAD3839LOD4040TDS", "I033637LAD3839LOD"}, "a.igc:4: extensions"},
      {{"I033637LAD3839LOD4040TDS", "I010104LAD"}, "a.igc:4: extensions"},
  };
  for (const auto& [edit, expected] : cases) {
    EXPECT_EQ(message(edit.first, edit.second).rfind(expected, 0), 0U)
        << edit.second << ": " << message(edit.first, edit.second);
  }
  EXPECT_EQ(error_of([] { (void)parse_igc("", "a.igc"); }),
            "a.igc: found no B record, expected at least one fix");
  EXPECT_EQ(error_of([] { (void)parse_igc("H\nB", "a.igc"); }).rfind("a.igc:2: B record", 0), 0U);
  const IgcLog one = parse_igc("HFDTE010203\nB2359583331234S07044987WA0126001310\n", "a.igc");
  EXPECT_THROW((void)local_path(one, LocalFrame(default_origin(one)), {}), Error);
}

// The local frames beside the logs were made by someone else: pressure altitude shifted by the mean
// difference, times from a row within the log.
TEST(Igc, RealFlightsAgreeWithTheirLocalFrames) {
  const std::filesystem::path folder = std::filesystem::path(TRAMMEL_SOURCE_DIR) / "../shared/flights";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "no real flights beside the project";
  }
  struct Flight {
    const char* name;
    double latitude_deg, longitude_deg, start_s;
    std::size_t rows;
  };
  for (const Flight& flight : {Flight{"glider_ash25", 51.9405, -0.6828, 43624.0, 1824},
                               Flight{"paraglider_skydrop", 47.6393, 15.8629, 58701.0, 819}}) {
    const IgcLog log = read_igc(folder / (std::string(flight.name) + ".igc"));
    const LocalFrame frame(geodetic_from_degrees(flight.latitude_deg, flight.longitude_deg, 0.0));
    const IgcPath path = local_path(log, frame, {IgcAltitude::kPressureShifted, 0.0});
    std::map<long, Eigen::Vector3d> by_time;
    for (std::size_t i = 0; i < path.times_s.size(); ++i) {
      by_time[std::lround(path.times_s[i] + log.fixes.front().t_s - flight.start_s)] = path.positions_m[i];
    }
    const CsvTable table = read_csv(folder / (std::string(flight.name) + ".csv"));
    ASSERT_EQ(table.rows.size(), flight.rows);
    constexpr double kRounding_m = 0.0005 + 1e-6;  // the tables have three decimals
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
      const auto found = by_time.find(std::lround(table.number(row, 0)));
      ASSERT_NE(found, by_time.end()) << table.where(row);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        ASSERT_NEAR(found->second[static_cast<Eigen::Index>(axis)], table.number(row, axis + 1), kRounding_m)
            << table.where(row);
      }
    }
  }
}

}  // namespace
