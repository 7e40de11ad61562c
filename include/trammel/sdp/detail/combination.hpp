// SPDX-License-Identifier: Apache-2.0
/// @file
/// sum x_i F_i - F_0 of a Problem.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/linalg/dense_kernels.hpp"
#include "trammel/linalg/extended_double.hpp"
#include "trammel/sdp/problem.hpp"
#include "trammel/sdp/solution.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp::detail {

/// sum x_i F_i - constant F_0, rounded once, so that it is right for large x_i too.
inline BlockMatrix combine(const Problem& problem, const Eigen::VectorXd& x, double constant) {
  using Number = linalg::ExtendedDouble;
  std::vector<linalg::DenseMatrix<Number>> sum;
  for (const Block& block : problem.blocks) {
    sum.emplace_back(
        linalg::DenseMatrix<Number>::Zero(block.size, block.kind == BlockKind::kDense ? block.size : 1));
  }
  for (const Entry& e : problem.entries) {
    const auto b = static_cast<std::size_t>(e.block);
    const Number value = Number(e.value) * Number(e.variable == kConstant ? -constant : x[e.variable]);
    if (problem.blocks[b].kind != BlockKind::kDense) {
      sum[b](e.row, 0) += value;
      continue;
    }
    sum[b](e.row, e.column) += value;
    if (e.row != e.column) {
      sum[b](e.column, e.row) += value;
    }
  }
  for (const LowRankTerm& t : problem.low_rank) {
    const linalg::DenseMatrix<Number> vectors = t.vectors.cast<Number>();
    linalg::DenseMatrix<Number> scaled = vectors;
    for (Eigen::Index k = 0; k < scaled.cols(); ++k) {
      scaled.col(k) *= Number(x[t.variable]) * Number(t.weights[k]);
    }
    linalg::Dense<Number>::add_product_nt(scaled, vectors, 1.0, sum[static_cast<std::size_t>(t.block)]);
  }
  BlockMatrix rounded;
  for (const linalg::DenseMatrix<Number>& block : sum) {
    rounded.push_back(block.cast<double>());
  }
  return rounded;
}

}  // namespace trammel::inline TRAMMEL_ABI::sdp::detail
