// SPDX-License-Identifier: Apache-2.0
/// @file
/// Range-rate (Doppler) sensor.
#pragma once

#include "trammel/sensor/sensor.hpp"

namespace trammel::inline TRAMMEL_ABI::sensor {

/// Range rate e'v (m/s), e = x/|x|. Jacobian with respect to position (v - e e'v)'/|x|, to velocity e'.
struct RangeRate {
  static constexpr SensorKind kKind = SensorKind::kRangeRate;
  static constexpr int kComponents = 1;
  static constexpr bool kUsesVelocity = true;
  static constexpr int kAngles = 0;

  template <class Scalar>
  [[nodiscard]] static Eigen::Matrix<Scalar, 1, 1> value(const Vector3<Scalar>& position,
                                                         const Vector3<Scalar>& velocity) {
    return Eigen::Matrix<Scalar, 1, 1>(position.dot(velocity) / detail::distance(position));
  }

  template <class Scalar>
  [[nodiscard]] static Jacobian<Scalar, 1> jacobian(const Vector3<Scalar>& position,
                                                    const Vector3<Scalar>& velocity) {
    const Scalar range = detail::distance(position);
    const Vector3<Scalar> e = position / range;
    Jacobian<Scalar, 1> J;
    J.position = (velocity - e * e.dot(velocity)).transpose() / range;
    J.velocity = e.transpose();
    return J;
  }
};

static_assert(Sensor<RangeRate>);

}  // namespace trammel::inline TRAMMEL_ABI::sensor
