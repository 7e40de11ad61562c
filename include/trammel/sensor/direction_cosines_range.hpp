// SPDX-License-Identifier: Apache-2.0
/// @file
/// Direction-cosine and range sensor.
#pragma once

#include "trammel/sensor/direction_cosines.hpp"
#include "trammel/sensor/joint.hpp"
#include "trammel/sensor/range.hpp"

namespace trammel::inline TRAMMEL_ABI::sensor {

/// Direction cosines and range: x/|x|, y/|x|, |x|. The measurement of Mamaev and Semenikhin (README,
/// Sources).
using DirectionCosinesRange = Joint<SensorKind::kDirectionCosinesRange, DirectionCosines, Range>;

static_assert(Sensor<DirectionCosinesRange>);

}  // namespace trammel::inline TRAMMEL_ABI::sensor
