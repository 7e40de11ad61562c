// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of block_structure.hpp.
#pragma once

#include <cmath>

#include "trammel/certify/block_structure.hpp"
#include "trammel/certify/congruence_basis.hpp"
#include "trammel/linalg/lu.hpp"
#include "trammel/linalg/qr.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace block_detail {

/// Rank decisions within one ellipsoid.
inline constexpr double kRankTolerance = 1e-12;

/// R with R'R = a'a and as many rows as the rank of a.
inline Eigen::MatrixXd full_rank_rows(const Eigen::MatrixXd& factor) {
  linalg::PivotedQr qr(factor);
  qr.setThreshold(kRankTolerance);
  const Eigen::Index rank = qr.rank();
  const Eigen::MatrixXd r = qr.matrixQR().topRows(rank).triangularView<Eigen::Upper>();
  return r * qr.colsPermutation().transpose();
}

/// Inverse of a matrix whose rows and columns may have very different sizes.
inline Eigen::MatrixXd scaled_inverse(const Eigen::MatrixXd& matrix) {
  const Eigen::VectorXd rows = matrix.rowwise().norm().cwiseInverse();
  Eigen::MatrixXd scaled = rows.asDiagonal() * matrix;
  const Eigen::VectorXd columns = scaled.colwise().norm().cwiseInverse().transpose();
  scaled = (scaled * columns.asDiagonal()).eval();
  return columns.asDiagonal() *
         linalg::Lu(scaled).solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols())) *
         rows.asDiagonal();
}

}  // namespace block_detail

TRAMMEL_INLINE std::optional<UnitBalls> find_unit_balls(const GuaranteedProblem& problem,
                                                        const Eigen::MatrixXd& prior_factor) {
  const Eigen::Index p = problem.parameters();
  UnitBalls balls;
  balls.offset.push_back(0);
  balls.inverse = Eigen::MatrixXd::Zero(p, p);
  for (const Eigen::MatrixXd& factor : problem.ellipsoids) {
    const Eigen::MatrixXd rows = factor.rows() > 0 ? block_detail::full_rank_rows(factor) : factor;
    const Eigen::Index used = balls.offset.back();
    if (used + rows.rows() > p) {
      return std::nullopt;
    }
    if (rows.rows() > 0) {
      balls.inverse.middleRows(used, rows.rows()) = rows;
      balls.offset.push_back(used + rows.rows());
    }
  }
  const Eigen::Index bounded = balls.offset.back();
  const UnboundedDirections free = find_unbounded_directions(balls.inverse.topRows(bounded));
  if (free.directions.cols() != p - bounded) {
    return std::nullopt;  // what the ellipsoids confine depends on each other
  }
  for (Eigen::Index j = 0; j < p - bounded; ++j) {
    balls.inverse(bounded + j, free.coordinates[static_cast<std::size_t>(j)]) = 1.0;
  }
  balls.scaling = block_detail::scaled_inverse(balls.inverse);
  const Eigen::MatrixXd seen = problem.information_factor * balls.scaling;
  balls.output = linalg::compressed(problem.criterion_factor * balls.scaling);
  const Eigen::MatrixXd factor = balls.inverse * prior_factor;
  balls.information = seen.transpose() * seen;
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
