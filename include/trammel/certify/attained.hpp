// SPDX-License-Identifier: Apache-2.0
/// @file
/// The worst admissible parameters for a given linear estimator, found explicitly.
#pragma once

#include <cstdint>
#include <limits>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// An admissible theta and the mean-square error the estimator has there.
struct AttainedError {
  Eigen::VectorXd parameters;                                       ///< theta, |a_l theta| <= 1 for every l
  double squared_error = std::numeric_limits<double>::quiet_NaN();  ///< |C K F'|_F^2 + |C (K J - I) theta|^2
};

/// Maximises |C (K J - I) theta|^2 over the ellipsoids by the power method theta <- argmax <Sigma theta_k,
/// theta>, Sigma = (K J - I)'S(K J - I), from `starts` random points drawn from the least favourable prior
/// N(0, L L'): the objective never decreases (it is convex), and the best end point is a proved lower bound
/// of the estimator's worst error. The inner maximum is in closed form for disjoint blocks; otherwise it is
/// found from its dual, min over the simplex of g'H(tau)^-1 g, by multiplicative steps. gain: p x p,
/// prior_factor: p x k. Cost: p^2 starts per step for disjoint blocks.
[[nodiscard]] AttainedError find_attained_error(const GuaranteedProblem& problem, const Eigen::MatrixXd& gain,
                                                const Eigen::MatrixXd& prior_factor, int starts = 64,
                                                std::uint64_t seed = 1);

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/attained_impl.hpp"
#endif
