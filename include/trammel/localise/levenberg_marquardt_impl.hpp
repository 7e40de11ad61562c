// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of levenberg_marquardt.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/localise/levenberg_marquardt.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

namespace detail {

/// Sets and returns the decrement g'H^-1 g/2; infinite where H is singular.
inline double measure_decrement(const Quadratic& at, Fit& fit) {
  const linalg::Cholesky undamped(at.hessian);
  ++fit.systems;
  fit.decrement = undamped.info() == Eigen::Success ? at.gradient.dot(undamped.solve(at.gradient)) / 2
                                                    : std::numeric_limits<double>::infinity();
  return fit.decrement;
}

}  // namespace detail

TRAMMEL_INLINE Fit fit_levenberg_marquardt(const FitProblem& problem, const Eigen::VectorXd& start, double mu,
                                           const FitSettings& settings) {
  constexpr double kFirstDamping = 1e-4;
  constexpr double kLess = 0.1;
  constexpr double kMore = 4.0;
  constexpr double kLeastDamping = 1e-15;
  constexpr double kMostDamping = 1e12;
  constexpr double kShorten = 0.7;
  constexpr double kHopeful = 0.01;
  constexpr double kRounding = 1e-13;  // of F: smaller changes say nothing
  Fit fit{.z = start};
  Quadratic at = problem.expand(start, mu);
  require(std::isfinite(at.cost), "start", "a point outside the bounds", "a point strictly inside");
  double damping = kFirstDamping;
  bool over = false;  // nothing more is to be gained
  while (!over && fit.systems < settings.max_systems && damping < kMostDamping) {
    const double slack = kRounding * (1 + std::abs(at.cost));
    const double enough = settings.relative_decrease * (1 + std::abs(at.cost));
    const Eigen::VectorXd diagonal = at.hessian.diagonal().cwiseMax(std::numeric_limits<double>::min());
    bool taken = false;
    while (!taken && fit.systems < settings.max_systems && damping < kMostDamping) {
      Eigen::MatrixXd damped = at.hessian;
      damped.diagonal() += damping * diagonal;
      const linalg::InPlaceCholesky cholesky(damped);
      ++fit.systems;
      if (cholesky.info() == Eigen::Success) {
        Eigen::VectorXd step = -cholesky.solve(at.gradient);
        // The damped decrement is the smaller one: only where it is small the undamped one need be known.
        const double promised = -at.gradient.dot(step) / 2;
        fit.converged = promised <= std::max(enough, slack) && detail::measure_decrement(at, fit) <= enough;
        over =
            fit.converged || (damping <= kFirstDamping && promised < kHopeful * (at.cost - settings.target));
        if (over) {
          break;
        }
        while (!problem.inside(fit.z + step) && step.norm() > 0.0) {
          step *= kShorten;
        }
        // With derivatives at once: most steps are taken.
        Quadratic next = problem.expand(fit.z + step, mu);
        // Near the minimum F cannot tell any more; there the step itself is right.
        taken = next.cost < at.cost || (promised < slack && next.cost <= at.cost + slack);
        if (taken) {
          fit.z += step;
          fit.decrement = promised;
          at = std::move(next);
        }
      }
      damping = taken ? std::max(damping * kLess, kLeastDamping) : std::max(damping * kMore, kFirstDamping);
    }
    over = over || (taken && settings.enough && settings.enough(fit.z));
  }
  fit.cost = at.cost;
  fit.chi2 = at.chi2;
  return fit;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
