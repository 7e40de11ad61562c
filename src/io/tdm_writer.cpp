// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "csv.hpp"
#include "tdm.hpp"
#include "trammel/core/error.hpp"
#include "trammel/geodesy/wgs84.hpp"
#include "trammel/sensor/kind.hpp"

namespace trammel::io {

namespace {

constexpr double kMetresPerKilometre = 1000.0;

bool has_angles(SensorKind kind) {
  return kind == SensorKind::kAzimuthElevation || kind == SensorKind::kAzimuthElevationRange;
}

/// The name without an ending that read_tdm adds.
std::string participant(const std::string& station) {
  for (const SensorKind kind : {SensorKind::kAzimuthElevation, SensorKind::kRange, SensorKind::kRangeRate}) {
    const std::string ending = ":" + std::string(describe(kind).name);
    if (station.size() > ending.size() && station.ends_with(ending)) {
      return station.substr(0, station.size() - ending.size());
    }
  }
  return station;
}

void require_line(const std::string& text, const std::string& where) {
  const bool blank = text.empty() || text.front() == ' ' || text.back() == ' ';
  if (blank || text.find_first_of("\n\r\t") != std::string::npos) {
    throw Error({where, "'" + text + "'", "one line of text without blanks at its ends"});
  }
}

std::string metadata(const Station& station, const TrackingData& data, const TdmHeader& header,
                     const std::string& start, const std::string& stop) {
  const bool measures_range = station.kind != SensorKind::kAzimuthElevation;
  std::string text = "META_START\nTIME_SYSTEM = " + data.time_system + "\n";
  if (data.time_system == "UTC") {  // START_TIME and STOP_TIME are UTC whatever the time system
    text += "START_TIME = " + start + "\nSTOP_TIME = " + stop + "\n";
  }
  text += "PARTICIPANT_1 = " + participant(station.name) + "\nPARTICIPANT_2 = " + header.target +
          "\nMODE = SEQUENTIAL\nPATH = " + (measures_range ? "1,2,1" : "2,1") + "\n";
  if (!data.timetag_ref.empty()) {
    text += "TIMETAG_REF = " + data.timetag_ref + "\n";
  }
  if (station.kind == SensorKind::kRange || station.kind == SensorKind::kAzimuthElevationRange) {
    text += "RANGE_UNITS = km\n";
  }
  return text + (has_angles(station.kind) ? "ANGLE_TYPE = AZEL\n" : "") + "META_STOP\n";
}

std::string records(SensorKind kind, const std::string& tag, const Eigen::VectorXd& value) {
  const auto record = [&](const char* keyword, double number) {
    return std::string(keyword) + " = " + tag + " " + shortest(number) + "\n";
  };
  if (kind == SensorKind::kRangeRate) {
    return record("DOPPLER_INSTANTANEOUS", value[0] / kMetresPerKilometre);
  }
  std::string text;
  if (has_angles(kind)) {
    double azimuth_deg = value[0] / kRadiansPerDegree;
    azimuth_deg -= azimuth_deg >= 360.0 ? 360.0 : 0.0;  // the format's angles end below 360
    azimuth_deg += azimuth_deg < -180.0 ? 360.0 : 0.0;  // and begin at -180
    text += record("ANGLE_1", azimuth_deg) + record("ANGLE_2", value[1] / kRadiansPerDegree);
  }
  if (kind != SensorKind::kAzimuthElevation) {
    text += record("RANGE", value[value.size() - 1] / kMetresPerKilometre);
  }
  return text;
}

}  // namespace

std::string format_tdm(const TrackingData& data, const TdmHeader& header) {
  require_line(header.originator, "originator");
  require_line(header.target, "target");
  const TimeScale scale = time_scale(data.time_system);
  std::string text =
      "CCSDS_TDM_VERS = 2.0\nCOMMENT RANGE and DOPPLER_INSTANTANEOUS are one-way values (half of the "
      "round trip).\nCREATION_DATE = " +
      format_epoch(header.creation) + "\nORIGINATOR = " + header.originator + "\n";
  for (std::size_t i = 0; i < data.stations.size(); ++i) {
    const Station& station = data.stations[i];
    require_line(station.name, "station");
    if (!has_angles(station.kind) && station.kind != SensorKind::kRange &&
        station.kind != SensorKind::kRangeRate) {
      throw Error({"station '" + station.name + "'", std::string(describe(station.kind).name),
                   "a kind that a Tracking Data Message can hold: azimuth_elevation_range, "
                   "azimuth_elevation, range or range_rate"});
    }
    std::vector<const Measurement*> mine;
    for (const Measurement& measurement : data.measurements) {
      if (measurement.station == i) {
        mine.push_back(&measurement);
      }
    }
    if (mine.empty()) {
      continue;  // a segment must hold at least one record
    }
    std::stable_sort(mine.begin(), mine.end(),
                     [](const Measurement* a, const Measurement* b) { return a->t_s < b->t_s; });
    std::string body;
    std::string start;
    std::string tag;
    for (const Measurement* measurement : mine) {
      std::string next = format_epoch(advance(data.reference, measurement->t_s, scale));
      if (next == tag) {
        throw Error({"station '" + station.name + "'", "two measurements at " + tag,
                     "one for each time tag, as CCSDS 503.0 demands"});
      }
      tag = std::move(next);
      start = start.empty() ? tag : start;
      body += records(station.kind, tag, measurement->value);
    }
    text += metadata(station, data, header, start, tag) + "DATA_START\n" + body + "DATA_STOP\n";
  }
  return text;
}

}  // namespace trammel::io
