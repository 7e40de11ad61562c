// SPDX-License-Identifier: Apache-2.0
/// @file
/// Proof by floating-point Cholesky factorisation that a matrix is positive definite.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// Every symmetric X, n x n, with |X - middle| <= radius + left right' + right left', entry by entry; only
/// lower triangles are read. Radii are >= 0 or NaN, which proves nothing.
struct UncertainForm {
  Eigen::MatrixXd middle;
  Eigen::MatrixXd radius;  ///< n x n, empty: zero
  Eigen::MatrixXd left;    ///< n x r
  Eigen::MatrixXd right;   ///< n x r
};

/// True only if every X of the form is positive definite; false tells nothing.
///
/// Scale A = middle by powers of two to a diagonal near one, subtract c + r from the diagonal,
///
///   c = gamma tr(A) / 2 + 4 eta n (2 (n + 1) + max A_ii),   gamma = 2 (n + 1) u / (1 - 2 (n + 1) u),
///   r = largest row sum of the scaled radius + 2 sum |left_k| |right_k| of scaled columns (Euclidean),
///   u = 2^-53, eta = 2^-1074,
///
/// both rounded up: if a plain Cholesky factorisation then runs to its end with positive finite pivots, A
/// was positive definite with a margin of r (Rump 2006, "Verification of positive definiteness", BIT 46,
/// 433-452, theorem 2.3). Assumes arithmetic_defect() is empty. Cost: n^3 / 3 operations.
[[nodiscard]] bool positive_definite(const UncertainForm& form);

/// The same with a radius entry by entry, n x n.
[[nodiscard]] bool positive_definite(const Eigen::MatrixXd& a, const Eigen::MatrixXd& radius);

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/verified_cholesky_impl.hpp"
#endif
