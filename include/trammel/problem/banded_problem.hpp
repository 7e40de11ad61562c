// SPDX-License-Identifier: Apache-2.0
/// @file
/// The guaranteed problem of a long flight with its band kept: memory linear in the number of segments.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/banded_matrix.hpp"
#include "trammel/linalg/banded_triangle.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/scenario.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// Guaranteed problem of a trajectory in the spline coefficients c (m), p = 3 (r + 2):
///
/// | symbol | field              | band         | meaning |
/// |--------|--------------------|--------------|------------------------------------------------------------|
/// | F      | information_factor | upper 8      | triangle of the whitened design rows, J = F'F positive | |
/// |                    |              | definite                                                   | | C |
/// criterion_factor   | upper 6      | |C c|^2 = mean square of the deviation over the flight, m^2 | | D |
/// bounds             | 8 both sides | rows 3 l..3 l + 2: theta of bound l over its semi-axes (0  | | | | |
/// where infinite); |D_l c| <= 1                              | | d      | rhs                | - | F'd = sum
/// of the whitened rows times their deviations      |
struct BandedProblem {
  TrajectoryProblem trajectory;             ///< coordinates, paths, linearisation; its matrices are empty
  linalg::BandedRows<9, 3> measurements;    ///< rows of F segment by segment, before they were merged
  linalg::BandedRows<3, 1> criterion_rows;  ///< of one axis, segment by segment
  linalg::BandedMatrix information_factor, criterion_factor, bounds;
  Eigen::VectorXd rhs;
  double residual = 0.0;  ///< |y - A c|^2 = |F c - d|^2 + residual

  [[nodiscard]] Eigen::Index segments() const { return trajectory.coordinates.basis().segments(); }
  [[nodiscard]] Eigen::Index parameters() const { return bounds.size(); }
};

/// Writes the problem of a scenario whose measurements determine the motion and whose criterion is the
/// integral over the flight; no station biases, every acceleration bound positive and finite, no other bound
/// zero. Linear time and memory. `about` as in `assemble`. Throws Error for other scenarios (saying what
/// stands in the way) and as `assemble` does.
[[nodiscard]] BandedProblem assemble_banded(const Scenario& scenario,
                                            const trajectory::QuadraticSpline<double>* about = nullptr);

}  // namespace trammel::inline TRAMMEL_ABI

#ifndef TRAMMEL_COMPILED
#include "trammel/problem/banded_problem_impl.hpp"
#endif
