// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of plan_problem.hpp.
#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/observer/plan_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

namespace detail {

inline void require_positive(double value, const char* where) {
  if (!(value > 0.0 && std::isfinite(value))) {
    throw Error({where, std::to_string(value), "a positive number"});
  }
}

template <class Vector>
void require_finite(const Vector& value, const char* where) {
  require(value.allFinite(), where, "a number that is not finite", "finite numbers");
}

}  // namespace detail

TRAMMEL_INLINE void require_covariance(const Eigen::Matrix3d& covariance, const char* where) {
  // Entries of a symmetric matrix typed with this many digits agree.
  constexpr double kSymmetryTolerance = 1e-9;
  // A pivot that is smaller than this part of its diagonal entry is rounding, not variance.
  constexpr double kPivotTolerance = 4.0 * std::numeric_limits<double>::epsilon();
  detail::require_finite(covariance, where);
  Eigen::Matrix3d rest = covariance;
  for (int i = 0; i < 3; ++i) {
    const double pivot = rest(i, i);
    if (!(pivot > kPivotTolerance * std::abs(covariance(i, i)))) {
      throw Error({where,
                   "a matrix that is not positive definite (pivot " + std::to_string(pivot) + " of row " +
                       std::to_string(i + 1) + ")",
                   "a symmetric positive definite 3 x 3 matrix"});
    }
    for (int j = i + 1; j < 3; ++j) {
      const double scale = std::sqrt(covariance(i, i) * std::abs(covariance(j, j)));
      require(std::abs(covariance(i, j) - covariance(j, i)) <= kSymmetryTolerance * scale, where,
              "a matrix that is not symmetric", "a symmetric positive definite 3 x 3 matrix");
      for (int k = i + 1; k < 3; ++k) {
        rest(j, k) -= rest(i, j) * rest(i, k) / pivot;
      }
    }
  }
}

TRAMMEL_INLINE void require_valid(const PlanProblem& problem) {
  detail::require_finite(problem.position_m, "position_m");
  detail::require_finite(problem.beta_per_s, "beta_per_s");
  detail::require_finite(problem.terminal_m, "terminal_m");
  detail::require_finite(problem.beacon_velocity_mps, "beacon_velocity_mps");
  detail::require_positive(problem.speed_mps, "speed_mps");
  detail::require_positive(problem.time_to_go_s, "time_to_go_s");
  detail::require_positive(problem.sigma0, "sigma0");
  detail::require_positive(problem.measurement_interval_s, "measurement_interval_s");
  require(problem.beta_per_s.minCoeff() >= 0.0, "beta_per_s", "a negative weight", "weights >= 0");
  require_covariance(problem.covariance_m2, "covariance_m2");
  if (!(problem.position_m.x() < 0.0)) {
    throw Error({"position_m", "x = " + std::to_string(problem.position_m.x()),
                 "x < 0 (the vehicle is in front of the beacon)"});
  }
  if (!(problem.closing_speed_mps() > 0.0)) {
    throw Error({"beacon_velocity_mps", "a closing speed of " + shortest(problem.closing_speed_mps()),
                 "speed_mps larger than the beacon's velocity along x"});
  }
  if (!(problem.final_x_m() < 0.0)) {
    throw Error({"time_to_go_s", "a flight that ends at x = " + std::to_string(problem.final_x_m()),
                 "x + V * time_to_go_s < 0 (the flight ends in front of the beacon)"});
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::observer
