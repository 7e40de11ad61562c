// SPDX-License-Identifier: Apache-2.0
/// @file
/// A motion of the spline class as a path in space.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/trajectory/nominal_trajectory.hpp"
#include "trammel/trajectory/quadratic_spline.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

/// The reference plus a deviation from it; a TruePath over the knots of the deviation.
struct DeviatedPath {
  trajectory::NominalTrajectory nominal;
  trajectory::QuadraticSpline<double> deviation;

  /// m, at a time within the knots.
  [[nodiscard]] Eigen::Vector3d position(double t_s) const {
    return nominal.position(t_s) + deviation.position(t_s);
  }
  /// m/s, at a time within the knots.
  [[nodiscard]] Eigen::Vector3d velocity(double t_s) const {
    return nominal.velocity(t_s) + deviation.velocity(t_s);
  }
  [[nodiscard]] bool covers(double t_s) const { return deviation.basis().covers(t_s); }
};

}  // namespace trammel::inline TRAMMEL_ABI::estimate
