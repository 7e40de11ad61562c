// SPDX-License-Identifier: Apache-2.0
/// @file
/// A motion strictly within the bounds and above the floor, to start fits from.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/localise/fit.hpp"
#include "trammel/localise/fit_problem.hpp"
#include "trammel/localise/levenberg_marquardt.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

/// The search's answer.
struct InteriorMotion {
  /// Strictly inside: zero where the reference path itself is; absent where none was found.
  std::optional<Eigen::VectorXd> z;
  double lowest_height_m = 0.0;  ///< of the highest motion found
};

/// Raises a floor from below the reference path by the method of centres (Huard 1967): the motion that
/// maximises the product of the rooms left below the path and within the bounds has the highest floor so far
/// as its start; the floor then follows the path up by nine tenths. Ends above the floor of `problem`, or
/// where the path follows no more. `minimise` makes the fits.
[[nodiscard]] InteriorMotion find_interior_motion(const FitProblem& problem,
                                                  const Minimiser& minimise = fit_levenberg_marquardt);

/// The motion found. Throws Error where none is.
[[nodiscard]] Eigen::VectorXd require_interior_motion(const FitProblem& problem,
                                                      const Minimiser& minimise = fit_levenberg_marquardt);

/// Throws the Error of a floor of `minimum_height_m` where the highest motion found stays above
/// `lowest_height_m` only.
[[noreturn]] void refuse_floor(double minimum_height_m, double lowest_height_m);

}  // namespace trammel::inline TRAMMEL_ABI::localise

#ifndef TRAMMEL_COMPILED
#include "trammel/localise/interior_motion_impl.hpp"
#endif
