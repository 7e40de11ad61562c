// SPDX-License-Identifier: Apache-2.0
/// @file
/// Range sensor.
#pragma once

#include "trammel/sensor/sensor.hpp"

namespace trammel::inline TRAMMEL_ABI::sensor {

/// Range |x| (m). Jacobian e', e = x/|x|.
struct Range {
  static constexpr SensorKind kKind = SensorKind::kRange;
  static constexpr int kComponents = 1;
  static constexpr bool kUsesVelocity = false;
  static constexpr int kAngles = 0;

  template <class Scalar>
  [[nodiscard]] static Eigen::Matrix<Scalar, 1, 1> value(const Vector3<Scalar>& position,
                                                         const Vector3<Scalar>& /*velocity*/) {
    return Eigen::Matrix<Scalar, 1, 1>(detail::distance(position));
  }

  template <class Scalar>
  [[nodiscard]] static Jacobian<Scalar, 1> jacobian(const Vector3<Scalar>& position,
                                                    const Vector3<Scalar>& /*velocity*/) {
    Jacobian<Scalar, 1> J;
    J.position = position.transpose() / detail::distance(position);
    J.velocity.setZero();
    return J;
  }
};

static_assert(Sensor<Range>);

}  // namespace trammel::inline TRAMMEL_ABI::sensor
