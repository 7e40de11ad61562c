// SPDX-License-Identifier: Apache-2.0
/// @file
/// The kinds of measurement a station can make, and their names in files.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// What a station measures, in the order of its components.
enum class SensorKind {
  kDirectionCosinesRange,  ///< x/|x|, y/|x|, |x|
  kAzimuthElevationRange,  ///< azimuth from +y clockwise to +x (rad), elevation above x-y (rad), range (m)
  kRange,                  ///< |x| (m)
  kDirectionCosines,       ///< x/|x|, y/|x|
  kAzimuthElevation,       ///< (rad, rad)
  kRangeRate,              ///< d|x|/dt (m/s)
  kPosition,               ///< x, y, z (m)
};

/// Number of kinds.
inline constexpr std::size_t kSensorKinds = 7;

/// One row of the table of kinds.
struct SensorText {
  SensorKind kind;
  std::string_view name;                      ///< as in scenario files
  std::array<std::string_view, 3> component;  ///< name of each component, "" past the last
  std::array<std::string_view, 3> unit;       ///< "" for a direction cosine
};

inline constexpr std::array<SensorText, kSensorKinds> kSensorTable{{
    {SensorKind::kDirectionCosinesRange,
     "direction_cosines_range",
     {"cosine x", "cosine y", "range"},
     {"", "", "m"}},
    {SensorKind::kAzimuthElevationRange,
     "azimuth_elevation_range",
     {"azimuth", "elevation", "range"},
     {"rad", "rad", "m"}},
    {SensorKind::kRange, "range", {"range", "", ""}, {"m", "", ""}},
    {SensorKind::kDirectionCosines, "direction_cosines", {"cosine x", "cosine y", ""}, {"", "", ""}},
    {SensorKind::kAzimuthElevation, "azimuth_elevation", {"azimuth", "elevation", ""}, {"rad", "rad", ""}},
    {SensorKind::kRangeRate, "range_rate", {"range rate", "", ""}, {"m/s", "", ""}},
    {SensorKind::kPosition, "position", {"x", "y", "z"}, {"m", "m", "m"}},
}};

/// Row of kSensorTable for `kind`.
[[nodiscard]] constexpr const SensorText& describe(SensorKind kind) noexcept {
  return kSensorTable[static_cast<std::size_t>(kind)];
}

/// Number of components of a measurement of this kind.
[[nodiscard]] constexpr Eigen::Index components(SensorKind kind) noexcept {
  Eigen::Index count = 0;
  for (const std::string_view name : describe(kind).component) {
    count += name.empty() ? 0 : 1;
  }
  return count;
}

/// The kind with this name in scenario files, nothing for an unknown name.
[[nodiscard]] constexpr std::optional<SensorKind> find_sensor_kind(std::string_view name) noexcept {
  for (const SensorText& row : kSensorTable) {
    if (row.name == name) {
      return row.kind;
    }
  }
  return std::nullopt;
}

}  // namespace trammel::inline TRAMMEL_ABI
