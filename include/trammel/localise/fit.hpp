// SPDX-License-Identifier: Apache-2.0
/// @file
/// What minimisers of constrained fits have in common: settings, result, and when they stop.
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/localise/fit_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

/// Settings of a fit.
struct FitSettings {
  int max_systems = 3000;           ///< linear systems solved before the fit gives up
  double relative_decrease = 1e-9;  ///< stop when a Newton step promises less than this times (1 + |F|)
  /// Give up where a step promises less than a hundredth of what F is above this.
  double target = std::numeric_limits<double>::infinity();
  /// Asked after each step taken, where there is one: whether the fit may end there.
  std::function<bool(const Eigen::VectorXd& z)> stop = {};
};

/// A minimum of F(., mu).
struct Fit {
  Eigen::VectorXd z;
  double cost = std::numeric_limits<double>::infinity();  ///< F
  double chi2 = std::numeric_limits<double>::infinity();  ///< |r|^2
  double decrement =
      std::numeric_limits<double>::infinity();  ///< g'H^-1 g/2 at z, what a step still promises
  int systems = 0;                              ///< linear systems solved
  bool converged = false;
};

/// Minimises F(., mu) from a start strictly inside: fit_levenberg_marquardt, or fit_ceres of the component
/// trammel::ceres. Whoever makes many fits has one in the settings.
using Minimiser = std::function<Fit(const FitProblem& problem, const Eigen::VectorXd& start, double mu,
                                    const FitSettings& settings)>;

namespace detail {

/// Range of the damping in (H + damping diag H) step = -g.
inline constexpr double kFirstDamping = 1e-4;
inline constexpr double kLeastDamping = 1e-15;
inline constexpr double kMostDamping = 1e12;

/// What a step that was taken does to the damping.
inline constexpr double kLess = 0.1;

/// The decrement at which a fit has converged.
inline double enough(const FitSettings& settings, double cost) {
  return settings.relative_decrease * (1 + std::abs(cost));
}

/// Changes of F up to this may be rounding errors.
inline double rounding_slack(double cost) {
  constexpr double kRounding = 1e-13;
  return kRounding * (1 + std::abs(cost));
}

/// Whether steps that are hardly damped promise too little to come near the target.
inline bool hopeless(const FitSettings& settings, double cost, double promised, double damping) {
  constexpr double kHopeful = 0.01;
  return damping <= kFirstDamping && promised < kHopeful * (cost - settings.target);
}

/// `step` from z, shortened until strictly inside.
inline Eigen::VectorXd shortened(const FitProblem& problem, const Eigen::VectorXd& z, Eigen::VectorXd step) {
  constexpr double kShorten = 0.7;
  while (!problem.inside(z + step) && step.norm() > 0.0) {
    step *= kShorten;
  }
  return step;
}

}  // namespace detail

}  // namespace trammel::inline TRAMMEL_ABI::localise
