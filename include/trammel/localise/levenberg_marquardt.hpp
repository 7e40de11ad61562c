// SPDX-License-Identifier: Apache-2.0
/// @file
/// The built-in minimiser of constrained fits.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/localise/fit.hpp"
#include "trammel/localise/fit_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

/// Minimises F(., mu) from `start` by the method of Levenberg (1944) and Marquardt (1963, eq. 14) with the
/// barriers' Hessian beside A'A: (H + damping diag H) step = -gradient; steps are shortened until strictly
/// inside and taken if F decreases. Finds a local minimum; convergence is linear where the measurements bend.
/// Throws Error unless `start` is strictly inside.
[[nodiscard]] Fit fit_levenberg_marquardt(const FitProblem& problem, const Eigen::VectorXd& start, double mu,
                                          const FitSettings& settings = {});

}  // namespace trammel::inline TRAMMEL_ABI::localise

#ifndef TRAMMEL_COMPILED
#include "trammel/localise/levenberg_marquardt_impl.hpp"
#endif
