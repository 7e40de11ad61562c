// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of block_structure.hpp.
#pragma once

#include <cmath>

#include "trammel/certify/block_structure.hpp"
#include "trammel/linalg/qr.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace block_detail {

/// Rank decisions within one ellipsoid.
inline constexpr double kRankTolerance = 1e-12;

/// Columns in which a factor has an entry.
inline std::vector<Eigen::Index> touched_columns(const Eigen::MatrixXd& factor) {
  std::vector<Eigen::Index> columns;
  for (Eigen::Index j = 0; j < factor.cols(); ++j) {
    if ((factor.col(j).array() != 0.0).any()) {
      columns.push_back(j);
    }
  }
  return columns;
}

}  // namespace block_detail

TRAMMEL_INLINE std::optional<UnitBalls> find_unit_balls(const GuaranteedProblem& problem,
                                                        const Eigen::MatrixXd& prior_factor) {
  const Eigen::Index p = problem.parameters();
  UnitBalls balls;
  balls.offset.push_back(0);
  balls.scaling = Eigen::MatrixXd::Zero(p, p);
  balls.inverse = Eigen::MatrixXd::Zero(p, p);
  std::vector<bool> taken(static_cast<std::size_t>(p), false);
  Eigen::Index used = 0;
  for (const Eigen::MatrixXd& factor : problem.ellipsoids) {
    const std::vector<Eigen::Index> columns = block_detail::touched_columns(factor);
    const auto n = static_cast<Eigen::Index>(columns.size());
    for (const Eigen::Index column : columns) {
      if (taken[static_cast<std::size_t>(column)]) {
        return std::nullopt;
      }
      taken[static_cast<std::size_t>(column)] = true;
    }
    if (n == 0) {
      continue;
    }
    if (factor.rows() < n) {
      return std::nullopt;
    }
    const Eigen::MatrixXd dense = factor(Eigen::all, columns);
    linalg::PivotedQr qr(dense);
    qr.setThreshold(block_detail::kRankTolerance);
    if (qr.rank() < n) {
      return std::nullopt;
    }
    // |a theta| = |R P' theta| = |z|.
    const Eigen::MatrixXd r = qr.matrixQR().topRows(n).triangularView<Eigen::Upper>();
    const Eigen::MatrixXd to_ball = r * qr.colsPermutation().transpose();
    const Eigen::MatrixXd from_ball =
        qr.colsPermutation() * r.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(n, n));
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = 0; i < n; ++i) {
        balls.scaling(columns[static_cast<std::size_t>(i)], used + j) = from_ball(i, j);
        balls.inverse(used + i, columns[static_cast<std::size_t>(j)]) = to_ball(i, j);
      }
    }
    used += n;
    balls.offset.push_back(used);
  }
  for (Eigen::Index column = 0; column < p; ++column) {
    if (!taken[static_cast<std::size_t>(column)]) {
      balls.scaling(column, used) = 1.0;
      balls.inverse(used, column) = 1.0;
      ++used;
    }
  }
  const Eigen::MatrixXd seen = problem.information_factor * balls.scaling;
  const Eigen::MatrixXd output = problem.criterion_factor * balls.scaling;
  const Eigen::MatrixXd factor = balls.inverse * prior_factor;
  balls.information = seen.transpose() * seen;
  balls.criterion = output.transpose() * output;
  balls.prior = factor * factor.transpose();
  for (Eigen::Index l = 0; l < balls.blocks(); ++l) {
    // Rounding errors of the solver: scale blocks that are slightly too large.
    const double trace = balls.prior.diagonal().segment(balls.begin(l), balls.block_size(l)).sum();
    if (trace > 1.0) {
      balls.prior.middleRows(balls.begin(l), balls.block_size(l)) /= std::sqrt(trace);
      balls.prior.middleCols(balls.begin(l), balls.block_size(l)) /= std::sqrt(trace);
    }
  }
  return balls;
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
