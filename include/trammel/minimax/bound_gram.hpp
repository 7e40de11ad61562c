// SPDX-License-Identifier: Apache-2.0
/// @file
/// Weighted inner products of the bounds' matrices, shared by the structured solvers.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

/// Storage for `bound_gram` with s bounds and q columns: the s x q^2 array of matrix entries is held a few
/// columns at a time, so memory stays O(q^2).
[[nodiscard]] inline Eigen::MatrixXd bound_gram_storage(Eigen::Index s, Eigen::Index q) {
  const Eigen::Index columns = std::clamp<Eigen::Index>(4 * q / std::max<Eigen::Index>(s, 1), 1, q);
  return Eigen::MatrixXd::Zero(s, q * columns);
}

/// gram_lm = sum_ij weight(i, j) (h_l)_ij (h_m)_ij (lower triangle), h_l = rows_l' rows_l, weight symmetric
/// and not negative. Cost s^2 q^2 / 2 multiplications.
template <class Weight>
void bound_gram(const Eigen::MatrixXd& rows, const std::vector<Eigen::Index>& first_row, const Weight& weight,
                Eigen::MatrixXd& storage, Eigen::MatrixXd& gram) {
  const Eigen::Index q = rows.cols();
  const Eigen::Index s = gram.rows();
  gram.setZero();
  Eigen::Index filled = 0;
  const auto flush = [&] {
    gram.selfadjointView<Eigen::Lower>().rankUpdate(storage.leftCols(filled));
    filled = 0;
  };
  for (Eigen::Index j = 0; j < q; ++j) {
    if (filled + q - j > storage.cols()) {
      flush();
    }
    for (Eigen::Index i = j; i < q; ++i, ++filled) {
      const double factor = std::sqrt((i == j ? 1.0 : 2.0) * weight(i, j));
      for (Eigen::Index l = 0; l < s; ++l) {
        const auto at = static_cast<std::size_t>(l);
        double sum = 0.0;
        for (Eigen::Index r = first_row[at]; r < first_row[at + 1]; ++r) {
          sum += rows(r, i) * rows(r, j);
        }
        storage(l, filled) = factor * sum;
      }
    }
  }
  flush();
}

}  // namespace trammel::inline TRAMMEL_ABI::minimax
