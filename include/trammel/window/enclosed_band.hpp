// SPDX-License-Identifier: Apache-2.0
/// @file
/// Banded matrices with proved error radii, and proofs of positive definiteness at linear cost.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/banded_matrix.hpp"
#include "trammel/linalg/double_double.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

/// A real number known to lie within `radius` of `value`.
struct EnclosedNumber {
  double value = 0.0;
  double radius = 0.0;

  [[nodiscard]] double upper() const { return linalg::round_up(value + radius); }
  [[nodiscard]] double lower() const { return linalg::round_down(value - radius); }
};

/// Every real matrix whose row i lies within radius(i) of that of `value`, in the 2-norm.
///
/// Radii are those of plain double arithmetic in any order of summation, fused or not: a sum of n products
/// errs by at most gamma_n = n u / (1 - n u) times the sum of their sizes, u = 2^-53 (Higham 2002, "Accuracy
/// and stability of numerical algorithms", section 3.1). Radii themselves are computed with kRoom to spare,
/// which covers their own roundings up to a million terms; kTiny covers underflow.
struct EnclosedBand {
  linalg::BandedMatrix value;
  Eigen::VectorXd radius;

  /// Exactly `exact`.
  explicit EnclosedBand(linalg::BandedMatrix exact)
      : value(std::move(exact)), radius(Eigen::VectorXd::Zero(value.size())) {}
  EnclosedBand(linalg::BandedMatrix entries, Eigen::VectorXd radii)
      : value(std::move(entries)), radius(std::move(radii)) {}

  /// 2-norm of every row, rounded up.
  [[nodiscard]] Eigen::VectorXd row_norms() const;
  /// Bound of the Frobenius norm of the error.
  [[nodiscard]] double error() const;
  /// Bound of the 2-norm of the matrices enclosed and of that of their absolute values.
  [[nodiscard]] double norm_bound() const;
  /// Enclosure of the squared Frobenius norm.
  [[nodiscard]] EnclosedNumber squared_norm() const;
};

/// A B.
[[nodiscard]] EnclosedBand multiply(const EnclosedBand& A, const EnclosedBand& B);
/// a A + b B for a, b of size 1.
[[nodiscard]] EnclosedBand add_signed(double a, const EnclosedBand& A, double b, const EnclosedBand& B);
/// diag(d) A, d exact.
[[nodiscard]] EnclosedBand scale_rows(const Eigen::VectorXd& d, const EnclosedBand& A);
/// tr A'B.
[[nodiscard]] EnclosedNumber inner_product(const EnclosedBand& A, const EnclosedBand& B);

/// True only if every symmetric X within `error` (2-norm) of A is positive definite; false tells nothing.
/// Only the lower triangle of A is read.
///
/// Factorises A - (c + error) I by Cholesky's method: its computed factor L has rows of at most b + 1
/// entries, b = A.lower(), so that |L L' - A| <= gamma_(b+2) |L||L'| (Demmel 1989; Rump 2006, "Verification
/// of positive definiteness", BIT 46, 433-452), of which no row sum exceeds (2 b + 1) max A_ii / (1 - gamma):
/// c is that, rounded up. Cost: n b^2 operations.
[[nodiscard]] bool positive_definite(linalg::BandedMatrix A, double error);

/// s > 0 such that every symmetric X within `error` of A exceeds s I, the largest found among `start` times
/// powers of two; 0 if none is found within kHalvings.
[[nodiscard]] double least_eigenvalue(const linalg::BandedMatrix& A, double error, double start);

/// Relative room for the roundings of radii.
inline constexpr double kRoom = 1.0 + 1e-8;
inline constexpr double kUnitRoundoff = 0x1p-53;
/// More than any underflow of a sum of a million products.
inline constexpr double kTiny = 1e-290;
/// Halvings tried by least_eigenvalue.
inline constexpr int kHalvings = 40;

/// gamma_n, rounded up.
[[nodiscard]] inline double gamma(Eigen::Index n) {
  const double nu = static_cast<double>(n) * kUnitRoundoff;
  return kRoom * nu / (1.0 - nu);
}

}  // namespace trammel::inline TRAMMEL_ABI::window

#ifndef TRAMMEL_COMPILED
#include "trammel/window/enclosed_band_impl.hpp"
#endif
