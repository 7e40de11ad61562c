// SPDX-License-Identifier: Apache-2.0
/// @file
/// Products with a coarse factor: more than double precision from three plain products.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/double_double.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// A coarse factor W and a product with it.
struct CoarseProduct {
  Eigen::MatrixXd factor;  ///< W
  EnclosedMatrix product;  ///< A W
};

/// A W, enclosed, for a W next to B that has so few bits that the product is cheap. For where B may be
/// chosen, like a basis. A: m x n, B: n x q.
///
/// After a diagonal scaling D of the inner dimension by powers of two, which balances A D and D^-1 B, column
/// j of D^-1 W is that of D^-1 B rounded to multiples of 2^-24 times the power of two above its largest
/// entry, and A D = A1 + A2 + A3: A1 and A2 have 29 - ceil(log2 n) bits each, in units 2^-beta and 2^(-2
/// beta) of the power of two above the largest entry of a row. All sums of products of A1 and W, and of A2
/// and W, are then at most 2^53 times their unit, so that A1 W and A2 W are exact in binary64 whatever the
/// order of summation (Ozaki, Ogita, Oishi, Rump 2012, "Error-free transformations of matrix multiplication
/// by using fast routines of matrix multiplication and its applications"); A3 W is evaluated in plain
/// arithmetic.
///
/// Radius: (n + 6) u |A3_i| |W_j|, u = 2^-53, with Euclidean norms of row and column, beside what the radius
/// of A causes: 2^-93 of them at n = 27, 2^-83 at n = 999. Entries beyond 2^400 give an infinite radius;
/// underflow is covered by an absolute term.
[[nodiscard]] CoarseProduct coarse_product(const EnclosedMatrix& a, const Eigen::MatrixXd& b);

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifndef TRAMMEL_COMPILED
#include "trammel/linalg/coarse_product_impl.hpp"
#endif
