// SPDX-License-Identifier: Apache-2.0
/// @file
/// Orthogonal factorisations of dense matrices.
#pragma once

#include <Eigen/QR>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// A = Q R.
using Qr = Eigen::HouseholderQR<Eigen::MatrixXd>;
/// A P = Q R with column pivoting; rank() tells the numerical rank.
using PivotedQr = Eigen::ColPivHouseholderQR<Eigen::MatrixXd>;

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifdef TRAMMEL_COMPILED
extern template class Eigen::HouseholderQR<Eigen::MatrixXd>;
extern template class Eigen::ColPivHouseholderQR<Eigen::MatrixXd>;
#endif

namespace trammel::inline TRAMMEL_ABI::linalg {

/// A matrix with the same Gram matrix and no more rows than columns: R of A = Q R, or A itself.
inline Eigen::MatrixXd compressed(Eigen::MatrixXd matrix) {
  if (matrix.rows() > matrix.cols()) {
    const Qr qr(matrix);
    matrix = qr.matrixQR().topRows(matrix.cols()).triangularView<Eigen::Upper>();
  }
  return matrix;
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
