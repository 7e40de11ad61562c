// SPDX-License-Identifier: Apache-2.0
/// @file
/// Position sensor.
#pragma once

#include "trammel/sensor/sensor.hpp"

namespace trammel::inline TRAMMEL_ABI::sensor {

/// Position x, y, z relative to the station (m). Jacobian the identity.
struct Position {
  static constexpr SensorKind kKind = SensorKind::kPosition;
  static constexpr int kComponents = 3;
  static constexpr bool kUsesVelocity = false;
  static constexpr int kAngles = 0;

  template <class Scalar>
  [[nodiscard]] static Eigen::Matrix<Scalar, 3, 1> value(const Vector3<Scalar>& position,
                                                         const Vector3<Scalar>& /*velocity*/) {
    return position;
  }

  template <class Scalar>
  [[nodiscard]] static Jacobian<Scalar, 3> jacobian(const Vector3<Scalar>& /*position*/,
                                                    const Vector3<Scalar>& /*velocity*/) {
    Jacobian<Scalar, 3> J;
    J.position.setIdentity();
    J.velocity.setZero();
    return J;
  }
};

static_assert(Sensor<Position>);

}  // namespace trammel::inline TRAMMEL_ABI::sensor
