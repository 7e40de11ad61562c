// SPDX-License-Identifier: Apache-2.0
/// @file
/// Products with a coarse factor: more than double precision from three plain products.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// A coarse factor W and A W = hi + lo, up to errors of at most row_error_i column_size_j + 4 u^2 |hi_ij| +
/// 2^-600.
struct CoarseProduct {
  Eigen::MatrixXd factor;       ///< W, n x q
  Eigen::MatrixXd hi;           ///< m x q
  Eigen::MatrixXd lo;           ///< m x q
  Eigen::VectorXd row_error;    ///< m; infinite where entries are too large
  Eigen::VectorXd column_size;  ///< q, Euclidean norms of the columns of D^-1 W
};

/// A W for a W next to B that has so few bits that the product is cheap. For where B may be chosen, like a
/// basis. A = a_hi + a_lo: m x n, B: n x q; scale: D, powers of two, one per row of B.
///
/// Column j of D^-1 W is that of D^-1 B rounded to multiples of 2^-24 times the power of two above its
/// largest entry, and A D = A1 + A2 + A3: A1 and A2 have 29 - ceil(log2 n) bits each, in units 2^-beta and
/// 2^(-2 beta) of the power of two above the largest entry of a row. All sums of products of A1 and W, and of
/// A2 and W, are then at most 2^53 times their unit, so that A1 W and A2 W are exact in binary64 whatever the
/// order of summation (Ozaki, Ogita, Oishi, Rump 2012, "Error-free transformations of matrix multiplication
/// by using fast routines of matrix multiplication and its applications"); A3 W is evaluated in plain
/// arithmetic.
///
/// row_error is (n + 6) u |A3_i|, u = 2^-53, Euclidean: about 2^-93 |A_i| at n = 27, 2^-83 |A_i| at n = 999.
[[nodiscard]] CoarseProduct coarse_product(const Eigen::MatrixXd& a_hi, const Eigen::MatrixXd& a_lo,
                                           const Eigen::MatrixXd& b, const Eigen::VectorXd& scale);

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifndef TRAMMEL_COMPILED
#include "trammel/linalg/coarse_product_impl.hpp"
#endif
