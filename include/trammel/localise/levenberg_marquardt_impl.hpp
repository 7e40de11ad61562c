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
  constexpr double kMore = 4.0;
  using detail::kFirstDamping;
  using detail::kMostDamping;
  Fit fit{.z = start};
  Quadratic at = problem.expand(start, mu);
  require(std::isfinite(at.cost), "start", "a point outside the bounds", "a point strictly inside");
  double damping = kFirstDamping;
  bool over = false;  // nothing more is to be gained
  while (!over && fit.systems < settings.max_systems && damping < kMostDamping) {
    const double slack = detail::rounding_slack(at.cost);
    const double enough = detail::enough(settings, at.cost);
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
        over = fit.converged || detail::hopeless(settings, at.cost, promised, damping);
        if (over) {
          break;
        }
        step = detail::shortened(problem, fit.z, std::move(step));
        // With derivatives at once: most steps are taken.
        Quadratic next = problem.expand(fit.z + step, mu);
        Fit there{.z = fit.z + step, .decrement = promised, .systems = fit.systems};
        taken = next.cost < at.cost;
        if (promised < slack && std::isfinite(next.cost)) {
          // Rounding hides what such steps change in F, not what they change in the decrement.
          taken = detail::measure_decrement(next, there) < fit.decrement;
        }
        fit.systems = there.systems;
        if (taken) {
          fit = std::move(there);
          at = std::move(next);
        }
      }
      damping = taken ? std::max(damping * detail::kLess, detail::kLeastDamping)
                      : std::max(damping * kMore, kFirstDamping);
    }
    over = over || (taken && settings.stop && settings.stop(fit.z));
  }
  fit.cost = at.cost;
  fit.chi2 = at.chi2;
  return fit;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
