// SPDX-License-Identifier: Apache-2.0
/// @file
/// How far a measurement is from its linearisation: bounds for every kind of sensor.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/sensor/any_sensor.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

/// How far the true motion may be from the reference at one time.
struct DeviationRadius {
  double all_m = 0.0;         ///< |dx|
  double across_m = 0.0;      ///< part of dx orthogonal to the line of sight
  double horizontal_m = 0.0;  ///< part of dx in the x-y plane
  double velocity_mps = 0.0;  ///< |dv|
};

/// Bounds of one measurement's remainder.
struct RemainderBound {
  sensor::Padded half_width = sensor::Padded::Zero();  ///< per component, in its unit
  /// False where a radius exceeds half the distance it is compared with: it was then reduced to that half, so
  /// that the arithmetic stays finite, and half_width bounds nothing.
  bool valid = true;
};

/// Bounds |delta| per component, where
///
///   delta = h(x + dx, v + dv) - h(x, v) - J_position dx - J_velocity dv.
///
/// | symbol     | meaning                                               | unit    |
/// |------------|-------------------------------------------------------|---------|
/// | x, v       | reference position relative to the station, velocity  | m, m/s  |
/// | r, h, e    | |x|, |(x_1, x_2)|, x/r                                | m, m, - |
/// | rho, rho_p | bounds of |dx| and of its part orthogonal to e        | m       |
/// | rho_h, nu  | bounds of |(dx_1, dx_2)| and of |dv|                  | m, m/s  |
///
/// | component        | bound                                                                             |
/// |------------------|-----------------------------------------------------------------------------------|
/// | range            | rho_p^2 / (2 (r - rho)); delta = |dx_p|^2 / (|x + dx| + r + e'dx), never negative |
/// | direction cosine | rho^2 / (sqrt(3) (r - rho)^2)                                                     |
/// | azimuth          | rho_h^2 / (2 (h - rho_h)^2)                                                       |
/// | elevation        | max(1, (|x_3| + rho)/(h - rho_h)) rho^2 / (2 (r - rho)^2)                         |
/// | range rate       | |v| rho^2 / (sqrt(3) (r - rho)^2) + 2 sin(asin(rho/r)/2) nu                       |
/// | position         | 0                                                                                 |
///
/// All but the range follow from Taylor's formula with the second derivative at its largest along the way;
/// for a unit vector w, w'e(x) has there the form (2 |ab| s + b^2 c)/R^2 with a, b the parts of dx along e
/// and across, (c, s) those of w, at most 2/sqrt(3) rho^2/R^2. The range rate is e'v: its remainder is
/// v'(e(x + dx) - e(x) - J dx) + (e(x + dx) - e(x))'dv, and two directions seen rho apart from a distance r
/// differ by at most the chord of the angle asin(rho/r).
/// The bounds are of second order in the radii taken together: they hold also for root mean squares where
/// the radii bound (E |dx|^4)^(1/4) and (E |dv|^4)^(1/4), as far as the denominators are right.
[[nodiscard]] inline RemainderBound bound_remainder(SensorKind kind, const Eigen::Vector3d& position_m,
                                                    const Eigen::Vector3d& velocity_mps,
                                                    DeviationRadius radius) {
  RemainderBound result;
  if (kind == SensorKind::kPosition) {
    return result;
  }
  const double r = position_m.norm();
  const double h = position_m.head<2>().norm();
  const auto limit = [&result](double& rho, double distance) {
    if (!(rho <= distance / 2)) {
      rho = distance / 2;
      result.valid = false;
    }
  };
  limit(radius.all_m, r);
  radius.across_m = std::min(radius.across_m, radius.all_m);
  const double near = r - radius.all_m;
  const double turn = radius.all_m / near;
  const double range = radius.across_m * radius.across_m / (2 * near);
  const double cosine = turn * turn / std::numbers::sqrt3;
  const auto angles = [&] {
    limit(radius.horizontal_m, h);
    const double level = h - radius.horizontal_m;
    const double azimuth = radius.horizontal_m / level;
    const double steep = std::max(1.0, (std::abs(position_m.z()) + radius.all_m) / level);
    return Eigen::Vector2d(azimuth * azimuth / 2, steep * turn * turn / 2);
  };
  switch (kind) {
    case SensorKind::kDirectionCosinesRange:
      result.half_width << cosine, cosine, range;
      break;
    case SensorKind::kAzimuthElevationRange:
      result.half_width << angles(), range;
      break;
    case SensorKind::kRange:
      result.half_width(0) = range;
      break;
    case SensorKind::kDirectionCosines:
      result.half_width.head<2>().setConstant(cosine);
      break;
    case SensorKind::kAzimuthElevation:
      result.half_width.head<2>() = angles();
      break;
    case SensorKind::kRangeRate:
      result.half_width(0) =
          velocity_mps.norm() * cosine + 2 * std::sin(std::asin(radius.all_m / r) / 2) * radius.velocity_mps;
      break;
    case SensorKind::kPosition:
      break;
  }
  return result;
}

/// How far the clock of a station may be off, and what that moves.
struct ClockRadius {
  double offset_s = 0.0;           ///< |s|
  double reference_mps2 = 0.0;     ///< size of the acceleration of the reference, as the station sees it
  double acceleration_mps2 = 0.0;  ///< bound of that of the true motion between t and t + s
};

/// The same for a measurement that is made at t + s and linearised at t: bounds |delta| per component, where
///
///   delta = h(x + dx + (v + dv) s + R, v + dv + S) - h(x, v) - J_position (dx + v s) - J_velocity (dv + a
///   s),
///
/// with |R| <= a' s^2/2 and |S| <= a' s, a' and a the accelerations of the true motion and of the reference.
/// `radius` bounds dx + v s and dv; `model` is the measurement linearised at (x, v).
/// The true velocity carries the motion on, not that of the reference: dx + v s misses it by |dv| |s| + |R|,
/// and dv + a s misses the velocity by (a' + a) |s|; to what the Jacobians make of these comes the remainder
/// at the radii widened by them.
[[nodiscard]] inline RemainderBound bound_remainder(SensorKind kind, const Eigen::Vector3d& position_m,
                                                    const Eigen::Vector3d& velocity_mps,
                                                    const sensor::Linearised& model,
                                                    const DeviationRadius& radius, const ClockRadius& clock) {
  if (clock.offset_s == 0.0) {  // nothing to widen, also where accelerations are not bounded
    return bound_remainder(kind, position_m, velocity_mps, radius);
  }
  const double s = clock.offset_s;
  const double beyond_m = s * radius.velocity_mps + clock.acceleration_mps2 * s * s / 2;
  RemainderBound bound = bound_remainder(kind, position_m, velocity_mps,
                                         {.all_m = radius.all_m + beyond_m,
                                          .across_m = radius.across_m + beyond_m,
                                          .horizontal_m = radius.horizontal_m + beyond_m,
                                          .velocity_mps = radius.velocity_mps + clock.acceleration_mps2 * s});
  bound.half_width +=
      model.J_value_position.rowwise().norm() * beyond_m +
      model.J_value_velocity.rowwise().norm() * ((clock.acceleration_mps2 + clock.reference_mps2) * s);
  return bound;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
