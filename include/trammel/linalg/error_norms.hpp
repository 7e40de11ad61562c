// SPDX-License-Identifier: Apache-2.0
/// @file
/// Sizes of matrices for bounds of rounding errors. None of the norms includes its own roundings, at most one
/// per term and four more.
#pragma once

#include <cmath>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

inline constexpr double kUnitRoundoff = 0x1p-53;
/// Entries beyond this could overflow in products of products.
inline constexpr double kLargestEntry = 0x1p400;
/// Covers all errors from underflow in a sum of 2^40 terms whose factors are at most kLargestEntry.
inline constexpr double kUnderflow = 0x1p-600;
/// Covers what squares that underflow take from a norm of 2^70 entries.
inline constexpr double kSmallestNorm = 0x1p-500;

/// Factor that makes a computed sum of `terms` sizes, with a few roundings of each, an upper bound.
inline double room(Eigen::Index terms) { return 1.0 + 8.0 * static_cast<double>(terms + 8) * kUnitRoundoff; }

inline bool entries_in_range(const Eigen::MatrixXd& x) {
  return x.size() == 0 || x.cwiseAbs().maxCoeff() <= kLargestEntry;
}

/// Powers of two d that make column k of A diag(d) and row k of diag(d)^-1 B about equally large.
inline Eigen::VectorXd balance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::VectorXd scale(a.cols());
  Eigen::VectorXd b_size = Eigen::VectorXd::Zero(a.cols());
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    b_size = b_size.cwiseMax(b.col(j).cwiseAbs());
  }
  for (Eigen::Index k = 0; k < a.cols(); ++k) {
    const double ratio = b_size(k) / a.col(k).lpNorm<Eigen::Infinity>();
    scale(k) = std::isfinite(ratio) && ratio > 0.0 ? std::ldexp(1.0, std::ilogb(ratio) / 2) : 1.0;
  }
  return scale;
}

/// Euclidean norms of the rows of X diag(scale).
inline Eigen::VectorXd row_norms(const Eigen::MatrixXd& x, const Eigen::VectorXd& scale) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(x.rows());
  for (Eigen::Index k = 0; k < x.cols(); ++k) {
    squares += (scale(k) * x.col(k)).cwiseAbs2();
  }
  return (squares.cwiseSqrt().array() + kSmallestNorm).matrix();
}

inline Eigen::VectorXd row_norms(const Eigen::MatrixXd& x) {
  return row_norms(x, Eigen::VectorXd::Ones(x.cols()));
}

/// Euclidean norms of the columns of diag(scale)^-1 X.
inline Eigen::VectorXd column_norms(const Eigen::MatrixXd& x, const Eigen::VectorXd& scale) {
  const Eigen::VectorXd inverse = scale.cwiseInverse();
  Eigen::VectorXd norms(x.cols());
  for (Eigen::Index j = 0; j < x.cols(); ++j) {
    norms(j) = x.col(j).cwiseProduct(inverse).norm() + kSmallestNorm;
  }
  return norms;
}

inline Eigen::VectorXd column_norms(const Eigen::MatrixXd& x) {
  return column_norms(x, Eigen::VectorXd::Ones(x.rows()));
}

/// |X| y.
inline Eigen::VectorXd sizes_times(const Eigen::MatrixXd& x, const Eigen::VectorXd& y) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(x.rows());
  for (Eigen::Index k = 0; k < x.cols(); ++k) {
    result += y(k) * x.col(k).cwiseAbs();
  }
  return result;
}

/// |X|' y.
inline Eigen::VectorXd transposed_sizes_times(const Eigen::MatrixXd& x, const Eigen::VectorXd& y) {
  Eigen::VectorXd result(x.cols());
  for (Eigen::Index k = 0; k < x.cols(); ++k) {
    result(k) = x.col(k).cwiseAbs().dot(y);
  }
  return result;
}

/// Inner products of the rows of X and Y.
inline Eigen::VectorXd row_products(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(x.rows());
  for (Eigen::Index k = 0; k < x.cols(); ++k) {
    result += x.col(k).cwiseProduct(y.col(k));
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
