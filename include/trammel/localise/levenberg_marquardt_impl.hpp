// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of levenberg_marquardt.hpp.
#pragma once

#include <algorithm>
#include <cmath>

#include "trammel/core/error.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/localise/levenberg_marquardt.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

TRAMMEL_INLINE Fit fit_levenberg_marquardt(const FitProblem& problem, const Eigen::VectorXd& start, double mu,
                                           const FitSettings& settings) {
  constexpr double kFirstDamping = 1e-3;
  constexpr double kLess = 1.0 / 3;
  constexpr double kMore = 4.0;
  constexpr double kLeastDamping = 1e-15;
  constexpr double kMostDamping = 1e12;
  constexpr double kShorten = 0.7;
  constexpr double kRounding = 1e-13;  // of F: smaller changes say nothing
  Fit fit{.z = start};
  fit.cost = problem.cost(start, mu);
  require(std::isfinite(fit.cost), "start", "a point outside the bounds", "a point strictly inside");
  double damping = kFirstDamping;
  while (fit.systems < settings.max_systems && damping < kMostDamping) {
    const Quadratic at = problem.expand(fit.z, mu);
    const linalg::Cholesky undamped(at.hessian);
    ++fit.systems;
    if (undamped.info() == Eigen::Success) {
      fit.decrement = at.gradient.dot(undamped.solve(at.gradient)) / 2;
      if (fit.decrement <= settings.relative_decrease * (1 + std::abs(fit.cost))) {
        fit.converged = true;
        break;
      }
    }
    const double slack = kRounding * (1 + std::abs(fit.cost));
    const Eigen::VectorXd diagonal = at.hessian.diagonal().cwiseMax(std::numeric_limits<double>::min());
    bool taken = false;
    while (!taken && fit.systems < settings.max_systems && damping < kMostDamping) {
      Eigen::MatrixXd damped = at.hessian;
      damped.diagonal() += damping * diagonal;
      const linalg::Cholesky cholesky(damped);
      ++fit.systems;
      if (cholesky.info() == Eigen::Success) {
        Eigen::VectorXd step = -cholesky.solve(at.gradient);
        while (!problem.inside(fit.z + step) && step.norm() > 0.0) {
          step *= kShorten;
        }
        const double cost = problem.cost(fit.z + step, mu);
        // Near the minimum F cannot tell any more; there the step itself is right.
        taken = cost < fit.cost || (fit.decrement < slack && cost <= fit.cost + slack);
        if (taken) {
          fit.z += step;
          fit.cost = cost;
        }
      }
      damping = taken ? std::max(damping * kLess, kLeastDamping) : damping * kMore;
    }
  }
  fit.chi2 = problem.chi2(fit.z);
  return fit;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
