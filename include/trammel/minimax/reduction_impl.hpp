// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of reduction.hpp.
#pragma once

#include <algorithm>
#include <limits>
#include <numeric>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/linalg/qr.hpp"
#include "trammel/minimax/reduction.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

namespace detail {

/// Pivoted QR of a matrix with its rows sorted by falling size, which keeps Householder's method accurate
/// where rows differ by many orders of magnitude (Cox and Higham 1998).
struct RankedQr {
  Eigen::MatrixXd factor;  // R, rank x columns, upper trapezoidal
  Eigen::PermutationMatrix<Eigen::Dynamic> columns;
  Eigen::Index rank = 0;
};

inline RankedQr ranked_qr(const Eigen::MatrixXd& matrix) {
  const Eigen::Index rows = std::max(matrix.rows(), matrix.cols());
  const Eigen::VectorXd size = matrix.rowwise().norm();
  std::vector<Eigen::Index> order(static_cast<std::size_t>(matrix.rows()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return size[a] > size[b]; });
  Eigen::MatrixXd sorted = Eigen::MatrixXd::Zero(rows, matrix.cols());
  for (std::size_t i = 0; i < order.size(); ++i) {
    sorted.row(static_cast<Eigen::Index>(i)) = matrix.row(order[i]);
  }
  linalg::PivotedQr qr(sorted);
  // A direction counts as absent when it is at the level of the rounding errors of the factorisation.
  const double threshold = 4.0 * std::numeric_limits<double>::epsilon() * static_cast<double>(rows);
  RankedQr result;
  const Eigen::VectorXd diagonal = qr.matrixQR().diagonal().cwiseAbs();
  while (result.rank < matrix.cols() && diagonal[result.rank] > threshold * diagonal[0]) {
    ++result.rank;
  }
  result.factor = qr.matrixQR().topRows(result.rank).triangularView<Eigen::Upper>();
  result.columns = qr.colsPermutation();
  return result;
}

/// Columns x with R P' x = e_i (a right inverse on the row space).
inline Eigen::MatrixXd row_space_basis(const RankedQr& qr) {
  const Eigen::Index p = qr.factor.cols();
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(p, qr.rank);
  basis.topRows(qr.rank).setIdentity();
  qr.factor.leftCols(qr.rank).triangularView<Eigen::Upper>().solveInPlace(basis.topRows(qr.rank));
  return qr.columns * basis;
}

/// Columns that span the null space.
inline Eigen::MatrixXd null_space_basis(const RankedQr& qr) {
  const Eigen::Index p = qr.factor.cols();
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(p, p - qr.rank);
  basis.topRows(qr.rank) = -qr.factor.rightCols(p - qr.rank);
  qr.factor.leftCols(qr.rank).triangularView<Eigen::Upper>().solveInPlace(basis.topRows(qr.rank));
  basis.bottomRows(p - qr.rank).setIdentity();
  return qr.columns * basis;
}

/// The same column space with columns made so that `image` times them is orthonormal.
inline Eigen::MatrixXd orthonormalised(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& image) {
  const Eigen::Index m = basis.cols();
  Eigen::MatrixXd padded = Eigen::MatrixXd::Zero(std::max(image.rows(), m), m);
  padded.topRows(image.rows()) = image;
  linalg::Qr qr(padded);
  return qr.matrixQR().topRows(m).triangularView<Eigen::Upper>().solve<Eigen::OnTheRight>(basis);
}

}  // namespace detail

TRAMMEL_INLINE void require_well_formed(const GuaranteedProblem& problem) {
  const Eigen::Index p = problem.parameters();
  const auto check = [&](const Eigen::MatrixXd& factor, const std::string& name) {
    if (factor.cols() != p && factor.size() > 0) {
      throw Error({name, std::to_string(factor.cols()) + " columns",
                   std::to_string(p) + " columns as criterion_factor has"});
    }
    if (!factor.allFinite()) {
      throw Error({name, "an entry that is not finite", "finite numbers"});
    }
  };
  require(p > 0, "criterion_factor", "no columns", "one column per parameter");
  check(problem.criterion_factor, "criterion_factor");
  check(problem.information_factor, "information_factor");
  for (std::size_t l = 0; l < problem.ellipsoids.size(); ++l) {
    check(problem.ellipsoids[l], "ellipsoids[" + std::to_string(l) + "]");
  }
}

TRAMMEL_INLINE ReducedProblem reduce(const GuaranteedProblem& problem) {
  require_well_formed(problem);
  const Eigen::Index p = problem.parameters();
  ReducedProblem reduced;
  Eigen::Index rows = 0;
  reduced.first_row.push_back(0);
  for (std::size_t l = 0; l < problem.ellipsoids.size(); ++l) {
    if (problem.ellipsoids[l].size() > 0 && problem.ellipsoids[l].squaredNorm() > 0.0) {
      rows += problem.ellipsoids[l].rows();
      reduced.owner.push_back(l);
      reduced.first_row.push_back(rows);
    }
  }
  const Eigen::Index design_rows =
      problem.information_factor.size() > 0 ? problem.information_factor.rows() : 0;
  Eigen::MatrixXd stack(design_rows + rows, p);
  if (design_rows > 0) {
    stack.topRows(design_rows) = problem.information_factor;
  }
  for (std::size_t i = 0; i < reduced.owner.size(); ++i) {
    stack.middleRows(design_rows + reduced.first_row[i], reduced.first_row[i + 1] - reduced.first_row[i]) =
        problem.ellipsoids[reduced.owner[i]];
  }

  // Unit columns, then coordinates z in which [F; a] has orthonormal columns.
  const Eigen::VectorXd length = stack.colwise().norm();
  const Eigen::VectorXd scale = (length.array() > 0.0).select(length.cwiseInverse(), 1.0);
  stack *= scale.asDiagonal();
  const detail::RankedQr whole = detail::ranked_qr(stack);
  if (whole.rank < p) {
    Eigen::MatrixXd unseen = scale.asDiagonal() * detail::null_space_basis(whole);
    const Eigen::VectorXd unseen_length = unseen.colwise().norm();
    unseen *= unseen_length.cwiseInverse().asDiagonal();
    const Eigen::VectorXd visible = (problem.criterion_factor * unseen).colwise().norm();
    const double negligible = 1e3 * std::numeric_limits<double>::epsilon() * problem.criterion_factor.norm();
    std::vector<Eigen::Index> seen;
    for (Eigen::Index i = 0; i < visible.size(); ++i) {
      if (visible[i] > negligible) {
        seen.push_back(i);
      }
    }
    if (!seen.empty()) {
      reduced.unbounded_directions = unseen(Eigen::all, seen);
      return reduced;
    }
  }
  const Eigen::MatrixXd to_z = scale.asDiagonal() * detail::row_space_basis(whole);
  Eigen::MatrixXd bounds_z = stack.bottomRows(rows) * detail::row_space_basis(whole);
  Eigen::MatrixXd design_z = stack.topRows(design_rows) * detail::row_space_basis(whole);
  const Eigen::MatrixXd criterion_z = problem.criterion_factor * to_z;

  // Directions that no ellipsoid bounds are estimated without bias.
  const detail::RankedQr bounded = detail::ranked_qr(bounds_z);
  const Eigen::MatrixXd row_space = detail::row_space_basis(bounded);
  Eigen::MatrixXd to_u = row_space;
  if (bounded.rank < to_z.cols()) {
    const Eigen::MatrixXd null = detail::null_space_basis(bounded);
    const Eigen::MatrixXd free_z = detail::orthonormalised(null, design_z * null);
    const Eigen::MatrixXd design_free = design_z * free_z;
    to_u -= free_z * (design_free.transpose() * (design_z * row_space));
    reduced.free_basis = to_z * free_z;
    reduced.free_error = (criterion_z * free_z).squaredNorm();
  } else {
    reduced.free_basis.resize(p, 0);
  }
  reduced.bounds = bounds_z * row_space;
  reduced.information = linalg::compressed(design_z * to_u);
  reduced.criterion = linalg::compressed(criterion_z * to_u);
  reduced.basis = to_z * to_u;
  return reduced;
}

}  // namespace trammel::inline TRAMMEL_ABI::minimax
