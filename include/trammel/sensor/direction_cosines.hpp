// SPDX-License-Identifier: Apache-2.0
/// @file
/// Direction-cosine sensor.
#pragma once

#include "trammel/sensor/sensor.hpp"

namespace trammel::inline TRAMMEL_ABI::sensor {

/// Direction cosines x/|x|, y/|x|. Jacobian the first two rows of (I - e e')/|x|, e = x/|x|.
struct DirectionCosines {
  static constexpr SensorKind kKind = SensorKind::kDirectionCosines;
  static constexpr int kComponents = 2;
  static constexpr bool kUsesVelocity = false;
  static constexpr int kAngles = 0;

  template <class Scalar>
  [[nodiscard]] static Eigen::Matrix<Scalar, 2, 1> value(const Vector3<Scalar>& position,
                                                         const Vector3<Scalar>& /*velocity*/) {
    return position.template head<2>() / detail::distance(position);
  }

  template <class Scalar>
  [[nodiscard]] static Jacobian<Scalar, 2> jacobian(const Vector3<Scalar>& position,
                                                    const Vector3<Scalar>& /*velocity*/) {
    const Scalar range = detail::distance(position);
    const Vector3<Scalar> e = position / range;
    Jacobian<Scalar, 2> J;
    J.position = -e.template head<2>() * e.transpose();
    J.position(0, 0) += Scalar(1);
    J.position(1, 1) += Scalar(1);
    J.position /= range;
    J.velocity.setZero();
    return J;
  }
};

static_assert(Sensor<DirectionCosines>);

}  // namespace trammel::inline TRAMMEL_ABI::sensor
