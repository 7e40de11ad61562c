// SPDX-License-Identifier: Apache-2.0
#include "io/measurement_wide.hpp"

#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "io/measurement_csv.hpp"
#include "temporary_folder.hpp"
#include "trammel/core/error.hpp"

namespace {

using namespace trammel;
using namespace trammel::io;

constexpr const char* kWide =
    "# comment\n"
    "t_s,radar.range_m,radar.azimuth_rad,radar.elevation_rad,a.b.range_m,speed.range_rate_mps\n"
    "2,2290,0.46,0.22,,\n"
    "0,,,,4100.5,-3\n"
    "0,,,,4100.25\n"
    "1,,,,,\n";

std::string error_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

CsvTable table_of(const test::TemporaryFolder& folder, const std::string& text) {
  return read_csv(folder.write("w.csv", text));
}

Scenario scenario_of(const std::vector<Station>& stations) {
  Scenario scenario;
  scenario.knots_s = {0.0, 10.0};
  scenario.stations = stations;
  return scenario;
}

TEST(WideForm, ColumnsTellStationsAndKinds) {
  const test::TemporaryFolder folder;
  const CsvTable table = table_of(folder, kWide);
  EXPECT_TRUE(is_wide_form(table));
  const std::vector<Station> stations = wide_form_stations(table);
  ASSERT_EQ(stations.size(), 3U);
  EXPECT_EQ(stations[0].name, "radar");
  EXPECT_EQ(stations[0].kind, SensorKind::kAzimuthElevationRange);
  EXPECT_EQ(stations[1].name, "a.b");
  EXPECT_EQ(stations[1].kind, SensorKind::kRange);
  EXPECT_EQ(stations[2].kind, SensorKind::kRangeRate);
  const std::vector<Measurement> measurements =
      read_measurements(folder.path() / "w.csv", scenario_of(stations));
  ASSERT_EQ(measurements.size(), 4U);
  EXPECT_EQ(measurements[0].t_s, 2.0);
  EXPECT_EQ(measurements[0].value, Eigen::Vector3d(0.46, 0.22, 2290));  // the kind's order, not the file's
  EXPECT_EQ(measurements[1].station, 1U);
  EXPECT_EQ(measurements[1].value[0], 4100.5);
  EXPECT_EQ(measurements[2].station, 2U);
  EXPECT_EQ(measurements[2].value[0], -3.0);
  EXPECT_EQ(measurements[3].value[0], 4100.25);
}

TEST(WideForm, BothFormsGiveTheSameMeasurements) {
  const test::TemporaryFolder folder;
  const std::vector<Station> stations = wide_form_stations(table_of(folder, kWide));
  const Scenario scenario = scenario_of(stations);
  const auto measurements = read_measurements(folder.path() / "w.csv", scenario);
  const auto wide = folder.write("wide.csv", format_wide_form(measurements, stations));
  const auto lengthy = folder.write("long.csv", format_measurements(measurements, stations));
  auto from_wide = read_measurements(wide, scenario);
  auto from_long = read_measurements(lengthy, scenario);
  ASSERT_EQ(from_wide.size(), measurements.size());
  ASSERT_EQ(from_long.size(), measurements.size());
  const auto before = [](const Measurement& a, const Measurement& b) {
    return std::make_tuple(a.t_s, a.station, a.value[0]) < std::make_tuple(b.t_s, b.station, b.value[0]);
  };
  std::sort(from_wide.begin(), from_wide.end(), before);
  std::sort(from_long.begin(), from_long.end(), before);
  for (std::size_t i = 0; i < from_wide.size(); ++i) {
    EXPECT_EQ(from_wide[i].t_s, from_long[i].t_s);
    EXPECT_EQ(from_wide[i].station, from_long[i].station);
    EXPECT_EQ(from_wide[i].value, from_long[i].value);
  }
}

TEST(WideForm, PositionalComponentsAndAllKinds) {
  const test::TemporaryFolder folder;
  const auto file =
      folder.write("w.csv",
                   "t_s,c.cosine_x,c.cosine_y,d.cosine_x,d.cosine_y,d.range_m,p.x_m,p.y_m,p.z_m,"
                   "e.azimuth_rad,e.elevation_rad\n"
                   "1,0.1,0.2,0.3,0.4,5,6,7,8,9,1\n");
  const std::vector<Station> stations = wide_form_stations(read_csv(file));
  ASSERT_EQ(stations.size(), 4U);
  EXPECT_EQ(stations[0].kind, SensorKind::kDirectionCosines);
  EXPECT_EQ(stations[1].kind, SensorKind::kDirectionCosinesRange);
  EXPECT_EQ(stations[2].kind, SensorKind::kPosition);
  EXPECT_EQ(stations[3].kind, SensorKind::kAzimuthElevation);
  const auto positional = folder.write("y.csv", "t_s,d.y1,d.y2,d.y3\n1,0.3,0.4,5\n");
  const auto measurements = read_measurements(positional, scenario_of(stations));
  ASSERT_EQ(measurements.size(), 1U);
  EXPECT_EQ(measurements[0].station, 1U);
  EXPECT_EQ(measurements[0].value, Eigen::Vector3d(0.3, 0.4, 5));
}

TEST(WideForm, ErrorsNameFileLineAndColumn) {
  const test::TemporaryFolder folder;
  const std::vector<Station> stations = wide_form_stations(table_of(folder, kWide));
  const auto message = [&](const std::string& text) {
    const auto file = folder.write("w.csv", text);
    std::string found = error_of([&] { (void)read_measurements(file, scenario_of(stations)); });
    const auto at = found.find("w.csv");
    return at == std::string::npos ? found : found.substr(at);
  };
  EXPECT_EQ(
      message("t_s,radar.range_m\n0,1\n"),
      "w.csv: columns of station 'radar': found range_m, expected azimuth_rad, elevation_rad, range_m, as "
      "it measures azimuth_elevation_range");
  EXPECT_EQ(message("t_s,rader.range_m\n0,1\n"),
            "w.csv: column 'rader.range_m': found station 'rader', expected one of radar, a.b, speed");
  EXPECT_EQ(message("t_s,a.b.range_m,x\n0,1,2\n"),
            "w.csv: found an unknown column 'x', expected t_s or NAME.COMPONENT");
  EXPECT_EQ(message("t_s,a.b.range_m,a.b.range_m\n0,1,2\n"),
            "w.csv: found column 'a.b.range_m' twice, expected each column once");
  EXPECT_EQ(message("a.b.range_m\n1\n"), "w.csv: found columns 'a.b.range_m', expected a column 't_s'");
  EXPECT_EQ(message("t_s,a.b.range_m\n0,1\n0,inf\n"),
            "w.csv:3: column 'a.b.range_m': found 'inf', expected a finite number");
  EXPECT_EQ(message("t_s,a.b.range_m\n11,1\n").rfind("w.csv:2: column 't_s': found time 11 s", 0), 0U);
  EXPECT_EQ(message("t_s,radar.azimuth_rad,radar.elevation_rad,radar.range_m\n\n0,1,,3\n"),
            "w.csv:3: column 'radar.elevation_rad': found nothing, expected a value, as other cells of the "
            "station in this row have one");
  EXPECT_EQ(message("t_s,a.b.range_m\n0,\n"), "w.csv: found no measurement, expected at least one");
  EXPECT_THROW((void)wide_form_stations(table_of(folder, "t_s,a.speed\n0,1\n")), Error);
  Measurement own;
  own.station = 1;
  own.value = Eigen::VectorXd::Ones(1);
  own.covariance = Eigen::MatrixXd::Identity(1, 1);
  EXPECT_THROW((void)format_wide_form({own}, stations), Error);
}

}  // namespace
