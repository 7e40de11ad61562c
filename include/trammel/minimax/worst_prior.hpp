// SPDX-License-Identifier: Apache-2.0
/// @file
/// The prior within the bounds that a linear functional finds worst: the oracle of the conditional gradient.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/minimax/reduction.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

/// max <G, V> over V >= 0 with <H_l, V> <= 1, and its dual, min sum lambda with H(lambda) - G >= 0:
///
/// | symbol | field        | shape | meaning                                             |
/// |--------|--------------|-------|-----------------------------------------------------|
/// | V      | prior_factor | q x q | V = L L', within the bounds                         |
/// | lambda | multipliers  | s     | H(lambda) - G is positive definite                  |
/// | -      | lower        | -     | <G, V>                                              |
/// | -      | upper        | -     | sum lambda                                          |
struct WorstPrior {
  Eigen::MatrixXd prior_factor;
  Eigen::VectorXd multipliers;
  double lower = 0.0;
  double upper = 0.0;
  int steps = 0;  ///< Newton steps
};

/// Solves for the worst prior. `bounds` and `first_row` as in ReducedProblem, with orthonormal columns of
/// `bounds`; G is symmetric, positive semidefinite and not zero.
///
/// Method: barrier in the s multipliers, sum lambda - mu log det (H(lambda) - G) - mu sum log lambda,
/// Newton's method with mu falling tenfold; V = mu Z^-1 with Newton's correction, so the largest eigenvalue
/// of the scaled G may have any multiplicity. For s = 2 this is theorem 1 of the conditional-gradient paper
/// (README, Sources: "by dual optimisation") without its restriction to a simple eigenvalue. Guarantee: both
/// sides are feasible up to rounding, (upper - lower)/upper <= relative_gap unless rounding errors stop the
/// method first. Cost: 40 to 60 steps of about two q x q products; memory O(q^2).
[[nodiscard]] WorstPrior worst_prior(const Eigen::MatrixXd& bounds,
                                     const std::vector<Eigen::Index>& first_row, const Eigen::MatrixXd& G,
                                     double relative_gap);

}  // namespace trammel::inline TRAMMEL_ABI::minimax

#ifndef TRAMMEL_COMPILED
#include "trammel/minimax/worst_prior_impl.hpp"
#endif
