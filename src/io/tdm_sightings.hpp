// SPDX-License-Identifier: Apache-2.0
/// @file
/// From the records of a Tracking Data Message to measurements.
#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>

#include "tdm.hpp"

namespace trammel::io {

/// What one station measured at one time tag; NaN: nothing.
struct Sighting {
  double range_m = std::nan("");
  double azimuth_rad = std::nan("");
  double elevation_rad = std::nan("");
  double range_rate_mps = std::nan("");
  int line = 0;  ///< of the first record, for messages
};

/// Time tags in the order of time.
using Tag = std::tuple<std::int64_t, std::int64_t, std::int64_t>;

/// Everything measured, by station and time tag.
using Sightings = std::map<std::string, std::map<Tag, Sighting>>;

/// Adds stations and measurements to `data` (its time system is known) and sets its reference: the one given
/// or the earliest tag. `file` is used in messages. `sightings` is not empty.
void assemble(const Sightings& sightings, const std::string& file, const std::optional<Epoch>& reference,
              TrackingData& data);

}  // namespace trammel::io
