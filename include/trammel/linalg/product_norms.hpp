// SPDX-License-Identifier: Apache-2.0
/// @file
/// What the enclosed products share: norms of the factors, range of the entries, products by part.
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/double_double.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg::double_double_detail {

inline constexpr double kUnitRoundoff = 0x1p-53;
/// Entries beyond this could overflow in products of products.
inline constexpr double kLargestEntry = 0x1p400;
/// Covers all errors from underflow in a sum of 2^40 terms whose factors are at most kLargestEntry.
inline constexpr double kUnderflow = 0x1p-600;
/// Covers what squares that underflow take from a norm of 2^70 entries.
inline constexpr double kSmallestNorm = 0x1p-500;

inline bool entries_in_range(const Eigen::MatrixXd& x) {
  return x.size() == 0 || x.cwiseAbs().maxCoeff() <= kLargestEntry;
}

/// Powers of two d that make column k of A diag(d) and row k of diag(d)^-1 B about equally large.
inline Eigen::VectorXd balance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::VectorXd a_size = Eigen::VectorXd::Zero(a.cols());
  Eigen::VectorXd b_size = Eigen::VectorXd::Zero(a.cols());
  for (Eigen::Index k = 0; k < a.cols(); ++k) {
    a_size(k) = a.col(k).lpNorm<Eigen::Infinity>();
  }
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    b_size = b_size.cwiseMax(b.col(j).cwiseAbs());
  }
  for (Eigen::Index k = 0; k < a.cols(); ++k) {
    const double ratio = b_size(k) / a_size(k);
    a_size(k) =
        std::isfinite(ratio) && ratio > 0.0 ? std::ldexp(1.0, static_cast<int>(std::ilogb(ratio) / 2)) : 1.0;
  }
  return a_size;
}

/// Euclidean norms of the rows of X diag(scale), but for roundings.
inline Eigen::VectorXd row_norms(const Eigen::MatrixXd& x, const Eigen::VectorXd& scale) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(x.rows());
  for (Eigen::Index k = 0; k < x.cols(); ++k) {
    squares += (scale(k) * x.col(k)).cwiseAbs2();
  }
  return (squares.cwiseSqrt().array() + kSmallestNorm).matrix();
}

/// Euclidean norms of the columns of diag(scale)^-1 X, but for roundings.
inline Eigen::VectorXd column_norms(const Eigen::MatrixXd& x, const Eigen::VectorXd& scale) {
  const Eigen::VectorXd inverse = scale.cwiseInverse();
  Eigen::VectorXd norms(x.cols());
  for (Eigen::Index j = 0; j < x.cols(); ++j) {
    norms(j) = x.col(j).cwiseProduct(inverse).norm() + kSmallestNorm;
  }
  return norms;
}

/// c += a b, or its lower triangle (with parts of the upper one).
template <class A, class B>
inline void add_product(const A& a, const B& b, ProductPart part, Eigen::MatrixXd& c) {
  constexpr Eigen::Index kPanel = 96;
  if (part == ProductPart::kFull) {
    c.noalias() += a * b;
    return;
  }
  for (Eigen::Index j = 0; j < c.cols(); j += kPanel) {
    const Eigen::Index width = std::min(kPanel, c.cols() - j);
    c.block(j, j, c.rows() - j, width).noalias() += a.bottomRows(c.rows() - j) * b.middleCols(j, width);
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg::double_double_detail
