// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of levenberg_marquardt.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

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

/// Barrier weights that fall down to `last` from where the barriers weigh as much as the misfit; none where
/// the data are near. From afar weak barriers let the steps run into the bounds; these keep the fit away from
/// them until it has come near the data.
inline std::vector<double> weights_from_afar(const FitProblem& problem, const Eigen::VectorXd& start,
                                             double last) {
  constexpr double kFar = 100.0;  // of |r|^2 over the number of its components
  constexpr double kFall = 0.1;
  std::vector<double> weights;
  const double chi2 = problem.chi2(start);
  if (chi2 > kFar * static_cast<double>(3 * problem.scenario().observations.size())) {
    const auto bounds = static_cast<double>(problem.trajectory().problem.ellipsoids.size());
    for (double mu = chi2 / (2 * bounds); std::isfinite(mu) && mu > last; mu *= kFall) {
      weights.push_back(mu);
    }
  }
  return weights;
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

TRAMMEL_INLINE Fit fit_with_falling_barriers(const FitProblem& problem, const Eigen::VectorXd& start,
                                             std::span<const double> weights, const FitSettings& settings) {
  require(!weights.empty(), "weights", "none", "barrier weights");
  constexpr int kSoon = 8;
  std::vector<double> all(weights.begin(), weights.end());
  Fit fit{.z = start};
  int systems = 0;
  for (std::size_t k = 0; k < all.size(); ++k) {
    FitSettings now = settings;
    if (k == 0) {
      now.max_systems = std::min(kSoon, settings.max_systems);
    }
    fit = fit_levenberg_marquardt(problem, fit.z, all[k], now);
    systems += fit.systems;
    if (settings.enough && settings.enough(fit.z)) {
      break;
    }
    if (k == 0 && !fit.converged && fit.systems >= now.max_systems) {
      std::vector<double> heavier = detail::weights_from_afar(problem, fit.z, all.front());
      heavier.push_back(all.front());
      all.insert(all.begin() + 1, heavier.begin(), heavier.end());
    }
  }
  fit.systems = systems;
  return fit;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
