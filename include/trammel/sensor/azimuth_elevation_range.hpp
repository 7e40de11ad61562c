// SPDX-License-Identifier: Apache-2.0
/// @file
/// Azimuth, elevation and range sensor (a tracking radar).
#pragma once

#include "trammel/sensor/azimuth_elevation.hpp"
#include "trammel/sensor/joint.hpp"
#include "trammel/sensor/range.hpp"

namespace trammel::inline TRAMMEL_ABI::sensor {

/// Azimuth from +y clockwise to +x, elevation above the x-y plane (rad), range (m).
using AzimuthElevationRange = Joint<SensorKind::kAzimuthElevationRange, AzimuthElevation, Range>;

static_assert(Sensor<AzimuthElevationRange>);

}  // namespace trammel::inline TRAMMEL_ABI::sensor
