// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of stacked_triangle.hpp.
#pragma once

#include <algorithm>

#include <Eigen/Householder>

#include "trammel/linalg/stacked_triangle.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

namespace detail {
inline constexpr Eigen::Index kReflectors = 24;
}  // namespace detail

TRAMMEL_INLINE StackedTriangle::StackedTriangle(Eigen::Index rows, Eigen::Index columns)
    : work_(rows + columns, columns),
      vectors_(rows + columns, detail::kReflectors),
      T_(detail::kReflectors, detail::kReflectors),
      projected_(detail::kReflectors, columns),
      scaled_(detail::kReflectors, columns),
      row_(columns),
      coefficients_(detail::kReflectors) {}

TRAMMEL_INLINE void StackedTriangle::compute(const Eigen::MatrixXd& A) {
  const Eigen::Index n = work_.cols();
  work_.topRows(A.rows()) = A;
  work_.bottomRows(n).setIdentity();
  for (Eigen::Index first = 0; first < n; first += detail::kReflectors) {
    const Eigen::Index width = std::min(detail::kReflectors, n - first);
    const Eigen::Index rows = A.rows() + width;  // below them the panel is zero still
    reflect_panel(first, width, rows);
    const Eigen::Index rest = n - first - width;
    if (rest == 0) {
      continue;
    }
    const auto V = vectors_.topLeftCorner(rows, width);
    auto trailing = work_.block(first, first + width, rows, rest);
    auto projected = projected_.topLeftCorner(width, rest);
    auto scaled = scaled_.topLeftCorner(width, rest);
    projected.noalias() = V.transpose() * trailing;
    scaled.noalias() = T_.topLeftCorner(width, width).transpose() * projected;
    trailing.noalias() -= V * scaled;
  }
}

/// Reflections of the columns `first` .. of `rows` rows from row `first`: R in place, V and T for the rest.
TRAMMEL_INLINE void StackedTriangle::reflect_panel(Eigen::Index first, Eigen::Index width,
                                                   Eigen::Index rows) {
  auto panel = work_.block(first, first, rows, width);
  vectors_.topLeftCorner(rows, width).setZero();
  T_.setZero();
  for (Eigen::Index j = 0; j < width; ++j) {
    // Column j of the panel reaches down to the row of its own one in the identity.
    const Eigen::Index length = rows - width + 1;
    double tau = 0.0;
    double beta = 0.0;
    panel.col(j).segment(j, length).makeHouseholderInPlace(tau, beta);
    auto v = vectors_.col(j).segment(j, length);
    v = panel.col(j).segment(j, length);
    v(0) = 1.0;
    panel(j, j) = beta;
    const Eigen::Index rest = width - j - 1;
    if (rest > 0) {
      auto block = panel.block(j, j + 1, length, rest);
      row_.head(rest).noalias() = block.transpose() * v;
      block.noalias() -= tau * v * row_.head(rest).transpose();
    }
    if (j > 0) {
      coefficients_.head(j).noalias() = vectors_.block(j, 0, length, j).transpose() * v;
      coefficients_.head(j) *= -tau;
      T_.col(j).head(j).noalias() =
          T_.topLeftCorner(j, j).triangularView<Eigen::Upper>() * coefficients_.head(j);
    }
    T_(j, j) = tau;
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
