// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of congruence_basis.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "trammel/certify/congruence_basis.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/error_norms.hpp"
#include "trammel/linalg/qr.hpp"
#include "trammel/linalg/sparse_columns.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace basis_detail {

/// Pivots below this, after equilibration, count as zero.
inline constexpr double kRankTolerance = 1e-12;
/// A pivot of the normal equations above this (amplitude) is far from rounding errors.
inline constexpr double kClearPivot = 1e-5;
/// Rounds of row and column scaling.
inline constexpr int kEquilibrationRounds = 3;
/// How wide an unbounded direction may be made: <H_l, V> grows by at most the square of this.
inline constexpr double kWideningOfBounds = 1e-7;
/// How far the measurements of an unbounded direction shall outweigh its prior (amplitude): the value loses
/// the inverse square, rounding errors grow with the square.
inline constexpr double kInformationOfDirection = 1e5;
/// Bounds see nothing of a column if this share of the sizes is left.
inline constexpr double kUnseen = 1e-10;

/// Amplitudes of the regularisation that the later bases get.
inline constexpr std::array<double, kCongruenceBases - 1> kRegularisations{1e-6, 1e-3};

/// R' of the QR factorisation of factor': a square lower triangular M with M M' = factor factor'.
inline Eigen::MatrixXd square_factor(const Eigen::MatrixXd& factor) {
  const linalg::Qr qr(factor.transpose().eval());
  const Eigen::MatrixXd r = qr.matrixQR().topRows(factor.rows()).triangularView<Eigen::Upper>();
  return r.transpose();
}

/// Column scaling of `stacked` after rows were normalised; rows of zeros stay.
inline Eigen::VectorXd equilibrate(Eigen::MatrixXd& stacked) {
  Eigen::VectorXd columns = Eigen::VectorXd::Ones(stacked.cols());
  for (int round = 0; round < kEquilibrationRounds; ++round) {
    const Eigen::VectorXd sizes = linalg::row_products(stacked, stacked).cwiseSqrt();
    stacked = (sizes.array() > 0.0).select(sizes.cwiseInverse(), 1.0).matrix().asDiagonal() * stacked;
    for (Eigen::Index j = 0; j < stacked.cols(); ++j) {
      const double size = stacked.col(j).norm();
      if (size > 0.0) {
        stacked.col(j) /= size;
        columns(j) /= size;
      }
    }
  }
  return columns;
}

/// Cheap sufficient test: the normal equations have no small pivot.
inline bool clearly_of_full_rank(const Eigen::MatrixXd& scaled) {
  const linalg::Cholesky cholesky(linalg::sparse_product(scaled.transpose(), linalg::SparseColumns(scaled)));
  return cholesky.info() == Eigen::Success && cholesky.matrixLLT().diagonal().minCoeff() > kClearPivot;
}

/// Combinations of given directions: those that F sees with orthonormal images, and the others.
struct Whitened {
  Eigen::MatrixXd seen;    ///< p x k
  Eigen::MatrixXd images;  ///< F times them, m x k
  Eigen::MatrixXd unseen;  ///< p x (n - k)

  Whitened(const Eigen::MatrixXd& information_factor, const Eigen::MatrixXd& directions) {
    const Eigen::MatrixXd measured = information_factor * directions;
    const Eigen::VectorXd size = measured.colwise().norm();
    const Eigen::VectorXd scale = (size.array() > 0.0).select(size.cwiseInverse(), 1.0);
    linalg::PivotedQr qr(measured * scale.asDiagonal());
    qr.setThreshold(kRankTolerance);
    const Eigen::Index rank = qr.rank();
    const Eigen::Index rest = directions.cols() - rank;
    const Eigen::MatrixXd ordered = directions * scale.asDiagonal() * qr.colsPermutation();
    seen = qr.matrixQR()
               .topLeftCorner(rank, rank)
               .triangularView<Eigen::Upper>()
               .solve<Eigen::OnTheRight>(ordered.leftCols(rank));
    images = information_factor * seen;
    unseen = ordered.rightCols(rest) - seen * qr.matrixQR().topRightCorner(rank, rest);
  }
};

}  // namespace basis_detail

TRAMMEL_INLINE UnboundedDirections find_unbounded_directions(const Eigen::MatrixXd& stacked) {
  const Eigen::Index p = stacked.cols();
  Eigen::MatrixXd scaled = stacked;
  const Eigen::VectorXd columns = basis_detail::equilibrate(scaled);
  if (basis_detail::clearly_of_full_rank(scaled)) {
    return {Eigen::MatrixXd(p, 0), {}};
  }
  // At least p rows, so that R is square.
  scaled.conservativeResizeLike(Eigen::MatrixXd::Zero(std::max(p, stacked.rows()), p));
  linalg::PivotedQr qr(scaled);
  qr.setThreshold(basis_detail::kRankTolerance);
  const Eigen::Index rank = qr.rank();
  UnboundedDirections result;
  result.directions = Eigen::MatrixXd::Zero(p, p - rank);
  const Eigen::VectorXi order = qr.colsPermutation().indices();
  const Eigen::MatrixXd solved = -qr.matrixQR()
                                      .topLeftCorner(rank, rank)
                                      .triangularView<Eigen::Upper>()
                                      .solve(qr.matrixQR().topRightCorner(rank, p - rank));
  for (Eigen::Index j = 0; j < p - rank; ++j) {
    const Eigen::Index coordinate = order(rank + j);
    result.coordinates.push_back(coordinate);
    result.directions(coordinate, j) = 1.0;
    for (Eigen::Index i = 0; i < rank; ++i) {
      result.directions(order(i), j) = solved(i, j) * columns(order(i)) / columns(coordinate);
    }
  }
  return result;
}

TRAMMEL_INLINE Eigen::MatrixXd congruence_basis(int number, const Eigen::MatrixXd& prior_factor,
                                                const Eigen::MatrixXd& bounds,
                                                const Eigen::MatrixXd& unbounded) {
  const Eigen::Index p = prior_factor.rows();
  Eigen::MatrixXd extended(p, prior_factor.cols() + unbounded.cols());
  extended << prior_factor, unbounded;
  if (number == 0) {
    if (extended.cols() < p) {
      return {};
    }
    return extended.cols() == p ? extended : basis_detail::square_factor(extended);
  }
  // (bounds' bounds)^-1 is a prior that every ellipsoid allows up to its number of rows.
  const linalg::PivotedQr qr(bounds);
  const Eigen::MatrixXd inverse =
      qr.colsPermutation() *
      qr.matrixQR().topRows(p).triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(p, p));
  if (!inverse.allFinite()) {
    return {};
  }
  Eigen::MatrixXd regularised(p, extended.cols() + p);
  regularised << extended, basis_detail::kRegularisations[static_cast<std::size_t>(number - 1)] * inverse;
  return basis_detail::square_factor(regularised);
}

TRAMMEL_INLINE Eigen::MatrixXd extend_prior(const Eigen::MatrixXd& prior_factor,
                                            const Eigen::MatrixXd& stacked,
                                            const Eigen::MatrixXd& information_factor,
                                            const Eigen::MatrixXd& unbounded) {
  const basis_detail::Whitened free(information_factor, unbounded);
  Eigen::MatrixXd result(prior_factor.rows(), prior_factor.cols() + unbounded.cols());
  Eigen::Index used = 0;
  for (Eigen::Index j = 0; j < prior_factor.cols(); ++j) {
    const auto column = prior_factor.col(j);
    const double size = linalg::sizes_times(stacked, column.cwiseAbs()).norm();
    if ((stacked * column).norm() > basis_detail::kUnseen * size) {
      result.col(used++) = column - free.seen * (free.images.transpose() * (information_factor * column));
    }
  }
  const auto append = [&](const auto& direction, double widest) {
    const double reach = std::min(basis_detail::kWideningOfBounds / (stacked * direction).norm(), widest);
    result.col(used++) = (std::isfinite(reach) ? reach : 1.0) * direction;
  };
  for (const auto& direction : free.seen.colwise()) {
    append(direction, basis_detail::kInformationOfDirection);
  }
  for (const auto& direction : free.unseen.colwise()) {
    append(direction, std::numeric_limits<double>::infinity());
  }
  return result.leftCols(used);
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
