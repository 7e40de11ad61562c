// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of gram_eigen.hpp.
#pragma once

#include <algorithm>
#include <limits>

#include "trammel/linalg/gram_eigen.hpp"
#include "trammel/linalg/panels.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

namespace detail {
/// Norms below this share of the largest are not trusted: the rounding errors of their squares are 1e-6 of
/// them.
inline constexpr double kTrusted = 1e-5;
}  // namespace detail

TRAMMEL_INLINE void GramEigen::compute(const Eigen::MatrixXd& B, unsigned threads) {
  multiply_symmetric_tn(B, B, square_, threads);
  eigen_.compute(square_, threads);
  vectors_ = eigen_.eigenvectors();
  multiply(B, vectors_, images_, threads);
  norms_ = images_.colwise().norm();
  const Eigen::Index n = vectors_.cols();
  if (n <= RepeatedSymmetricEigen::kLargest) {
    return;
  }
  // Column numbers `small` .. are settled.
  Eigen::Index settled = n;
  while (true) {
    const double limit = detail::kTrusted * norms_.head(settled).maxCoeff();
    const double* const begin = norms_.data();
    const Eigen::Index small =
        std::partition_point(begin, begin + settled, [limit](double norm) { return norm < limit; }) - begin;
    if (small == 0 || small == settled) {
      return;
    }
    settled = small;
    refine(small, threads);
  }
}

/// The first `small` columns, orthogonal to the others, decomposed by themselves.
TRAMMEL_INLINE void GramEigen::refine(Eigen::Index small, unsigned threads) {
  const Eigen::Index large = vectors_.cols() - small;
  const auto large_images = images_.rightCols(large);
  const auto large_vectors = vectors_.rightCols(large);
  const Eigen::VectorXd squares = norms_.tail(large).cwiseAbs2();
  Eigen::MatrixXd coupling(large, small);
  for_each_panel(small, threads, [&](Eigen::Index at, Eigen::Index width) {
    auto panel = coupling.middleCols(at, width);
    panel.noalias() = large_images.transpose() * images_.middleCols(at, width);
    panel.array().colwise() /= squares.array();
    images_.middleCols(at, width).noalias() -= large_images * panel;
    vectors_.middleCols(at, width).noalias() -= large_vectors * panel;
  });
  Eigen::MatrixXd part = images_.leftCols(small);
  Eigen::MatrixXd square(small, small);
  multiply_symmetric_tn(part, part, square, threads);
  RepeatedSymmetricEigen eigen(small);
  eigen.compute(square, threads);
  const Eigen::MatrixXd& turn = eigen.eigenvectors();
  for_each_panel(small, threads, [&](Eigen::Index at, Eigen::Index width) {
    images_.middleCols(at, width).noalias() = part * turn.middleCols(at, width);
  });
  part = vectors_.leftCols(small);
  for_each_panel(small, threads, [&](Eigen::Index at, Eigen::Index width) {
    vectors_.middleCols(at, width).noalias() = part * turn.middleCols(at, width);
  });
  norms_.head(small) = images_.leftCols(small).colwise().norm();
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
