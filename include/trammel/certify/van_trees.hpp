// SPDX-License-Identifier: Apache-2.0
/// @file
/// Lower bounds of the risk of every estimator by weighted van Trees inequalities.
#pragma once

#include "trammel/certify/block_structure.hpp"
#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// No function of the measurements, linear or not, has a worst mean-square error over the unit balls below
/// the values returned here (Gaussian noise of known covariance).
///
/// For independent blocks with densities p_l and weights h_l >= 0, int h_l = 1, h_l = 0 on the boundary,
/// tau_l = int h_l^2/p_l, K_l = int grad h_l grad h_l'/p_l, every estimator has Bayes risk at least
///
///   tr S (J + D)^-1,   D = blockdiag((tau_l - 1) J_ll + K_l)
///
/// (Borovkov and Sakhanenko 1980 with a weight per block: the terms psi_l = grad_l(h_l prod p_k f)/(p f),
/// f the likelihood, have covariance J + D and are orthogonal to every estimator, cross terms being those of
/// J). J may be singular. Each value is lowered by 1e-9 of itself for the rounding errors of the inversion.

/// Boxes in the balls: orthonormal coordinates (eigenvectors of V_ll) with half-widths w_j, sum w_j^2 = 1 per
/// block, one best prior per coordinate; the widths by a damped fixed-point iteration. Cost: 60 inversions.
[[nodiscard]] double box_bound(const UnitBalls& balls);

/// Radial priors on the balls (ball_priors): per block the one that is best for the linearised bound, which
/// grows in every step. Cost: about ten inversions.
[[nodiscard]] double ball_bound(const UnitBalls& balls);

/// Neighbouring blocks of equal size moved together: theta_l = Q_l w z with one z for a whole group, Q_l
/// orthogonal. A sub-problem, hence still a bound; the best for long or faintly seen motions. Neighbours are
/// merged greedily. Returns 0 for more than `most_blocks` blocks (cost: 10 to 20 inversions per block).
[[nodiscard]] double group_bound(const UnitBalls& balls, Eigen::Index most_blocks = 64);

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/van_trees_impl.hpp"
#endif
