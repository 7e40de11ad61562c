// SPDX-License-Identifier: Apache-2.0
/// @file
/// Newton's method in the multipliers alone, for well observed motions.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/minimax/interior_point.hpp"
#include "trammel/minimax/reduction.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

/// The problem in the user's own coordinates with columns of unit length (no whitening): J must be positive
/// definite there. Empty where it is not, or where C sees less than all parameters.
[[nodiscard]] std::optional<ReducedProblem> directly_observed(const GuaranteedProblem& problem);

/// Minimises over lambda >= 0
///
///   sum lambda + tr S J^-1 + tr H(lambda) J^-1 - 2 tr (R' H(lambda) R)^1/2,   J^-1 S J^-1 = R R',
///
/// the value of the rule whose worst bias just fills H(lambda): an upper bound for every lambda, smooth and
/// convex in s variables, and exact where V = H^-1 # (J^-1 S J^-1) - J^-1 (# the geometric mean) is positive
/// definite, as it is on well observed flights.
///
/// With R' H R = U diag(b^2) U' and rows e = a R U:
///   <H_l, V> = sum e_l^2 / b - <H_l, J^-1>,   Hessian_lm = sum_ij (e_l'e_l)_ij (e_m'e_m)_ij / (b_i b_j (b_i
///   + b_j)).
///
/// Method: primal-dual predictor-corrector in (lambda, t), t_l = 1 - <H_l, V>.
/// Guarantee: none by itself; the result (V and lambda only) is a start for InteriorPoint, which needs one to
/// four steps from there to a certified interval. Where V is not positive definite the status is
/// kNumericalTrouble, and the interior point has to start afresh.
/// Cost: 8 to 15 iterations of one eigendecomposition and s^2 p^2 / 2 operations; memory O(p^2).
[[nodiscard]] ReducedSolution solve_in_multipliers(const ReducedProblem& problem,
                                                   const SolverSettings& settings,
                                                   const ProgressObserver& observe);

}  // namespace trammel::inline TRAMMEL_ABI::minimax

#ifndef TRAMMEL_COMPILED
#include "trammel/minimax/newton_multipliers_impl.hpp"
#endif
