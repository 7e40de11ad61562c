// SPDX-License-Identifier: Apache-2.0
/// @file
/// Largest size of a linear function within bounds on disjoint blocks: biases, and errors without
/// measurements.
#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

/// Settings of bound_bias.
struct BiasBoundSettings {
  double relative_gap = 1e-9;  ///< stop when (upper - lower)/upper is at most this
  int max_iterations = 20000;  ///< `upper` is proved wherever the iteration stops
};

/// Proved bound of a squared bias, in the squared unit of G u.
struct BiasBound {
  double upper = std::numeric_limits<double>::quiet_NaN();  ///< proved
  double lower = std::numeric_limits<double>::quiet_NaN();  ///< of the best possible `upper`
  Eigen::VectorXd multipliers;  ///< lambda: sum is `upper`; sum_l lambda_l |u_l|^2 >= |G u|^2 for all u
  int iterations = 0;
};

/// Bounds max |G u|^2 over all u whose blocks have |u_l| <= 1, l = 1..s:
///
///   min { sum lambda : sum_l lambda_l |u_l|^2 >= |G u|^2 for all u }
///     = min over the simplex tau of  lambda_max( sum_l G_l G_l' / tau_l )          (Schur complement)
///     = max over rho >= 0, tr rho = 1 of  ( sum_l <rho, G_l G_l'>^(1/2) )^2        (minimax theorem)
///
/// | symbol | meaning                                              | shape     |
/// |--------|------------------------------------------------------|-----------|
/// | G      | `map`; G_l its columns of block l                    | m x p     |
/// | tau    | share of each bound, lambda = tau upper              | s         |
/// | rho    | weight of the output directions, rho = R R'          | m x m     |
///
/// Method: the second form is a convex function of R on a sphere, which R <- gradient increases at each step
/// (generalised power method: Journee, Nesterov, Richtarik, Sepulchre 2010, algorithm 1); tau_l proportional
/// to <rho, G_l G_l'>^(1/2). R has m columns, or as many as make local maxima unlikely (Burer, Monteiro
/// 2005). Guarantee: `upper` holds for whatever tau was reached, up to rounding. It is the largest mean
/// square over random u with E |u_l|^2 <= 1, the class the guaranteed estimate is made for; over fixed u it
/// is attained when m = 1 and may be above the maximum otherwise. Cost: O(m p min(m, sqrt(2 s))) per step,
/// O(m^3) now and then for lambda_max. Throws Error unless the sizes sum to the columns of `map`.
[[nodiscard]] BiasBound bound_bias(const Eigen::MatrixXd& map, const std::vector<Eigen::Index>& block_sizes,
                                   const BiasBoundSettings& settings = {});

}  // namespace trammel::inline TRAMMEL_ABI::estimate

#ifndef TRAMMEL_COMPILED
#include "trammel/estimate/bias_bound_impl.hpp"
#endif
