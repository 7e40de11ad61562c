// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of tridiagonal_form.hpp.
#pragma once

#include <algorithm>

#include <Eigen/Householder>

#include "trammel/linalg/panels.hpp"
#include "trammel/linalg/tridiagonal_form.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

namespace detail {
inline constexpr Eigen::Index kTridiagonalPanel = 32;  // reflections per update of the rest
}  // namespace detail

TRAMMEL_INLINE TridiagonalForm::TridiagonalForm(Eigen::Index size)
    : work_(size, size),
      vectors_(size, 2 * detail::kTridiagonalPanel),
      swapped_(size, 2 * detail::kTridiagonalPanel),
      diagonal_(size),
      off_diagonal_(size - 1),
      factor_(size - 1),
      inner_(2 * detail::kTridiagonalPanel) {}

TRAMMEL_INLINE void TridiagonalForm::compute(const Eigen::MatrixXd& matrix, unsigned threads) {
  work_ = matrix;
  const Eigen::Index n = work_.rows();
  for (Eigen::Index first = 0; first < n; first += detail::kTridiagonalPanel) {
    const Eigen::Index width = std::min(detail::kTridiagonalPanel, n - first);
    reflect_panel(first, width);
    update_rest(first, width, threads);
  }
}

/// Reflections of the columns `first` .. ; the rest of the matrix is read as it was before the panel.
TRAMMEL_INLINE void TridiagonalForm::reflect_panel(Eigen::Index first, Eigen::Index width) {
  const Eigen::Index n = work_.rows();
  auto V = vectors_.leftCols(width);
  auto W = vectors_.middleCols(width, width);
  V.setZero();
  W.setZero();
  for (Eigen::Index j = 0; j < width; ++j) {
    const Eigen::Index i = first + j;
    const Eigen::Index rest = n - i - 1;
    auto column = work_.col(i).tail(rest + 1);
    if (j > 0) {
      column.noalias() -= V.block(i, 0, rest + 1, j) * W.row(i).head(j).transpose();
      column.noalias() -= W.block(i, 0, rest + 1, j) * V.row(i).head(j).transpose();
    }
    diagonal_[i] = work_(i, i);
    if (rest == 0) {
      break;
    }
    double tau = 0.0;
    double beta = 0.0;
    work_.col(i).tail(rest).makeHouseholderInPlace(tau, beta);
    off_diagonal_[i] = beta;
    factor_[i] = tau;
    auto v = V.col(j).tail(rest);
    v = work_.col(i).tail(rest);
    v[0] = 1.0;
    auto w = W.col(j).tail(rest);
    w.noalias() = work_.bottomRightCorner(rest, rest).selfadjointView<Eigen::Lower>() * v;
    if (j > 0) {
      auto inner = inner_.head(j);
      inner.noalias() = W.block(i + 1, 0, rest, j).transpose() * v;
      w.noalias() -= V.block(i + 1, 0, rest, j) * inner;
      inner.noalias() = V.block(i + 1, 0, rest, j).transpose() * v;
      w.noalias() -= W.block(i + 1, 0, rest, j) * inner;
    }
    w *= tau;
    w -= (0.5 * tau * w.dot(v)) * v;
  }
}

/// Subtracts V W' + W V' from the lower triangle of what the panel left.
TRAMMEL_INLINE void TridiagonalForm::update_rest(Eigen::Index first, Eigen::Index width, unsigned threads) {
  const Eigen::Index begin = first + width;
  const Eigen::Index rest = work_.rows() - begin;
  if (rest == 0) {
    return;
  }
  auto left = vectors_.block(begin, 0, rest, 2 * width);
  auto right = swapped_.topLeftCorner(rest, 2 * width);
  right.leftCols(width) = left.rightCols(width);
  right.rightCols(width) = left.leftCols(width);
  auto trailing = work_.bottomRightCorner(rest, rest);
  for_each_panel(rest, threads, [&](Eigen::Index at, Eigen::Index size) {
    trailing.block(at, at, rest - at, size).noalias() -=
        left.bottomRows(rest - at) * right.middleRows(at, size).transpose();
  });
}

TRAMMEL_INLINE void TridiagonalForm::apply_basis(Eigen::MatrixXd& x, unsigned threads) const {
  const Eigen::Index n = work_.rows();
  const auto basis = Eigen::HouseholderSequence<const Eigen::MatrixXd, const Eigen::VectorXd>(work_, factor_)
                         .setLength(n - 1)
                         .setShift(1);
  for_each_panel(x.cols(), threads, [&](Eigen::Index at, Eigen::Index size) {
    auto columns = x.middleCols(at, size);
    columns.applyOnTheLeft(basis);
  });
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
