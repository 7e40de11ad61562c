// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of verified_cholesky.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "trammel/certify/verified_cholesky.hpp"
#include "trammel/linalg/double_double.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace verified_cholesky_detail {

inline constexpr double kUnitRoundoff = 0x1p-53;
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
    for (Eigen::Index column = next; column < n; column += kPanel) {
      const Eigen::Index columns = std::min(kPanel, n - column);
      a.block(column, column, n - column, columns).noalias() -=
          a.block(column, first, n - column, width) * a.block(column, first, columns, width).transpose();
    }
  }
  return true;
}

}  // namespace verified_cholesky_detail

TRAMMEL_INLINE bool positive_definite(const Eigen::MatrixXd& a, const Eigen::MatrixXd& radius) {
  using namespace verified_cholesky_detail;
  using linalg::round_up;
  const Eigen::Index n = a.rows();
  std::vector<double> scale(static_cast<std::size_t>(n));
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!(a(i, i) > 1.0 / kLargestDiagonal && a(i, i) < kLargestDiagonal)) {
      return false;
    }
    scale[static_cast<std::size_t>(i)] = std::exp2(-std::round(std::log2(a(i, i)) / 2.0));
  }
  Eigen::MatrixXd scaled(n, n);
  Eigen::VectorXd row_sum = Eigen::VectorXd::Zero(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = j; i < n; ++i) {
      const double factor = scale[static_cast<std::size_t>(i)] * scale[static_cast<std::size_t>(j)];
      scaled(i, j) = a(i, j) * factor;
      // The scaled entry is exact unless it underflows; the smallest number covers that.
      const double error = radius(i, j) * factor + kSmallest;
      row_sum(i) += error;
      if (i != j) {
        row_sum(j) += error;
      }
    }
  }
  const auto size = static_cast<double>(n);
  const double count = 2.0 * (size + 1.0);
  const double gamma = round_up(count * kUnitRoundoff / (1.0 - count * kUnitRoundoff));
  double trace = 0.0;
  double largest = 0.0;
  double widest = 0.0;
  for (Eigen::Index i = 0; i < n; ++i) {
    trace = round_up(trace + scaled(i, i));
    largest = std::max(largest, scaled(i, i));
    if (!std::isfinite(row_sum(i))) {
      return false;
    }
    widest = std::max(widest, row_sum(i));
  }
  // A few roundings up: each of the two terms has at most n + 4 operations.
  const double slack = 1.0 + 4.0 * (size + 4.0) * kUnitRoundoff;
  const double shift = slack * (gamma * trace / 2.0 + 4.0 * kSmallest * size * (count + largest) + widest);
  for (Eigen::Index i = 0; i < n; ++i) {
    scaled(i, i) = linalg::round_down(scaled(i, i) - round_up(shift));
  }
  return cholesky_succeeds(scaled);
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
