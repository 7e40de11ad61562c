// SPDX-License-Identifier: Apache-2.0
/// @file
/// Triangle R with R'R = I + A'A, without forming A'A.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// R of the QR factorisation of [A; I]: R'R = I + A'A to the accuracy of A itself, where the product A'A
/// would lose what is small beside something large.
///
/// Method: Householder reflections in panels (Schreiber and Van Loan 1989), each as short as the zeros of the
/// identity allow. Cost about 2 n^2 (m + n/3) operations for A of m x n. Takes memory only at construction.
class StackedTriangle {
 public:
  /// For A of `rows` x `columns`.
  StackedTriangle(Eigen::Index rows, Eigen::Index columns);

  /// Computes R of `A`, of the shape given at construction.
  void compute(const Eigen::MatrixXd& A);

  /// R in the upper triangle, n x n; below it is workspace.
  [[nodiscard]] auto triangle() const { return work_.topRows(work_.cols()).triangularView<Eigen::Upper>(); }

 private:
  void reflect_panel(Eigen::Index first, Eigen::Index width, Eigen::Index rows);

  Eigen::MatrixXd work_;     // [A; I], (m + n) x n
  Eigen::MatrixXd vectors_;  // reflections of a panel with their zeros and ones
  Eigen::MatrixXd T_;        // I - V T V' is the product of a panel's reflections
  Eigen::MatrixXd projected_, scaled_;
  Eigen::VectorXd row_, coefficients_;
};

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifndef TRAMMEL_COMPILED
#include "trammel/linalg/stacked_triangle_impl.hpp"
#endif
