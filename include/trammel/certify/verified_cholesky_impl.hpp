// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of verified_cholesky.hpp.
#pragma once

#include <algorithm>
#include <cmath>

#include "trammel/certify/verified_cholesky.hpp"
#include "trammel/linalg/error_free.hpp"
#include "trammel/linalg/error_norms.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace verified_cholesky_detail {

using linalg::kSmallestNorm;
using linalg::kUnitRoundoff;
inline constexpr double kSmallest = 0x1p-1074;
/// Diagonal entries outside are left to fail: their scaling would not be exact.
inline constexpr double kLargestDiagonal = 0x1p900;

/// Columns eliminated together.
inline constexpr Eigen::Index kPanel = 32;

/// Factorises the columns first..first+width-1, rows below included, in place: true division and square
/// root; false at the first pivot that is not positive and finite.
inline bool factorise_panel(Eigen::MatrixXd& a, Eigen::Index first, Eigen::Index width) {
  const Eigen::Index n = a.rows();
  for (Eigen::Index k = first; k < first + width; ++k) {
    double* const pivot_column = a.data() + k * n;
    if (!(pivot_column[k] > 0.0 && std::isfinite(pivot_column[k]))) {
      return false;
    }
    const double pivot = std::sqrt(pivot_column[k]);
    for (Eigen::Index i = k + 1; i < n; ++i) {
      pivot_column[i] /= pivot;
    }
    for (Eigen::Index j = k + 1; j < first + width; ++j) {
      double* const column = a.data() + j * n;
      const double factor = pivot_column[j];
      for (Eigen::Index i = j; i < n; ++i) {
        column[i] -= pivot_column[i] * factor;
      }
    }
  }
  return true;
}

/// Factorisation of the lower triangle in place, by panels: the order of summation, which the bound of its
/// rounding errors leaves open, is all that distinguishes it from the plain one.
inline bool cholesky_succeeds(Eigen::MatrixXd& a) {
  const Eigen::Index n = a.rows();
  for (Eigen::Index first = 0; first < n; first += kPanel) {
    const Eigen::Index width = std::min(kPanel, n - first);
    if (!factorise_panel(a, first, width)) {
      return false;
    }
    const Eigen::Index next = first + width;
    a.bottomRightCorner(n - next, n - next)
        .selfadjointView<Eigen::Lower>()
        .rankUpdate(a.block(next, first, n - next, width), -1.0);
  }
  return true;
}

/// Upper bound of the 2-norm of what left and right leave open, rows scaled.
inline double factored_norm(const Eigen::MatrixXd& left, const Eigen::MatrixXd& right,
                            const Eigen::VectorXd& scale) {
  double total = 0.0;
  for (Eigen::Index k = 0; k < left.cols(); ++k) {
    total += 2.0 * (left.col(k).cwiseProduct(scale).norm() + kSmallestNorm) *
             (right.col(k).cwiseProduct(scale).norm() + kSmallestNorm);
  }
  return total * linalg::room(left.rows());
}

/// Lower triangle of the scaled matrix, and sums of the scaled radius, which may be empty, over whole rows.
inline void scale_form(const Eigen::MatrixXd& a, const Eigen::MatrixXd& radius, const Eigen::VectorXd& scale,
                       Eigen::MatrixXd& scaled, Eigen::VectorXd& row_sum) {
  const Eigen::Index n = a.rows();
  scaled.resize(n, n);
  // A scaled entry is exact unless it underflows; the smallest number covers that.
  row_sum = Eigen::VectorXd::Constant(n, static_cast<double>(n) * kSmallest);
  for (Eigen::Index j = 0; j < n; ++j) {
    const Eigen::Index rest = n - j;
    scaled.col(j).tail(rest) = scale(j) * a.col(j).tail(rest).cwiseProduct(scale.tail(rest));
    if (radius.size() == 0) {
      continue;
    }
    for (Eigen::Index i = j; i < n; ++i) {
      const double error = radius(i, j) * (scale(i) * scale(j)) + kSmallest;
      row_sum(i) += error;
      if (i != j) {
        row_sum(j) += error;
      }
    }
  }
}

inline bool positive_definite(const Eigen::MatrixXd& a, const Eigen::MatrixXd& radius,
                              const Eigen::MatrixXd& left, const Eigen::MatrixXd& right) {
  using linalg::round_up;
  const Eigen::Index n = a.rows();
  Eigen::VectorXd scale(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!(a(i, i) > 1.0 / kLargestDiagonal && a(i, i) < kLargestDiagonal)) {
      return false;
    }
    scale(i) = std::ldexp(1.0, -(std::ilogb(a(i, i)) / 2));
  }
  Eigen::MatrixXd scaled;
  Eigen::VectorXd row_sum;
  scale_form(a, radius, scale, scaled, row_sum);
  const double factored = factored_norm(left, right, scale);
  const auto size = static_cast<double>(n);
  const double count = 2.0 * (size + 1.0);
  const double gamma = round_up(count * kUnitRoundoff / (1.0 - count * kUnitRoundoff));
  double trace = 0.0;
  double largest = 0.0;
  double widest = 0.0;
  for (Eigen::Index i = 0; i < n; ++i) {
    trace += scaled(i, i);
    largest = std::max(largest, scaled(i, i));
    if (!std::isfinite(row_sum(i) + factored)) {
      return false;
    }
    widest = std::max(widest, row_sum(i) + factored);
  }
  // A few roundings up: each of the terms has at most n + 4 operations.
  const double slack = linalg::room(n);
  const double shift =
      round_up(slack * (gamma * trace / 2.0 + 4.0 * kSmallest * size * (count + largest) + widest));
  for (Eigen::Index i = 0; i < n; ++i) {
    scaled(i, i) = linalg::round_down(scaled(i, i) - shift);
  }
  return cholesky_succeeds(scaled);
}

}  // namespace verified_cholesky_detail

TRAMMEL_INLINE bool positive_definite(const UncertainForm& form) {
  return verified_cholesky_detail::positive_definite(form.middle, form.radius, form.left, form.right);
}

TRAMMEL_INLINE bool positive_definite(const Eigen::MatrixXd& a, const Eigen::MatrixXd& radius) {
  return verified_cholesky_detail::positive_definite(a, radius, {}, {});
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
