// SPDX-License-Identifier: Apache-2.0
#include "io/tdm.hpp"

#include <cmath>
#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "trammel/core/error.hpp"

namespace {

using namespace trammel;
using namespace trammel::io;

constexpr double kDeg = M_PI / 180.0;

// Two stations, three segments; ordinal and calendar dates; records in no particular order.
constexpr const char* kMessage = R"(CCSDS_TDM_VERS = 2.0
COMMENT made by hand
CREATION_DATE = 2024-122T20:15:00Z
ORIGINATOR = NOBODY
MESSAGE_ID = 7

META_START
COMMENT a radar
TRACK_ID = 1
TIME_SYSTEM = UTC
START_TIME = 2024-05-01T11:00:00
PARTICIPANT_1 = NORTH RADAR
PARTICIPANT_2 = AIRCRAFT
MODE = SEQUENTIAL
PATH = 1,2,1
TIMETAG_REF = RECEIVE
RANGE_MODULUS = 0.0
RANGE_UNITS = km
ANGLE_TYPE = AZEL
META_STOP
DATA_START
COMMENT first angles, then ranges
ANGLE_1 = 2024-05-01T12:00:00.000 359.5
ANGLE_1 = 2024-05-01T12:00:01.250 -10.25
ANGLE_2 = 2024-05-01T12:00:00.000 12
ANGLE_2 = 2024-05-01T12:00:01.250 12.5
RANGE = 2024-122T12:00:00.000Z 42.5
RANGE = 2024-122T12:00:01.250Z   4.2e1
DOPPLER_INSTANTANEOUS = 2024-05-01T12:00:01.250 -0.125
CARRIER_POWER = 2024-05-01T12:00:00 -120
DATA_STOP
META_START
TIME_SYSTEM = UTC
PARTICIPANT_1 = AIRCRAFT
PARTICIPANT_2 = SOUTH
MODE = SEQUENTIAL
PATH = 1,2
TIMETAG_REF = RECEIVE
ANGLE_TYPE = AZEL
META_STOP
DATA_START
ANGLE_2=2024-05-01T11:59:59.5 30
ANGLE_1=2024-05-01T11:59:59.5 180
DATA_STOP
META_START
TIME_SYSTEM = UTC
PARTICIPANT_1 = NORTH RADAR
PARTICIPANT_2 = AIRCRAFT
PATH = 1,2,1
TIMETAG_REF = RECEIVE
CORRECTION_RANGE = 0.5
CORRECTIONS_APPLIED = NO
META_STOP
DATA_START
RANGE = 2024-05-01T12:00:02 41
DATA_STOP
)";

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

void expect_value(const Measurement& measurement, double t_s, std::size_t station,
                  const std::vector<double>& value) {
  EXPECT_EQ(measurement.t_s, t_s);
  EXPECT_EQ(measurement.station, station);
  ASSERT_EQ(measurement.value.size(), static_cast<Eigen::Index>(value.size()));
  for (std::size_t i = 0; i < value.size(); ++i) {
    EXPECT_NEAR(measurement.value[static_cast<Eigen::Index>(i)], value[i], 1e-15 * std::abs(value[i]));
  }
}

TEST(Tdm, StationsKindsAndUnits) {
  const TrackingData data = parse_tdm(kMessage, "a.tdm", {});
  EXPECT_EQ(format_epoch(data.reference), "2024-05-01T11:59:59.5");
  EXPECT_EQ(data.timetag_ref, "RECEIVE");
  ASSERT_EQ(data.stations.size(), 4U);
  EXPECT_EQ(data.stations[0].name, "NORTH RADAR");
  EXPECT_EQ(data.stations[0].kind, SensorKind::kAzimuthElevationRange);
  EXPECT_EQ(data.stations[1].name, "NORTH RADAR:range_rate");
  EXPECT_EQ(data.stations[1].kind, SensorKind::kRangeRate);
  EXPECT_EQ(data.stations[2].name, "NORTH RADAR:range");
  EXPECT_EQ(data.stations[2].kind, SensorKind::kRange);
  EXPECT_EQ(data.stations[3].name, "SOUTH");
  EXPECT_EQ(data.stations[3].kind, SensorKind::kAzimuthElevation);
  ASSERT_EQ(data.measurements.size(), 5U);
  expect_value(data.measurements[0], 0.0, 3, {180 * kDeg, 30 * kDeg});
  expect_value(data.measurements[1], 0.5, 0, {359.5 * kDeg, 12 * kDeg, 42500});
  expect_value(data.measurements[2], 1.75, 0, {-10.25 * kDeg, 12.5 * kDeg, 42000});
  expect_value(data.measurements[3], 1.75, 1, {-125});
  expect_value(data.measurements[4], 2.5, 2, {41500});
  EXPECT_EQ(data.left_out, (std::map<std::string, std::size_t>{{"CARRIER_POWER", 1}}));
}

TEST(Tdm, ReferenceTargetAndTwoWayValue) {
  TdmSettings settings;
  settings.reference = parse_epoch("2024-05-01T12:00:00", "t");
  settings.target = "AIRCRAFT";
  settings.two_way = TwoWayValue::kRoundTrip;
  const TrackingData data = parse_tdm(kMessage, "a.tdm", settings);
  expect_value(data.measurements[0], -0.5, 3, {180 * kDeg, 30 * kDeg});
  expect_value(data.measurements[1], 0.0, 0, {359.5 * kDeg, 12 * kDeg, 21250});
  expect_value(data.measurements[3], 1.25, 1, {-62.5});
  // The other way round: AIRCRAFT measures where NORTH RADAR is.
  settings.target = "NORTH RADAR";
  EXPECT_EQ(
      error_of([&] { (void)parse_tdm(kMessage, "a.tdm", settings); }).rfind("a.tdm:40: found 2 part", 0), 0U)
      << error_of([&] { (void)parse_tdm(kMessage, "a.tdm", settings); });
}

TEST(Tdm, RangesInSecondsAndOtherTimeSystems) {
  std::string message = replaced(kMessage, "RANGE_UNITS = km", "RANGE_UNITS = s");
  const TrackingData data = parse_tdm(replaced(message, "12:00:00.000Z 42.5", "12:00:00.000Z 1e-4"), "a", {});
  EXPECT_NEAR(data.measurements[1].value[2], 29979.2458, 1e-9);
  message = R"(CCSDS_TDM_VERS = 1.0
META_START
TIME_SYSTEM = TAI
PARTICIPANT_1 = A
META_STOP
DATA_START
RANGE = 2016-12-31T23:59:59 1
RANGE = 2017-01-01T00:00:00 1
DATA_STOP
)";
  EXPECT_EQ(parse_tdm(message, "a", {}).measurements[1].t_s, 1.0);
  EXPECT_EQ(parse_tdm(replaced(message, "TAI", "UTC"), "a", {}).measurements[1].t_s, 2.0);
}

TEST(Tdm, WrittenMessageReadsBackTheSame) {
  const TrackingData data = parse_tdm(kMessage, "a.tdm", {});
  TdmHeader header;
  header.creation = parse_epoch("2024-05-02T00:00:00", "t");
  header.target = "AIRCRAFT";
  TdmSettings settings;
  settings.reference = data.reference;
  const TrackingData back = parse_tdm(format_tdm(data, header), "b.tdm", settings);
  ASSERT_EQ(back.measurements.size(), data.measurements.size());
  ASSERT_EQ(back.stations.size(), data.stations.size());
  EXPECT_EQ(back.timetag_ref, "RECEIVE");
  for (std::size_t i = 0; i < data.measurements.size(); ++i) {
    const Measurement& a = data.measurements[i];
    const Measurement& b = back.measurements[i];
    EXPECT_EQ(a.t_s, b.t_s);
    EXPECT_EQ(data.stations[a.station].name, back.stations[b.station].name);
    EXPECT_LT((a.value - b.value).norm(), 1e-15 * a.value.norm());
  }
}

TEST(Tdm, ErrorsNameFileLineAndKeyword) {
  const std::string message = kMessage;
  const std::pair<std::pair<const char*, const char*>, const char*> cases[] = {
      {{"CCSDS_TDM_VERS = 2.0", "CCSDS_OEM_VERS = 2.0"}, "a.tdm:1: found 'CCSDS_OEM_VERS'"},
      {{"CCSDS_TDM_VERS = 2.0", "CCSDS_TDM_VERS = 9.0"},
       "a.tdm:1: CCSDS_TDM_VERS: found '9.0', expected 1.0"},
      {{"MESSAGE_ID = 7", "MESSAGE = 7"}, "a.tdm:5: MESSAGE: found an unknown keyword of the header"},
      {{"MESSAGE_ID = 7", "message_id = 7"}, "a.tdm:5: found 'message_id = 7'"},
      {{"ORIGINATOR = NOBODY", "ORIGINATOR ="}, "a.tdm:4: ORIGINATOR: found nothing"},
      {{"2024-122T20:15:00Z", "yesterday"}, "a.tdm:3: CREATION_DATE: found 'yesterday'"},
      {{"TRACK_ID = 1", "TRACK = 1"}, "a.tdm:9: TRACK: found an unknown keyword of the metadata"},
      {{"TRACK_ID = 1", "MODE = SEQUENTIAL"}, "a.tdm:14: MODE: found the keyword a second time"},
      {{"TIME_SYSTEM = UTC\n", "\n"}, "a.tdm:20: found no TIME_SYSTEM"},
      {{"PATH = 1,2,1", "PATH = 1,3,1"}, "a.tdm:15: PATH: found '1,3,1'"},
      {{"PATH = 1,2,1", "PATH = 1"}, "a.tdm:15: PATH: found '1'"},
      {{"MODE = SEQUENTIAL", "MODE = SINGLE_DIFF"}, "a.tdm:14: MODE: found 'SINGLE_DIFF'"},
      {{"RANGE_MODULUS = 0.0", "RANGE_MODULUS = 100"}, "a.tdm:17: RANGE_MODULUS: found '100'"},
      {{"RANGE_UNITS = km", "RANGE_UNITS = RU"}, "a.tdm:18: RANGE_UNITS: found 'RU', expected one of km, s"},
      {{"ANGLE_TYPE = AZEL", "ANGLE_TYPE = RADEC"}, "a.tdm:19: ANGLE_TYPE: found 'RADEC'"},
      {{"ANGLE_TYPE = AZEL\n", "\n"}, "a.tdm:23: ANGLE_1: found no ANGLE_TYPE"},
      {{"TIMETAG_REF = RECEIVE", "TRANSMIT_DELAY_1 = 0.1"}, "a.tdm:16: TRANSMIT_DELAY_1: found '0.1'"},
      {{"META_STOP\n", "\n"}, "a.tdm:21: DATA_START: found an unknown keyword of the metadata"},
      {{"DATA_START\n", "\n"}, "a.tdm:23: found 'ANGLE_1', expected DATA_START"},
      {{"CARRIER_POWER", "CARRIER"}, "a.tdm:30: CARRIER: found an unknown keyword of the data"},
      {{"359.5", "north"}, "a.tdm:23: ANGLE_1: found 'north', expected a finite number"},
      {{"359.5", "nan"}, "a.tdm:23: ANGLE_1: found 'nan'"},
      {{"359.5", "361"}, "a.tdm:23: ANGLE_1"},
      {{"12:00:00.000 12\n", "12:00:00.000 91\n"}, "a.tdm:25: ANGLE_2"},
      {{"12:00:00.000 12\n", "12:00:00.000\n"}, "a.tdm:25: ANGLE_2: found '2024-05-01T12:00:00.000'"},
      {{"T12:00:00.000 12\n", "T25:00:00.000 12\n"}, "a.tdm:25: ANGLE_2: found '2024-05-01T25:00:00.000'"},
      {{"ANGLE_2 = 2024-05-01T12:00:01.250 12.5\n", ""}, "a.tdm:24: found only ANGLE_1"},
      {{"ANGLE_2 = 2024-05-01T12:00:01.250 12.5", "ANGLE_1 = 2024-05-01T12:00:00 1"},
       "a.tdm:26: ANGLE_1: found a second value of 'NORTH RADAR' at 2024-05-01T12:00:00"},
      {{"42.5", "-42.5"}, "a.tdm:27: RANGE: found '2024-122T12:00:00.000Z -42.5', expected a range above 0"},
      {{"CORRECTIONS_APPLIED = NO\n", "\n"}, "a.tdm:51: CORRECTION_RANGE: found '0.5'"},
      {{"2024-05-01T12:00:02 41\nDATA_STOP\n", "2024-05-01T12:00:02 41\n"},
       "a.tdm: found the end of the file, expected DATA_STOP"},
  };
  for (const auto& [edit, expected] : cases) {
    const std::string text =
        error_of([&] { (void)parse_tdm(replaced(message, edit.first, edit.second), "a.tdm", {}); });
    EXPECT_EQ(text.rfind(expected, 0), 0U) << edit.second << ": " << text;
  }
  EXPECT_EQ(error_of([] { (void)parse_tdm("", "a.tdm", {}); }).rfind("a.tdm: found the end of the file", 0),
            0U);
  EXPECT_EQ(error_of([] { (void)parse_tdm("CCSDS_TDM_VERS = 2.0\n", "a.tdm", {}); }),
            "a.tdm: found a header and no segment, expected META_START");
}

TEST(Tdm, WhatTheFormatCannotHoldIsAnError) {
  TrackingData data = parse_tdm(kMessage, "a.tdm", {});
  TdmHeader header;
  data.measurements.push_back(data.measurements.back());
  EXPECT_NE(error_of([&] { (void)format_tdm(data, header); }).find("two measurements at"), std::string::npos);
  data.measurements.pop_back();
  data.stations[0].kind = SensorKind::kDirectionCosinesRange;
  EXPECT_NE(error_of([&] { (void)format_tdm(data, header); }).find("a kind that a Tracking Data Message"),
            std::string::npos);
  data.stations[0].kind = SensorKind::kAzimuthElevationRange;
  header.target = "two\nlines";
  EXPECT_THROW((void)format_tdm(data, header), Error);
}

}  // namespace
