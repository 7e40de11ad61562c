// SPDX-License-Identifier: Apache-2.0
/// @file
/// The auxiliary optimal control problem of a bearings-only observer as plain data.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

/// A vehicle flies along the axis OX with constant speed V towards a beacon in the origin, measures the
/// tangents of the beacon's bearing and elevation, and steers in the plane across,
///
///   x' = V,  y' = u1,  z' = u2,  y(T) = y_T, z(T) = z_T,
///   zeta1 = y/x + sigma0 eta1,  zeta2 = z/x + sigma0 eta2  every Delta seconds, eta ~ N(0, I),
///
/// so that its own position becomes known well at little effort:
///
///   minimise  J = sum_j beta_j Gamma_jj(T) + integral of (u1^2 + u2^2) dt.
///
/// | symbol | field                  | shape | unit | meaning |
/// |--------|------------------------|-------|------|----------------------------------------------------------|
/// | R      | position_m             | 3     | m    | start (or its estimate), relative to the beacon; x < 0
/// | | gamma  | covariance_m2          | 3 x 3 | m^2  | covariance of the start, positive definite | | V |
/// speed_mps              | -     | m/s  | speed along OX                                           | | T |
/// time_to_go_s           | -     | s    | a = x + V T, where the flight ends, must be negative     | |
/// sigma0 | sigma0                 | -     | 1    | standard deviation of one measured tangent | | Delta  |
/// measurement_interval_s | -     | s    | above T: no measurement will be made                     | | beta
/// | beta_per_s             | 3     | 1/s  | weights of the final variances, >= 0                     | | y_T
/// | terminal_m             | 2     | m    | y, z at the end                                          | | V_b
/// | beacon_velocity_mps    | 3     | m/s  | known constant velocity of the beacon                    |
///
/// A moving beacon: position_m is relative to where the beacon is now, terminal_m to where it is at T, and
/// V - V_b,x takes the part of V; the vehicle's own u (which J counts) is the relative one plus (V_b,y,
/// V_b,z). Relative and own control energy differ by terms that the end points fix, so the optimum is the
/// same. Source: Emelyanov and Rubinovich (2020), sections 1 and 2.
struct PlanProblem {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();
  double speed_mps = 0.0;
  double time_to_go_s = 0.0;
  double sigma0 = 0.0;
  double measurement_interval_s = 0.0;
  Eigen::Vector3d beta_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector2d terminal_m = Eigen::Vector2d::Zero();
  Eigen::Vector3d beacon_velocity_mps = Eigen::Vector3d::Zero();

  /// Closing speed along OX.
  [[nodiscard]] double closing_speed_mps() const { return speed_mps - beacon_velocity_mps.x(); }
  /// x where the flight ends, relative to the beacon.
  [[nodiscard]] double final_x_m() const { return position_m.x() + closing_speed_mps() * time_to_go_s; }
};

/// Throws Error naming the first field that breaks the rules above: not finite, x >= 0, a >= 0, a covariance
/// that is not symmetric positive definite, a negative weight, a speed, time, interval or sigma0 that is not
/// positive.
void require_valid(const PlanProblem& problem);

/// Throws Error unless `covariance` is finite, symmetric (to rounding) and positive definite.
void require_covariance(const Eigen::Matrix3d& covariance, const char* where);

}  // namespace trammel::inline TRAMMEL_ABI::observer

#ifndef TRAMMEL_COMPILED
#include "trammel/observer/plan_problem_impl.hpp"
#endif
