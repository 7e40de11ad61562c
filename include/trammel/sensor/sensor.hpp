// SPDX-License-Identifier: Apache-2.0
/// @file
/// What every kind of sensor offers.
#pragma once

#include <cmath>
#include <concepts>
#include <numbers>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"
#include "trammel/sensor/kind.hpp"

namespace trammel::inline TRAMMEL_ABI::sensor {

template <class Scalar>
using Vector3 = Eigen::Matrix<Scalar, 3, 1>;

/// Derivatives of a measurement of `Components` components.
template <class Scalar, int Components>
struct Jacobian {
  Eigen::Matrix<Scalar, Components, 3> position;  ///< J_value_position, units of the component per m
  Eigen::Matrix<Scalar, Components, 3> velocity;  ///< J_value_velocity, units of the component per m/s
};

namespace detail {
template <class S, class Scalar>
concept SensorFor = requires(const Vector3<Scalar>& position, const Vector3<Scalar>& velocity) {
  requires std::same_as<decltype(S::value(position, velocity)), Eigen::Matrix<Scalar, S::kComponents, 1>>;
  requires decltype(S::value(position, velocity))::RowsAtCompileTime == S::kComponents;
  requires decltype(S::jacobian(position, velocity).position)::RowsAtCompileTime == S::kComponents;
  requires decltype(S::jacobian(position, velocity).position)::ColsAtCompileTime == 3;
  requires decltype(S::jacobian(position, velocity).velocity)::RowsAtCompileTime == S::kComponents;
  requires decltype(S::jacobian(position, velocity).velocity)::ColsAtCompileTime == 3;
  requires std::same_as<typename decltype(S::jacobian(position, velocity).position)::Scalar, Scalar>;
};
}  // namespace detail

/// A stateless type with
/// - `kKind`, `kComponents` (1 to 3), `kUsesVelocity`, `kAngles` (how many leading components are angles that
///   must be compared modulo 2 pi),
/// - `value(position, velocity)` and `jacobian(position, velocity)`, templates over the scalar (float, double
///   or a dual number); position (m) is relative to the station, velocity in m/s.
/// Both throw Error where the measurement is not differentiable (at the station; azimuth also overhead).
template <class S>
concept Sensor = requires {
  requires std::same_as<decltype(S::kKind), const SensorKind>;
  requires std::same_as<decltype(S::kComponents), const int>;
  requires std::same_as<decltype(S::kUsesVelocity), const bool>;
  requires std::same_as<decltype(S::kAngles), const int>;
  requires S::kComponents >= 1 && S::kComponents <= 3;
  requires S::kComponents == components(S::kKind);
  requires detail::SensorFor<S, float> && detail::SensorFor<S, double>;
};

namespace detail {

/// |x|, after the check that the object is not at the station.
template <class Scalar>
[[nodiscard]] Scalar distance(const Vector3<Scalar>& position) {
  using std::sqrt;
  const Scalar square = position.squaredNorm();
  require(square > Scalar(0), "position relative to the station", "0 m: the object is at the station",
          "a position away from the station, where the measurement can be linearised");
  return sqrt(square);
}

/// Distance in the x-y plane, after the check that the object is not overhead.
template <class Scalar>
[[nodiscard]] Scalar horizontal_distance(const Vector3<Scalar>& position) {
  using std::sqrt;
  const Scalar square = position.template head<2>().squaredNorm();
  require(square > Scalar(0), "position relative to the station",
          "0 m in the x-y plane: the object is exactly overhead or at the station",
          "a horizontal distance, without which the azimuth is not defined");
  return sqrt(square);
}

}  // namespace detail

/// The angle in (-pi, pi] that differs from `angle_rad` by full turns.
[[nodiscard]] inline double wrap_angle(double angle_rad) {
  // Most differences of angles are small, and std::remainder is slow.
  const double wrapped =
      std::abs(angle_rad) < std::numbers::pi ? angle_rad : std::remainder(angle_rad, 2.0 * std::numbers::pi);
  return wrapped <= -std::numbers::pi ? std::numbers::pi : wrapped;
}

}  // namespace trammel::inline TRAMMEL_ABI::sensor
