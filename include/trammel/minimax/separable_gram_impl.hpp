// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of separable_gram.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "trammel/core/parallel.hpp"
#include "trammel/minimax/separable_gram.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

namespace detail {

/// exp(-x) below this is nothing beside kExponentialSumError.
inline constexpr double kDiedOut = 8.0;
/// Rows of the bounds that make up one column panel of the Gram matrix.
inline constexpr Eigen::Index kGramPanelRows = 96;

/// First bound of each panel, and the number of bounds.
inline std::vector<std::size_t> gram_panels(const std::vector<Eigen::Index>& first_row) {
  std::vector<std::size_t> panels{0};
  for (std::size_t l = 1; l + 1 < first_row.size(); ++l) {
    if (first_row[l + 1] - first_row[panels.back()] > kGramPanelRows) {
      panels.push_back(l);
    }
  }
  panels.push_back(first_row.size() - 1);
  return panels;
}

}  // namespace detail

TRAMMEL_INLINE std::vector<ExponentialTerm> exponential_sum(double smallest, double largest) {
  constexpr double kStep = 1.2;        // error of the rule: 3e-3
  constexpr double kNearlyFlat = 0.3;  // rates up to this over `largest` are put together
  std::vector<ExponentialTerm> terms;
  const double first = kNearlyFlat / largest;
  // The rates first, first exp(-step), ... as one, with their total weight and mean rate.
  const double ratio = std::exp(-kStep);
  terms.push_back(
      {.weight = kStep * first / (1.0 - ratio), .rate = first * (1.0 - ratio) / (1.0 - ratio * ratio)});
  for (double rate = first / ratio; rate * smallest < detail::kDiedOut; rate /= ratio) {
    terms.push_back({.weight = kStep * rate, .rate = rate});
  }
  return terms;
}

TRAMMEL_INLINE void separable_gram(const Eigen::MatrixXd& rows, const std::vector<Eigen::Index>& first_row,
                                   const Eigen::VectorXd& root, Eigen::MatrixXd& gram, unsigned threads) {
  const Eigen::Index p = root.size();
  const std::vector<ExponentialTerm> terms = exponential_sum(2.0 * root[0], 2.0 * root[p - 1]);
  // Column k of the factors is the diagonal of D_k, w_k^(1/2) exp(-t_k b) / b; `reach` columns of it count.
  Eigen::MatrixXd factors(p, static_cast<Eigen::Index>(terms.size()));
  std::vector<Eigen::Index> reach;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const ExponentialTerm& term = terms[k];
    factors.col(static_cast<Eigen::Index>(k)) =
        std::sqrt(term.weight) * (-term.rate * root.array()).exp() / root.array();
    const double limit = detail::kDiedOut / term.rate - root[0];
    reach.push_back(std::upper_bound(root.data(), root.data() + p, limit) - root.data());
  }
  gram.setZero();
  const std::vector<std::size_t> panels = detail::gram_panels(first_row);
  const std::size_t bounds = panels.back();
  struct Storage {
    Eigen::MatrixXd scaled, product;
  };
  for_each_with_own_work(
      panels.size() - 1, threads,
      [&](std::size_t) {
        return [&, storage = Storage{}](std::size_t index) mutable {
          const std::size_t begin = panels[index];
          const std::size_t end = panels[index + 1];
          const Eigen::Index top = first_row[begin];
          const Eigen::Index width = first_row[end] - top;
          const Eigen::Index height = rows.rows() - top;
          for (std::size_t k = 0; k < terms.size(); ++k) {
            if (reach[k] == 0) {
              continue;
            }
            storage.scaled.noalias() = rows.block(top, 0, width, reach[k]) *
                                       factors.col(static_cast<Eigen::Index>(k)).head(reach[k]).asDiagonal();
            storage.product.resize(height, width);
            storage.product.noalias() = rows.block(top, 0, height, reach[k]) * storage.scaled.transpose();
            storage.product = storage.product.cwiseAbs2();
            for (std::size_t m = begin; m < end; ++m) {
              const auto columns =
                  storage.product.middleCols(first_row[m] - top, first_row[m + 1] - first_row[m]);
              for (std::size_t l = m; l < bounds; ++l) {
                gram(static_cast<Eigen::Index>(l), static_cast<Eigen::Index>(m)) +=
                    columns.middleRows(first_row[l] - top, first_row[l + 1] - first_row[l]).sum();
              }
            }
          }
        };
      },
      [](std::size_t) {});
}

}  // namespace trammel::inline TRAMMEL_ABI::minimax
