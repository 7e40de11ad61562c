// SPDX-License-Identifier: Apache-2.0
/// @file
/// The built-in minimiser of constrained fits.
#pragma once

#include <functional>
#include <limits>
#include <span>

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
  std::function<bool(const Eigen::VectorXd& z)> enough = {};
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

/// Minimises F(., mu) from `start` by the method of Levenberg (1944) and Marquardt (1963, eq. 14) with the
/// barriers' Hessian beside A'A: (H + damping diag H) step = -gradient; steps are shortened until strictly
/// inside and taken if F decreases. Finds a local minimum; convergence is linear where the measurements bend.
/// Throws Error unless `start` is strictly inside.
[[nodiscard]] Fit fit_levenberg_marquardt(const FitProblem& problem, const Eigen::VectorXd& start, double mu,
                                          const FitSettings& settings = {});

/// Fits one after the other with falling barrier weights, each from where the one before ended. Where the
/// first does not settle soon and the data are far, heavier weights come between: there weak barriers let the
/// steps run into the bounds; weights that fall from where the barriers weigh as much as the misfit keep the
/// fit away from them until it has come near the data. Ends early where settings.enough holds. The fit
/// returned is the last one, its `systems` are those of all.
[[nodiscard]] Fit fit_with_falling_barriers(const FitProblem& problem, const Eigen::VectorXd& start,
                                            std::span<const double> weights,
                                            const FitSettings& settings = {});

}  // namespace trammel::inline TRAMMEL_ABI::localise

#ifndef TRAMMEL_COMPILED
#include "trammel/localise/levenberg_marquardt_impl.hpp"
#endif
