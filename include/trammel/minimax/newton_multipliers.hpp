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
/// Guarantee: none by itself; the result (V and lambda only) is to be certified (certify_prior) or, where
/// that fails, a start for InteriorPoint. Where V is not positive definite the status is kNumericalTrouble,
/// and the interior point has to start afresh. Cost: 8 to 15 iterations of about 15 p x p products, among
/// them one eigendecomposition and one Hessian (separable_gram); up to 128 parameters the latter takes s^2
/// p^2 / 2 operations (bound_gram). Memory: about 13 p x p matrices beside the problem.
[[nodiscard]] ReducedSolution solve_in_multipliers(const ReducedProblem& problem,
                                                   const SolverSettings& settings,
                                                   const ProgressObserver& observe);

/// L scaled into the bounds one by one, where their rows make up a basis: L <- a^-1 D a L, D = use^(-1/2) on
/// the bounds exceeded. A common factor would take from all what a single bound with a multiplier near zero
/// exceeds. Unchanged where the rows are no basis.
void scale_into_bounds(const ReducedProblem& problem, const Eigen::VectorXd& use,
                       Eigen::MatrixXd& prior_factor);

/// Bounds, estimator and status of a solution that has V = L L' and lambda only, as solve_in_multipliers
/// makes them. On its path H(lambda) = Sigma(V) exactly, so the multipliers, a little inflated, and K = L (I
/// + L'J L)^-1 L' are feasible; the lower bound is that of V scaled into the bounds. kOptimal where the
/// interval is as narrow as asked for. Cost: ten to twenty p x p products.
void certify_prior(const ReducedProblem& problem, const SolverSettings& settings, ReducedSolution& solution);

}  // namespace trammel::inline TRAMMEL_ABI::minimax

#ifndef TRAMMEL_COMPILED
#include "trammel/minimax/newton_multipliers_impl.hpp"
#endif
