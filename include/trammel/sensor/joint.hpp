// SPDX-License-Identifier: Apache-2.0
/// @file
/// Two sensors read at the same time as one.
#pragma once

#include "trammel/sensor/sensor.hpp"

namespace trammel::inline TRAMMEL_ABI::sensor {

/// The components of `First` followed by those of `Second`.
template <SensorKind Kind, Sensor First, Sensor Second>
struct Joint {
  static constexpr SensorKind kKind = Kind;
  static constexpr int kComponents = First::kComponents + Second::kComponents;
  static constexpr bool kUsesVelocity = First::kUsesVelocity || Second::kUsesVelocity;
  static constexpr int kAngles = First::kAngles;
  static_assert(Second::kAngles == 0, "angles come first");

  template <class Scalar>
  [[nodiscard]] static Eigen::Matrix<Scalar, kComponents, 1> value(const Vector3<Scalar>& position,
                                                                   const Vector3<Scalar>& velocity) {
    Eigen::Matrix<Scalar, kComponents, 1> result;
    result << First::value(position, velocity), Second::value(position, velocity);
    return result;
  }

  template <class Scalar>
  [[nodiscard]] static Jacobian<Scalar, kComponents> jacobian(const Vector3<Scalar>& position,
                                                              const Vector3<Scalar>& velocity) {
    const Jacobian<Scalar, First::kComponents> first = First::jacobian(position, velocity);
    const Jacobian<Scalar, Second::kComponents> second = Second::jacobian(position, velocity);
    Jacobian<Scalar, kComponents> J;
    J.position << first.position, second.position;
    J.velocity << first.velocity, second.velocity;
    return J;
  }
};

}  // namespace trammel::inline TRAMMEL_ABI::sensor
