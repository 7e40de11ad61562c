// SPDX-License-Identifier: Apache-2.0
/// @file
/// Fits that come from afar.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"
#include "trammel/localise/fit.hpp"
#include "trammel/localise/fit_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

namespace detail {

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

/// Fits one after the other with falling barrier weights, each from where the one before ended. Where the
/// first does not settle soon and the data are far, heavier weights come between: there weak barriers let the
/// steps run into the bounds; weights that fall from where the barriers weigh as much as the misfit keep the
/// fit away from them until it has come near the data. Ends early where settings.stop says so. The fit
/// returned is the last one, its `systems` are those of all. Throws Error as the minimiser does.
inline Fit fit_with_falling_barriers(const FitProblem& problem, const Eigen::VectorXd& start,
                                     std::span<const double> weights, const Minimiser& minimise,
                                     const FitSettings& settings = {}) {
  require(!weights.empty(), "weights", "none", "barrier weights");
  constexpr int kSoon = 8;
  constexpr double kOnTheWay = 1e-2;  // decrease worth a step where another fit follows
  std::vector<double> all(weights.begin(), weights.end());
  Fit fit{.z = start};
  int systems = 0;
  for (std::size_t k = 0; k < all.size(); ++k) {
    FitSettings now = settings;
    if (k + 1 < all.size()) {
      now.relative_decrease = std::max(kOnTheWay, settings.relative_decrease);
    }
    if (k == 0) {
      now.max_systems = std::min(kSoon, settings.max_systems);
    }
    fit = minimise(problem, fit.z, all[k], now);
    systems += fit.systems;
    if (settings.stop && settings.stop(fit.z)) {
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
