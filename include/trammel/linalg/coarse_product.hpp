// SPDX-License-Identifier: Apache-2.0
/// @file
/// Products with a coarse factor: more than double precision from two plain products.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// A coarse factor W and A W rounded to nearest, up to errors of at most row_error_i column_size_j + 2^-600
/// before rounding.
struct CoarseProduct {
  Eigen::MatrixXd factor;       ///< W, n x q
  Eigen::MatrixXd product;      ///< A W, m x q
  Eigen::VectorXd row_error;    ///< m; infinite where entries are too large
  Eigen::VectorXd column_size;  ///< q, Euclidean norms of the columns of D^-1 W
};

/// A W for a W next to B that has so few bits that the product is cheap. For where B may be chosen, like a
/// basis. A = a_hi + a_lo: m x n, B: n x q; scale: D, powers of two, one per row of B.
///
/// Column j of D^-1 W is that of D^-1 B rounded to multiples of 2^-b times the power of two above its largest
/// entry, and A D = A1 + A2, where A1 has 53 - b - ceil(log2 n) bits in units of the power of two above the
/// largest entry of a row; b = min(28, 32 - ceil(log2 n)). All sums of products of A1 and W are then at most
/// 2^53 times their unit, so that A1 W is exact in binary64 whatever the order of summation (Ozaki, Ogita,
/// Oishi, Rump 2012, "Error-free transformations of matrix multiplication by using fast routines of matrix
/// multiplication and its applications"); A2 W is evaluated in plain arithmetic.
///
/// row_error is (n + 6) u |A2_i|, u = 2^-53, Euclidean: about 2^-68 |A_i| at n = 27, 2^-64 |A_i| at n = 999.
[[nodiscard]] CoarseProduct coarse_product(const Eigen::MatrixXd& a_hi, const Eigen::MatrixXd& a_lo,
                                           const Eigen::MatrixXd& b, const Eigen::VectorXd& scale);

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifndef TRAMMEL_COMPILED
#include "trammel/linalg/coarse_product_impl.hpp"
#endif
