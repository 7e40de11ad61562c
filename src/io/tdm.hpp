// SPDX-License-Identifier: Apache-2.0
/// @file
/// Measurements as CCSDS Tracking Data Messages (CCSDS 503.0, versions 1.0 and 2.0), keyword-value form.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "epoch.hpp"
#include "trammel/problem/scenario.hpp"

namespace trammel::io {

/// What a RANGE or Doppler value along a two-way path means: the message leaves it to the agreement between
/// the partners (503.0-B-2, 3.5.2.7).
enum class TwoWayValue {
  kOneWay,     ///< half of the round trip: the distance itself
  kRoundTrip,  ///< the length of the whole path
};

/// How to read a message.
struct TdmSettings {
  std::optional<Epoch> reference;  ///< t_s = 0; none: the earliest time tag of the message
  std::string target;              ///< participant that is observed; empty: told by PATH, see read_tdm
  TwoWayValue two_way = TwoWayValue::kOneWay;
};

/// Measurements with the stations they come from.
struct TrackingData {
  std::vector<Station> stations;          ///< name and kind only: a message holds no positions or covariances
  std::vector<Measurement> measurements;  ///< sorted by time
  Epoch reference;                        ///< instant of t_s = 0
  std::string time_system = "UTC";
  std::string timetag_ref;  ///< "RECEIVE", "TRANSMIT", or empty if the message does not say
  std::map<std::string, std::size_t> left_out;  ///< records that are no measurement here, by keyword
};

/// How a time system counts: UTC with leap seconds, every other without.
[[nodiscard]] TimeScale time_scale(std::string_view time_system);

/// Reads a message.
///
/// - RANGE (km, or s times the speed of light) becomes `range`, ANGLE_1 and ANGLE_2 with ANGLE_TYPE = AZEL
///   (degrees) become `azimuth_elevation`, all at one time tag `azimuth_elevation_range`;
///   DOPPLER_INSTANTANEOUS (km/s) becomes `range_rate`. Other data keywords are counted in `left_out`.
/// - The station is the last participant of PATH: it received the signal. Without PATH it is PARTICIPANT_1.
///   With `target` it is the other participant. One station may have several segments.
/// - A station that measures different sets at different times becomes several: the fullest kind keeps its
///   name, the others are called NAME:azimuth_elevation, NAME:range and NAME:range_rate.
/// - Time tags are kept as they are: TIMETAG_REF is handed on, the light time (3.3 us per km) is not
///   subtracted. UTC counts leap seconds, other time systems have none.
/// - CORRECTION_* values are added where CORRECTIONS_APPLIED = NO.
/// Throws Error naming file, line and keyword for what is malformed, and for what would be misread:
/// ambiguous, differenced or three-way ranges, range units, other angle types, delays.
[[nodiscard]] TrackingData read_tdm(const std::filesystem::path& file, const TdmSettings& settings);
/// The same from text; `name` is used in messages.
[[nodiscard]] TrackingData parse_tdm(std::string_view text, const std::string& name,
                                     const TdmSettings& settings);

/// What a written message says besides its measurements.
struct TdmHeader {
  std::string originator = "TRAMMEL";
  Epoch creation;                 ///< UTC
  std::string target = "TARGET";  ///< participant that is observed
};

/// A message of version 2.0 with one segment per station: RANGE in km (one-way value), ANGLE_1, ANGLE_2 in
/// degrees, DOPPLER_INSTANTANEOUS in km/s (one-way value), time tags to the nanosecond. Endings of station
/// names that read_tdm adds are taken off again. Covariances have no place in the format and are left out.
/// Throws Error for kinds without a keyword (direction cosines, position) and for two measurements of one
/// station at one time, which the format forbids.
[[nodiscard]] std::string format_tdm(const TrackingData& data, const TdmHeader& header);

}  // namespace trammel::io
