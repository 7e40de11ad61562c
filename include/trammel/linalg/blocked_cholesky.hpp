// SPDX-License-Identifier: Apache-2.0
/// @file
/// Cholesky factorisation in place, with a guard for dependent rows, and what is made from the factor. For any
/// scalar Eigen can multiply.
#pragma once

#include <cmath>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// What to do with pivots that are not larger than the threshold.
template <class Scalar>
struct PivotGuard {
  Scalar threshold{0};  ///< pivots up to this (or NaN) are too small
  /// Replaces a pivot too small, so that the variable stays where it is; 0: the factorisation fails instead.
  Scalar replacement{0};
};

namespace detail {

inline constexpr Eigen::Index kCholeskyBlock = 64;  // panels that fit the first-level cache

/// Unblocked factorisation of the lower triangle; number of replaced pivots, -1 on failure.
template <class Scalar, class Derived>
Eigen::Index factor_small(Eigen::MatrixBase<Derived>& a, const PivotGuard<Scalar>& guard) {
  using std::sqrt;
  Eigen::Index replaced = 0;
  const Eigen::Index size = a.rows();
  for (Eigen::Index k = 0; k < size; ++k) {
    Scalar pivot = a(k, k);
    if (!(pivot > guard.threshold)) {
      if (!(guard.replacement > Scalar(0))) {
        return -1;
      }
      pivot = guard.replacement;
      ++replaced;
    }
    pivot = sqrt(pivot);
    a(k, k) = pivot;
    const Eigen::Index rest = size - k - 1;
    if (rest > 0) {
      a.col(k).tail(rest) /= pivot;
      for (Eigen::Index j = k + 1; j < size; ++j) {
        const Scalar factor = a(j, k);
        a.col(j).tail(size - j) -= factor * a.col(k).tail(size - j);
      }
    }
  }
  return replaced;
}

}  // namespace detail

/// A = L L' in the lower triangle of `a`; the strict upper one is neither read nor written. Returns the number of
/// replaced pivots (0: A is numerically positive definite), -1 on failure. About n^3/3 operations.
template <class Scalar>
[[nodiscard]] Eigen::Index cholesky_in_place(
    Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& a, const PivotGuard<Scalar>& guard = {}) {
  const Eigen::Index size = a.rows();
  Eigen::Index replaced = 0;
  for (Eigen::Index k = 0; k < size; k += detail::kCholeskyBlock) {
    const Eigen::Index width = std::min(detail::kCholeskyBlock, size - k);
    const Eigen::Index rest = size - k - width;
    auto diagonal = a.block(k, k, width, width);
    const Eigen::Index here = detail::factor_small<Scalar>(diagonal, guard);
    if (here < 0) {
      return -1;
    }
    replaced += here;
    if (rest > 0) {
      auto panel = a.block(k + width, k, rest, width);
      diagonal.template triangularView<Eigen::Lower>().transpose().template solveInPlace<Eigen::OnTheRight>(
          panel);
      a.block(k + width, k + width, rest, rest)
          .template selfadjointView<Eigen::Lower>()
          .rankUpdate(panel, Scalar(-1));
    }
  }
  return replaced;
}

namespace detail {

template <class Scalar, class Derived>
void invert_lower(Eigen::MatrixBase<Derived>&& a) {
  const Eigen::Index size = a.rows();
  if (size <= kCholeskyBlock) {
    using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
    Matrix inverse = Matrix::Identity(size, size);
    a.template triangularView<Eigen::Lower>().solveInPlace(inverse);
    a.template triangularView<Eigen::Lower>() = inverse;
    return;
  }
  const Eigen::Index half = (size / 2 + kCholeskyBlock - 1) / kCholeskyBlock * kCholeskyBlock;
  const Eigen::Index rest = size - half;
  auto lower_left = a.block(half, 0, rest, half);
  // L21 <- -L22^-1 L21 L11^-1, then the two diagonal blocks.
  a.block(0, 0, half, half)
      .template triangularView<Eigen::Lower>()
      .template solveInPlace<Eigen::OnTheRight>(lower_left);
  a.block(half, half, rest, rest).template triangularView<Eigen::Lower>().solveInPlace(lower_left);
  lower_left *= Scalar(-1);
  invert_lower<Scalar>(a.block(0, 0, half, half));
  invert_lower<Scalar>(a.block(half, half, rest, rest));
}

}  // namespace detail

/// L^-1 in the place of L (lower triangle only). About n^3/3 operations.
template <class Scalar>
void invert_lower_in_place(Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& factor) {
  detail::invert_lower<Scalar>(factor.topLeftCorner(factor.rows(), factor.cols()));
}

/// Full symmetric A^-1 = L^-T L^-1 from `inverse_factor` = L^-1, whose strict upper triangle must be zero. About
/// n^3/3 operations.
template <class Scalar>
void inverse_from_factor(const Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& inverse_factor,
                         Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& inverse) {
  constexpr Eigen::Index kRows = 2 * detail::kCholeskyBlock;
  const Eigen::Index size = inverse_factor.rows();
  inverse.resize(size, size);
  for (Eigen::Index k = 0; k < size; k += kRows) {
    const Eigen::Index width = std::min(kRows, size - k);
    inverse.block(k, 0, width, k + width).noalias() =
        inverse_factor.block(k, k, size - k, width).transpose() *
        inverse_factor.block(k, 0, size - k, k + width);
  }
  for (Eigen::Index j = 0; j < size; ++j) {
    for (Eigen::Index i = j + 1; i < size; ++i) {
      inverse(j, i) = inverse(i, j);
    }
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
