// SPDX-License-Identifier: Apache-2.0
/// @file
/// Work on large matrices cut into panels of columns, on several threads.
#pragma once

#include <algorithm>
#include <cstddef>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/parallel.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// Calls work(first, width) for panels that cover 0 .. size - 1, on up to `threads` threads (0: as many as
/// the machine has). The cuts depend on `size` alone, so what is computed panel by panel has the same bits
/// for any number of threads.
template <class Work>
void for_each_panel(Eigen::Index size, unsigned threads, const Work& work) {
  constexpr Eigen::Index kWidth = 192;  // wide enough for fast products, many enough to share out
  const Eigen::Index count = (size + kWidth - 1) / kWidth;
  for_each_in_parallel(
      static_cast<std::size_t>(count), threads,
      [&](std::size_t index) {
        const Eigen::Index first = static_cast<Eigen::Index>(index) * kWidth;
        work(first, std::min(kWidth, size - first));
      },
      [](std::size_t) {});
}

/// c = a b, panel by panel.
inline void multiply(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, Eigen::MatrixXd& c,
                     unsigned threads) {
  for_each_panel(c.cols(), threads, [&](Eigen::Index at, Eigen::Index width) {
    c.middleCols(at, width).noalias() = a * b.middleCols(at, width);
  });
}

/// Lower triangle (with parts of the upper one) of c = a' b, where that is symmetric.
inline void multiply_symmetric_tn(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, Eigen::MatrixXd& c,
                                  unsigned threads) {
  for_each_panel(c.cols(), threads, [&](Eigen::Index at, Eigen::Index width) {
    const Eigen::Index rest = c.rows() - at;
    c.block(at, at, rest, width).noalias() = a.rightCols(rest).transpose() * b.middleCols(at, width);
  });
}

/// The same of c = a b'.
inline void multiply_symmetric_nt(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, Eigen::MatrixXd& c,
                                  unsigned threads) {
  for_each_panel(c.cols(), threads, [&](Eigen::Index at, Eigen::Index width) {
    const Eigen::Index rest = c.rows() - at;
    c.block(at, at, rest, width).noalias() = a.bottomRows(rest) * b.middleRows(at, width).transpose();
  });
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
