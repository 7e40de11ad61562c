// SPDX-License-Identifier: Apache-2.0
/// @file
/// Azimuth and elevation sensor.
#pragma once

#include <cmath>

#include "trammel/sensor/sensor.hpp"

namespace trammel::inline TRAMMEL_ABI::sensor {

/// Azimuth from +y clockwise to +x, atan2(x, y), and elevation above the x-y plane, atan2(z, h) with
/// h = |(x, y)| (rad). Jacobian rows (y, -x, 0)/h^2 and (-x z/h, -y z/h, h)/|x|^2.
struct AzimuthElevation {
  static constexpr SensorKind kKind = SensorKind::kAzimuthElevation;
  static constexpr int kComponents = 2;
  static constexpr bool kUsesVelocity = false;
  static constexpr int kAngles = 2;

  template <class Scalar>
  [[nodiscard]] static Eigen::Matrix<Scalar, 2, 1> value(const Vector3<Scalar>& position,
                                                         const Vector3<Scalar>& /*velocity*/) {
    using std::atan2;
    return {atan2(position.x(), position.y()), atan2(position.z(), detail::horizontal_distance(position))};
  }

  template <class Scalar>
  [[nodiscard]] static Jacobian<Scalar, 2> jacobian(const Vector3<Scalar>& position,
                                                    const Vector3<Scalar>& /*velocity*/) {
    const Scalar h = detail::horizontal_distance(position);
    const Scalar range = detail::distance(position);
    const Scalar east = position.x() / h;
    const Scalar north = position.y() / h;
    const Scalar rise = position.z() / range;
    Jacobian<Scalar, 2> J;
    J.position << north / h, -east / h, Scalar(0),  //
        -east * rise / range, -north * rise / range, h / range / range;
    J.velocity.setZero();
    return J;
  }
};

static_assert(Sensor<AzimuthElevation>);

}  // namespace trammel::inline TRAMMEL_ABI::sensor
