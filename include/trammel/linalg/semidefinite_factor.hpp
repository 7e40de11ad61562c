// SPDX-License-Identifier: Apache-2.0
/// @file
/// A factor of a symmetric positive semidefinite matrix.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/cholesky.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// A = B'B up to rounding errors.
struct SemidefiniteFactor {
  Eigen::MatrixXd factor;  ///< B, rank x n
  /// Most negative pivot beyond rounding errors after A was scaled to a unit diagonal: A has a negative
  /// eigenvalue and `factor` is meaningless; 0: there is none.
  double negative_pivot = 0.0;
};

/// Factors a symmetric matrix (only the lower triangle is read) with diagonal scaling and pivoting, so that
/// parameters in very different units keep their digits. Pivots up to 64 n u of the unit diagonal count as
/// zero (u = 2^-53). Cost n^3 / 3.
[[nodiscard]] inline SemidefiniteFactor semidefinite_factor(const Eigen::MatrixXd& a) {
  const Eigen::Index n = a.rows();
  const double tolerance = 32.0 * static_cast<double>(n) * std::numeric_limits<double>::epsilon();
  SemidefiniteFactor result;
  Eigen::VectorXd scale = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double off_diagonal = std::max(a.row(i).head(i).lpNorm<Eigen::Infinity>(),
                                         a.col(i).tail(n - i - 1).lpNorm<Eigen::Infinity>());
    if (a(i, i) < 0.0 || (a(i, i) == 0.0 && off_diagonal > 0.0)) {
      result.negative_pivot = -1.0;
      return result;
    }
    scale(i) = a(i, i) > 0.0 ? 1.0 / std::sqrt(a(i, i)) : 0.0;
  }
  Eigen::MatrixXd scaled(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = j; i < n; ++i) {
      scaled(i, j) = scaled(j, i) = a(i, j) * scale(i) * scale(j);
    }
  }
  const PivotedCholesky ldlt(scaled);
  const Eigen::VectorXd pivots = ldlt.vectorD();
  const double smallest = n > 0 ? pivots.minCoeff() : 0.0;
  if (!(smallest >= -tolerance)) {
    result.negative_pivot = smallest;
    return result;
  }
  const Eigen::MatrixXd lower = ldlt.matrixL();
  const Eigen::MatrixXd columns = ldlt.transpositionsP().transpose() * lower;  // scaled = columns D columns'
  const Eigen::Index rank = (pivots.array() > tolerance).count();
  result.factor.resize(rank, n);
  for (Eigen::Index k = 0, row = 0; k < n; ++k) {
    if (pivots(k) > tolerance) {
      for (Eigen::Index i = 0; i < n; ++i) {
        result.factor(row, i) = scale(i) > 0.0 ? std::sqrt(pivots(k)) * columns(i, k) / scale(i) : 0.0;
      }
      ++row;
    }
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
