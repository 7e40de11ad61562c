// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of levenberg_marquardt.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
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
  fit.cost = problem.cost(start, mu);
  require(std::isfinite(fit.cost), "start", "a point outside the bounds", "a point strictly inside");
  double damping = kFirstDamping;
  std::optional<Quadratic> next;  // at the point of the last step where it is known
  while (fit.systems < settings.max_systems && damping < kMostDamping) {
    const Quadratic at = next ? *std::move(next) : problem.expand(fit.z, mu);
    next.reset();
    const double slack = detail::rounding_slack(fit.cost);
    const double enough = detail::enough(settings, fit.cost);
    const Eigen::VectorXd diagonal = at.hessian.diagonal().cwiseMax(std::numeric_limits<double>::min());
    bool taken = false;
    bool hopeless = false;
    while (!taken && fit.systems < settings.max_systems && damping < kMostDamping) {
      Eigen::MatrixXd damped = at.hessian;
      damped.diagonal() += damping * diagonal;
      const linalg::InPlaceCholesky cholesky(damped);
      ++fit.systems;
      if (cholesky.info() == Eigen::Success) {
        Eigen::VectorXd step = -cholesky.solve(at.gradient);
        // The damped decrement is the smaller one: only where it is small the undamped one need be known.
        const double promised = -at.gradient.dot(step) / 2;
        if (promised <= std::max(enough, slack) && detail::measure_decrement(at, fit) <= enough) {
          fit.converged = true;
          break;
        }
        hopeless = detail::hopeless(settings, fit.cost, promised, damping);
        if (hopeless) {
          break;
        }
        step = detail::shortened(problem, fit.z, std::move(step));
        const double cost = problem.cost(fit.z + step, mu);
        Fit there{.z = fit.z + step, .cost = cost, .decrement = promised, .systems = fit.systems};
        taken = cost < fit.cost;
        if (promised < slack && std::isfinite(cost)) {
          // Rounding hides what such steps change in F, not what they change in the decrement.
          next = problem.expand(there.z, mu);
          taken = detail::measure_decrement(*next, there) < fit.decrement;
        }
        fit.systems = there.systems;
        if (taken) {
          fit = std::move(there);
        } else {
          next.reset();
        }
      }
      damping = taken ? std::max(damping * detail::kLess, detail::kLeastDamping)
                      : std::max(damping * kMore, kFirstDamping);
    }
    if (fit.converged || hopeless) {
      break;
    }
  }
  fit.chi2 = problem.chi2(fit.z);
  return fit;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
