// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of enclosed_band.hpp.
#pragma once

#include "trammel/window/enclosed_band.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

TRAMMEL_INLINE Eigen::VectorXd EnclosedBand::row_norms() const {
  Eigen::VectorXd norms(value.size());
  for (Eigen::Index i = 0; i < value.size(); ++i) {
    norms(i) = kRoom * value.row(i).norm() + kTiny;
  }
  return norms;
}

TRAMMEL_INLINE double EnclosedBand::error() const { return kRoom * radius.norm(); }

TRAMMEL_INLINE double EnclosedBand::norm_bound() const {
  Eigen::VectorXd columns = Eigen::VectorXd::Zero(value.size());
  double largest_row = 0.0;
  for (Eigen::Index i = 0; i < value.size(); ++i) {
    double sum = 0.0;
    for (Eigen::Index j = value.first(i); j < value.behind(i); ++j) {
      const double size = std::abs(value.at(i, j));
      sum += size;
      columns(j) += size;
    }
    largest_row = std::max(largest_row, sum);
  }
  const double largest_column = value.size() > 0 ? columns.maxCoeff() : 0.0;
  return kRoom * (std::sqrt(largest_row * largest_column) + error());
}

TRAMMEL_INLINE EnclosedNumber EnclosedBand::squared_norm() const { return inner_product(*this, *this); }

TRAMMEL_INLINE EnclosedBand multiply(const EnclosedBand& A, const EnclosedBand& B) {
  EnclosedBand result(A.value * B.value);
  const Eigen::VectorXd norms = B.row_norms();
  const double rounding = gamma(A.value.width() + 1);
  const double all = A.radius.isZero(0.0) ? 0.0 : B.norm_bound();
  for (Eigen::Index i = 0; i < A.value.size(); ++i) {
    double radius = A.radius(i) * all + kTiny;
    for (Eigen::Index k = A.value.first(i); k < A.value.behind(i); ++k) {
      radius += std::abs(A.value.at(i, k)) * (rounding * norms(k) + B.radius(k));
    }
    result.radius(i) = kRoom * radius;
  }
  return result;
}

TRAMMEL_INLINE EnclosedBand add_signed(double a, const EnclosedBand& A, double b, const EnclosedBand& B) {
  EnclosedBand result(linalg::combine(a, A.value, b, B.value));
  result.radius = kRoom * (A.radius + B.radius + kUnitRoundoff * result.row_norms());
  return result;
}

TRAMMEL_INLINE EnclosedBand scale_rows(const Eigen::VectorXd& d, const EnclosedBand& A) {
  EnclosedBand result = A;
  for (Eigen::Index i = 0; i < A.value.size(); ++i) {
    result.value.row(i) *= d(i);
  }
  result.radius =
      kRoom * (d.cwiseAbs().cwiseProduct(A.radius) + kUnitRoundoff * result.row_norms()).array() + kTiny;
  return result;
}

TRAMMEL_INLINE EnclosedNumber inner_product(const EnclosedBand& A, const EnclosedBand& B) {
  const Eigen::VectorXd a = A.row_norms();
  const Eigen::VectorXd b = B.row_norms();
  const double sizes = a.dot(b);
  const double radius = gamma(A.value.size() + A.value.width() + 1) * sizes + A.radius.dot(b) +
                        B.radius.dot(a) + A.radius.dot(B.radius) + kTiny;
  return {.value = linalg::inner_product(A.value, B.value), .radius = kRoom * radius};
}

TRAMMEL_INLINE bool positive_definite(linalg::BandedMatrix A, double error) {
  double largest = 0.0;
  for (Eigen::Index i = 0; i < A.size(); ++i) {
    if (!(A.at(i, i) > 0.0 && std::isfinite(A.at(i, i)))) {
      return false;
    }
    largest = std::max(largest, A.at(i, i));
  }
  const double rounding = gamma(A.lower() + 3);
  const double shift =
      kRoom * (rounding * static_cast<double>(2 * A.lower() + 1) * largest / (1.0 - 2.0 * rounding) + error) +
      kTiny;
  for (Eigen::Index i = 0; i < A.size(); ++i) {
    A.at(i, i) = linalg::round_down(A.at(i, i) - shift);
  }
  return linalg::cholesky_in_place(A);
}

TRAMMEL_INLINE double least_eigenvalue(const linalg::BandedMatrix& A, double error, double start) {
  double s = start;
  for (int i = 0; i < kHalvings && s > 0.0; ++i, s /= 2.0) {
    // Subtracting s rounds once per entry of the diagonal.
    double largest = 0.0;
    linalg::BandedMatrix shifted = A;
    for (Eigen::Index k = 0; k < A.size(); ++k) {
      shifted.at(k, k) -= s;
      largest = std::max(largest, std::abs(shifted.at(k, k)));
    }
    if (positive_definite(std::move(shifted), kRoom * (error + kUnitRoundoff * largest))) {
      return s;
    }
  }
  return 0.0;
}

}  // namespace trammel::inline TRAMMEL_ABI::window
