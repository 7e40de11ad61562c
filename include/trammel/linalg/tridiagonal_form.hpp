// SPDX-License-Identifier: Apache-2.0
/// @file
/// Symmetric matrices brought to tridiagonal form by an orthogonal change of basis.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// A = Q T Q', T tridiagonal, Q a product of Householder reflections.
///
/// Method: panels of reflections whose effect on the rest of the matrix is applied in one product per panel
/// (Dongarra, Hammarling, Sorensen 1989); half of the operations are products of a matrix with a vector
/// all the same. Cost: 4/3 n^3 operations, as much as n^3 / 2 in `apply_basis` per n columns. Takes memory of
/// its own at construction only; Eigen's products of large matrices take packing buffers. The result is the
/// same to the last bit for any number of threads.
class TridiagonalForm {
 public:
  explicit TridiagonalForm(Eigen::Index size);

  /// Of the lower triangle of `matrix`, n x n.
  void compute(const Eigen::MatrixXd& matrix, unsigned threads = 1);

  [[nodiscard]] const Eigen::VectorXd& diagonal() const { return diagonal_; }
  [[nodiscard]] const Eigen::VectorXd& off_diagonal() const { return off_diagonal_; }

  /// x <- Q x, n rows.
  void apply_basis(Eigen::MatrixXd& x, unsigned threads = 1) const;

 private:
  void reflect_panel(Eigen::Index first, Eigen::Index width);
  void update_rest(Eigen::Index first, Eigen::Index width, unsigned threads);

  Eigen::MatrixXd work_;     // what is left of A; below its first subdiagonal the reflections
  Eigen::MatrixXd vectors_;  // [V, W] of a panel: A - V W' - W V' is the rest of the matrix after it
  Eigen::MatrixXd swapped_;  // [W, V]
  Eigen::VectorXd diagonal_, off_diagonal_, factor_, inner_;
};

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifndef TRAMMEL_COMPILED
#include "trammel/linalg/tridiagonal_form_impl.hpp"
#endif
