// SPDX-License-Identifier: Apache-2.0
/// @file
/// Everything the interior point needs to know at one prior V = L L'.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/stacked_triangle.hpp"
#include "trammel/minimax/reduction.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

/// Value, gradient and curvature of f(V) = tr C (V^-1 + F'F)^-1 C' at V = L L', all in coordinates where V is
/// the identity:
///
/// | symbol | field        | shape    | meaning                                                            |
/// |--------|--------------|----------|--------------------------------------------------------------------|
/// | L      | factor       | q x q    | V = L L'                                                           |
/// | M      | -            | q x q    | I + L'F'F L = R'R, from the QR of [F L; I]: never squared          |
/// | G      | gradient     | q x q    | L' Sigma L = M^-1 L'C'C L M^-1                                     |
/// | Q      | curvature    | q x q    | I - M^-1; the Hessian of f maps D to -(Q D G + G D Q)              |
/// | -      | bounds       | rows x q | a L; the use of bound l is |a_l L|^2                               |
/// | -      | value, noise | scalars  | f(V) and its noise share |C K F'|^2, K = L M^-1 L'                 |
///
/// Cost of `update`: about ten p x p products. Allocates only at construction.
class PriorState {
 public:
  explicit PriorState(const ReducedProblem& problem);

  /// Recomputes all from `factor`.
  void update(const ReducedProblem& problem);

  /// K = L M^-1 L' in the reduced coordinates.
  [[nodiscard]] Eigen::MatrixXd gain() const;

  Eigen::MatrixXd factor;
  Eigen::MatrixXd gradient;
  Eigen::MatrixXd curvature;
  Eigen::MatrixXd bounds;
  Eigen::VectorXd use;  ///< s: <H_l, V>
  double value = 0.0;
  double noise = 0.0;

 private:
  Eigen::MatrixXd design_;     // F L, n_F x q
  Eigen::MatrixXd inverse_;    // R^-1
  Eigen::MatrixXd criterion_;  // C L R^-1, r x q
  Eigen::MatrixXd damped_;     // C L M^-1, r x q
  Eigen::MatrixXd estimate_;   // C L M^-1 L'F', r x n_F
  linalg::StackedTriangle stacked_;
};

/// One number per row from one per ellipsoid.
void per_row(const Eigen::VectorXd& per_ellipsoid, const std::vector<Eigen::Index>& first_row,
             Eigen::VectorXd& out);

/// sum of squares of the rows of each ellipsoid.
void squared_norms(const Eigen::MatrixXd& rows, const std::vector<Eigen::Index>& first_row,
                   Eigen::VectorXd& out);

}  // namespace trammel::inline TRAMMEL_ABI::minimax

#ifndef TRAMMEL_COMPILED
#include "trammel/minimax/prior_state_impl.hpp"
#endif
