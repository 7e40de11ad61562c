// SPDX-License-Identifier: Apache-2.0
/// @file
/// Brings a guaranteed problem into coordinates where the solvers are well conditioned.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

/// A guaranteed problem in coordinates u, theta = B u + N n, where every direction of u is bounded and n
/// collects the directions that no ellipsoid bounds. The optimal rule estimates n without bias, which costs
/// a fixed amount of noise, and what is left is a problem in u alone:
///
/// | symbol | field       | shape    | meaning                                                            |
/// |--------|-------------|----------|--------------------------------------------------------------------|
/// | F      | information | n_F x q  | design rows seen through n: (I - P) F B, P the projector on F N    |
/// | C      | criterion   | r x q    | criterion rows with n eliminated                                   |
/// | a      | bounds      | rows x q | all ellipsoid factors stacked; about orthonormal columns           |
/// | -      | first_row   | s + 1    | ellipsoid l owns rows first_row[l] .. first_row[l + 1] - 1         |
/// | -      | owner       | s        | index of the ellipsoid in the problem (those without effect left out)|
/// | B      | basis       | p x q    | theta of u, with n at its unbiased estimate given u                |
/// | N      | free_basis  | p x m    | unbounded directions, scaled so that F N has orthonormal columns   |
/// | -      | free_error  | scalar   | |C N|_F^2: squared error that the unbounded directions cost        |
///
/// Method: columns scaled to unit length, rows sorted by size, pivoted QR of [F; a], then of a. Squares
/// (J, S, H_l) are never formed.
struct ReducedProblem {
  Eigen::MatrixXd information;
  Eigen::MatrixXd criterion;
  Eigen::MatrixXd bounds;
  std::vector<Eigen::Index> first_row;
  std::vector<std::size_t> owner;
  Eigen::MatrixXd basis;
  Eigen::MatrixXd free_basis;
  double free_error = 0.0;
  /// Directions theta (columns) that neither F nor any a_l limits but C sees: the error is unbounded.
  Eigen::MatrixXd unbounded_directions;

  [[nodiscard]] Eigen::Index size() const { return basis.cols(); }
  [[nodiscard]] std::size_t ellipsoids() const { return owner.size(); }
};

/// Reduces a problem. Throws Error for shapes that do not fit or entries that are not finite.
[[nodiscard]] ReducedProblem reduce(const GuaranteedProblem& problem);

/// Throws Error unless all factors have p columns and finite entries.
void require_well_formed(const GuaranteedProblem& problem);

}  // namespace trammel::inline TRAMMEL_ABI::minimax

#ifndef TRAMMEL_COMPILED
#include "trammel/minimax/reduction_impl.hpp"
#endif
