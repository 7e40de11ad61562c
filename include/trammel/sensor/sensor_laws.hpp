// SPDX-License-Identifier: Apache-2.0
/// @file
/// The laws every sensor must obey, as numbers a test can bound. For tests of sensors, the library's own and
/// yours.
#pragma once

#include <algorithm>
#include <limits>

#include <Eigen/Core>

#include "trammel/sensor/sensor.hpp"

namespace trammel::inline TRAMMEL_ABI::sensor {

/// Largest deviation between a sensor's Jacobian and another way to compute it, each entry over the largest
/// entry of its row (position and velocity separately); a row that should vanish counts absolutely.
/// 0 would be exact; NaN wherever a value is not finite.
template <class Scalar, int Components>
[[nodiscard]] double jacobian_deviation(const Jacobian<Scalar, Components>& J,
                                        const Jacobian<Scalar, Components>& other) {
  double worst = 0.0;
  const auto compare = [&worst](const Eigen::Matrix<Scalar, Components, 3>& a,
                                const Eigen::Matrix<Scalar, Components, 3>& b) {
    for (int i = 0; i < Components; ++i) {
      const auto size = static_cast<double>(a.row(i).cwiseAbs().maxCoeff());
      const auto gap = static_cast<double>((a.row(i) - b.row(i)).cwiseAbs().maxCoeff());
      const double relative = size > 0.0 ? gap / size : gap;
      worst = relative > worst || !(relative <= std::numeric_limits<double>::max()) ? relative : worst;
    }
  };
  compare(J.position, other.position);
  compare(J.velocity, other.velocity);
  return worst;
}

/// Derivatives of `S::value` by dual numbers. `Dual` is a type like ceres::Jet<Scalar, 6>: constructible from
/// (value, index of the unit derivative), with members `a` (value) and `v` (derivatives).
template <Sensor S, class Dual, class Scalar>
[[nodiscard]] Jacobian<Scalar, S::kComponents> dual_jacobian(const Vector3<Scalar>& position,
                                                             const Vector3<Scalar>& velocity) {
  Vector3<Dual> p;
  Vector3<Dual> v;
  for (int i = 0; i < 3; ++i) {
    p(i) = Dual(position(i), i);
    v(i) = Dual(velocity(i), 3 + i);
  }
  const Eigen::Matrix<Dual, S::kComponents, 1> value = S::value(p, v);
  Jacobian<Scalar, S::kComponents> J;
  for (int i = 0; i < S::kComponents; ++i) {
    J.position.row(i) = value(i).v.template head<3>().transpose();
    J.velocity.row(i) = value(i).v.template tail<3>().transpose();
  }
  return J;
}

/// Derivatives of `S::value` by central differences of the given steps (m and m/s).
template <Sensor S, class Scalar>
[[nodiscard]] Jacobian<Scalar, S::kComponents> difference_jacobian(const Vector3<Scalar>& position,
                                                                   const Vector3<Scalar>& velocity,
                                                                   Scalar step_m, Scalar step_mps) {
  Jacobian<Scalar, S::kComponents> J;
  for (int i = 0; i < 3; ++i) {
    const Vector3<Scalar> unit = Vector3<Scalar>::Unit(i);
    J.position.col(i) = (S::value(Vector3<Scalar>(position + step_m * unit), velocity) -
                         S::value(Vector3<Scalar>(position - step_m * unit), velocity)) /
                        (2 * step_m);
    J.velocity.col(i) = (S::value(position, Vector3<Scalar>(velocity + step_mps * unit)) -
                         S::value(position, Vector3<Scalar>(velocity - step_mps * unit))) /
                        (2 * step_mps);
  }
  return J;
}

}  // namespace trammel::inline TRAMMEL_ABI::sensor
