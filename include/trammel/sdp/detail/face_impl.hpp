// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of face.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include <Eigen/Dense>

#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/sdp/detail/combination.hpp"
#include "trammel/sdp/detail/face.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp::detail {

namespace face_detail {

/// Constraints of larger rank cost too much to look at and are rarely meant as faces.
inline constexpr Eigen::Index kMostRank = 32;
/// Programs on faces with more coefficients are not worth it.
inline constexpr double kMostEntries = 2e7;

/// Pivoted Cholesky factorisation of a positive semidefinite matrix.
struct Factor {
  Eigen::MatrixXd factor;            ///< n x r
  std::vector<Eigen::Index> pivots;  ///< r
  bool fits = false;                 ///< matrix = factor factor' up to rounding errors, r <= most
};

inline Factor factorise(Eigen::MatrixXd matrix, Eigen::Index most) {
  const Eigen::Index n = matrix.rows();
  const double noise =
      8.0 * static_cast<double>(n) * std::numeric_limits<double>::epsilon() * matrix.cwiseAbs().maxCoeff();
  Factor result;
  std::vector<Eigen::VectorXd> columns;
  while (matrix.cwiseAbs().maxCoeff() > noise) {
    Eigen::Index pivot = 0;
    const double largest = matrix.diagonal().maxCoeff(&pivot);
    if (!(largest > noise) || static_cast<Eigen::Index>(columns.size()) == most) {
      return result;
    }
    columns.emplace_back(matrix.col(pivot) / std::sqrt(largest));
    result.pivots.push_back(pivot);
    matrix.noalias() -= columns.back() * columns.back().transpose();
    matrix.row(pivot).setZero();
    matrix.col(pivot).setZero();
  }
  result.factor.resize(n, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    result.factor.col(static_cast<Eigen::Index>(k)) = columns[k];
  }
  result.fits = true;
  return result;
}

/// F_i where all of it lies in one dense block.
struct Coefficient {
  int block = -1;
  bool alone = true;  ///< in that block
  std::vector<const Entry*> entries;
  std::vector<const LowRankTerm*> low_rank;

  void meet(int where) {
    alone = alone && (block < 0 || block == where);
    block = where;
  }
};

/// Coefficients of the variables without a cost.
inline std::vector<std::pair<int, Coefficient>> candidates(const Problem& problem) {
  std::vector<Coefficient> all(static_cast<std::size_t>(problem.cost.size()));
  const auto wanted = [&](int variable) { return variable != kConstant && problem.cost[variable] == 0.0; };
  for (const Entry& entry : problem.entries) {
    if (wanted(entry.variable) && entry.value != 0.0) {
      Coefficient& coefficient = all[static_cast<std::size_t>(entry.variable)];
      coefficient.meet(entry.block);
      coefficient.entries.push_back(&entry);
    }
  }
  for (const LowRankTerm& term : problem.low_rank) {
    if (term.weights.size() > 0 && wanted(term.variable)) {
      Coefficient& coefficient = all[static_cast<std::size_t>(term.variable)];
      coefficient.meet(term.block);
      coefficient.low_rank.push_back(&term);
    }
  }
  std::vector<std::pair<int, Coefficient>> found;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const int block = all[i].block;
    if (block >= 0 && all[i].alone &&
        problem.blocks[static_cast<std::size_t>(block)].kind == BlockKind::kDense) {
      found.emplace_back(static_cast<int>(i), std::move(all[i]));
    }
  }
  return found;
}

inline Eigen::MatrixXd dense(const Coefficient& coefficient, int size) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
  for (const Entry* entry : coefficient.entries) {
    matrix(entry->row, entry->column) += entry->value;
    if (entry->row != entry->column) {
      matrix(entry->column, entry->row) += entry->value;
    }
  }
  for (const LowRankTerm* term : coefficient.low_rank) {
    matrix.noalias() += term->vectors * term->weights.asDiagonal() * term->vectors.transpose();
  }
  return matrix;
}

/// Sign with which diagonal and weights, and so the matrix, may be positive semidefinite; 0 if with none.
/// Spares most coefficients the dense matrix.
inline double possible_sign(const Coefficient& coefficient) {
  double lowest = 0.0;
  double highest = 0.0;
  const auto include = [&](double value) {
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
  };
  for (const Entry* entry : coefficient.entries) {
    if (entry->row == entry->column) {
      include(entry->value);
    }
  }
  for (const LowRankTerm* term : coefficient.low_rank) {
    include(term->weights.minCoeff());
    include(term->weights.maxCoeff());
  }
  if ((lowest < 0.0) == (highest > 0.0)) {
    return 0.0;
  }
  return lowest < 0.0 ? -1.0 : 1.0;
}

/// N with factor' N = 0: the identity off the pivots, and on them what makes the product vanish.
inline Eigen::MatrixXd null_basis(const Factor& factor) {
  const Eigen::Index n = factor.factor.rows();
  const Eigen::Index r = factor.factor.cols();
  std::vector<char> is_pivot(static_cast<std::size_t>(n), 0);
  Eigen::MatrixXd at_pivots(r, r);
  for (Eigen::Index k = 0; k < r; ++k) {
    const Eigen::Index pivot = factor.pivots[static_cast<std::size_t>(k)];
    is_pivot[static_cast<std::size_t>(pivot)] = 1;
    at_pivots.row(k) = factor.factor.row(pivot);
  }
  Eigen::MatrixXd others(n - r, r);
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(n, n - r);
  Eigen::Index column = 0;
  for (Eigen::Index row = 0; row < n; ++row) {
    if (is_pivot[static_cast<std::size_t>(row)] == 0) {
      others.row(column) = factor.factor.row(row);
      basis(row, column++) = 1.0;
    }
  }
  // Lower triangular, by the order of the pivots.
  const Eigen::MatrixXd solved =
      at_pivots.triangularView<Eigen::Lower>().transpose().solve(others.transpose());
  for (Eigen::Index k = 0; k < r; ++k) {
    basis.row(factor.pivots[static_cast<std::size_t>(k)]) = -solved.row(k);
  }
  return basis;
}

/// The non-zero entries of a row of N.
using SparseRow = std::vector<std::pair<int, double>>;

inline std::vector<SparseRow> sparse_rows(const Eigen::MatrixXd& basis) {
  std::vector<SparseRow> rows(static_cast<std::size_t>(basis.rows()));
  for (Eigen::Index j = 0; j < basis.cols(); ++j) {
    for (Eigen::Index i = 0; i < basis.rows(); ++i) {
      if (basis(i, j) != 0.0) {
        rows[static_cast<std::size_t>(i)].emplace_back(static_cast<int>(j), basis(i, j));
      }
    }
  }
  return rows;
}

/// Adds N' (value (e_row e_column' + e_column e_row')) N, or half of it on the diagonal.
inline void add_image(const Entry& entry, int variable, const Face& face, const std::vector<SparseRow>& rows,
                      Problem& target) {
  const SparseRow& left = rows[static_cast<std::size_t>(entry.row)];
  const SparseRow& right = rows[static_cast<std::size_t>(entry.column)];
  const bool square = entry.row == entry.column;
  if (square && left.size() > 1 && variable != kConstant) {
    target.low_rank.push_back({variable, entry.block, face.basis.row(entry.row).transpose(),
                               Eigen::VectorXd::Constant(1, entry.value)});
    return;
  }
  for (const auto& [i, a] : left) {
    for (const auto& [j, b] : right) {
      if (square && j < i) {
        continue;
      }
      const double twice = !square && i == j ? 2.0 : 1.0;
      target.entries.push_back({variable, entry.block, i, j, twice * entry.value * a * b});
    }
  }
}

/// Coefficients that add_image would make.
inline double count_images(const Problem& problem, int block, const std::vector<SparseRow>& rows) {
  double sum = 0.0;
  for (const Entry& entry : problem.entries) {
    if (entry.block == block) {
      const auto left = static_cast<double>(rows[static_cast<std::size_t>(entry.row)].size());
      const auto right = static_cast<double>(rows[static_cast<std::size_t>(entry.column)].size());
      sum += entry.row == entry.column ? left : left * right;
    }
  }
  return sum;
}

/// Smallest M >= 0 with Z + M G + deficit I positive semidefinite.
inline double smallest_multiple(const Eigen::MatrixXd& z, const Eigen::MatrixXd& factor, double deficit) {
  constexpr double kMore = 10.0;
  constexpr int kTries = 4;
  const Eigen::Index n = z.rows();
  const Eigen::Index r = factor.cols();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(factor);
  Eigen::MatrixXd turned = z;
  turned.applyOnTheLeft(qr.householderQ().adjoint());
  turned.applyOnTheRight(qr.householderQ());
  const Eigen::MatrixXd inverse_factor = qr.matrixQR().topRows(r).triangularView<Eigen::Upper>().solve(
      Eigen::MatrixXd::Identity(r, r));  // G = Q R R' Q', R: r x r
  for (int attempt = 0; attempt < kTries; ++attempt, deficit *= kMore) {
    Eigen::MatrixXd rest = turned.bottomRightCorner(n - r, n - r);
    rest.diagonal().array() += deficit;
    const linalg::Cholesky cholesky(rest);
    if (cholesky.info() != Eigen::Success) {
      continue;
    }
    Eigen::MatrixXd complement = turned.topLeftCorner(r, r);
    complement.diagonal().array() += deficit;
    const Eigen::MatrixXd across = turned.bottomLeftCorner(n - r, r);
    complement -= across.transpose() * cholesky.solve(across);
    const Eigen::MatrixXd scaled = inverse_factor * complement * inverse_factor.transpose();
    const linalg::SymmetricEigen eigen(scaled, Eigen::EigenvaluesOnly);
    return std::max(0.0, -eigen.eigenvalues()[0]);
  }
  return 0.0;
}

}  // namespace face_detail

TRAMMEL_INLINE std::vector<Face> find_faces(const Problem& problem) {
  std::vector<Face> by_block(problem.blocks.size());
  std::vector<Eigen::MatrixXd> sums(problem.blocks.size());
  for (const auto& [variable, coefficient] : face_detail::candidates(problem)) {
    const double sign = face_detail::possible_sign(coefficient);
    if (sign == 0.0) {
      continue;
    }
    const auto b = static_cast<std::size_t>(coefficient.block);
    const Eigen::MatrixXd matrix = sign * face_detail::dense(coefficient, problem.blocks[b].size);
    if (!face_detail::factorise(matrix, face_detail::kMostRank).fits) {
      continue;
    }
    by_block[b].terms.push_back({variable, sign});
    sums[b] = sums[b].size() == 0 ? matrix : Eigen::MatrixXd(sums[b] + matrix);
  }
  std::vector<Face> faces;
  for (std::size_t b = 0; b < by_block.size(); ++b) {
    Face& face = by_block[b];
    if (face.terms.empty() || sums[b].isZero(0.0)) {
      continue;
    }
    const face_detail::Factor factor = face_detail::factorise(sums[b], sums[b].rows() - 1);
    if (!factor.fits) {
      continue;
    }
    face.block = static_cast<int>(b);
    face.factor = factor.factor;
    face.basis = face_detail::null_basis(factor);
    if (face_detail::count_images(problem, face.block, face_detail::sparse_rows(face.basis)) <=
        face_detail::kMostEntries) {
      faces.push_back(std::move(face));
    }
  }
  return faces;
}

TRAMMEL_INLINE FaceProblem restrict_to(const Problem& problem, const std::vector<Face>& faces) {
  FaceProblem result;
  Problem& target = result.problem;
  target.blocks = problem.blocks;
  std::vector<const Face*> face_of(problem.blocks.size(), nullptr);
  std::vector<std::vector<face_detail::SparseRow>> rows(problem.blocks.size());
  std::vector<int> number(static_cast<std::size_t>(problem.cost.size()), 0);
  for (const Face& face : faces) {
    const auto b = static_cast<std::size_t>(face.block);
    face_of[b] = &face;
    rows[b] = face_detail::sparse_rows(face.basis);
    target.blocks[b].size = static_cast<int>(face.basis.cols());
    for (const Face::Term& term : face.terms) {
      number[static_cast<std::size_t>(term.variable)] = -1;
    }
  }
  for (std::size_t i = 0; i < number.size(); ++i) {
    if (number[i] == 0) {
      number[i] = static_cast<int>(result.kept.size());
      result.kept.push_back(static_cast<int>(i));
    }
  }
  target.cost = problem.cost(result.kept);
  for (const Entry& entry : problem.entries) {
    const bool constant = entry.variable == kConstant;
    const int variable = constant ? kConstant : number[static_cast<std::size_t>(entry.variable)];
    const auto b = static_cast<std::size_t>(entry.block);
    if (!constant && variable < 0) {
      continue;
    }
    if (face_of[b] != nullptr) {
      face_detail::add_image(entry, variable, *face_of[b], rows[b], target);
    } else {
      target.entries.push_back(entry);
      target.entries.back().variable = variable;
    }
  }
  for (const LowRankTerm& term : problem.low_rank) {
    const int variable = number[static_cast<std::size_t>(term.variable)];
    if (variable < 0) {
      continue;
    }
    target.low_rank.push_back(term);
    target.low_rank.back().variable = variable;
    if (const Face* face = face_of[static_cast<std::size_t>(term.block)]; face != nullptr) {
      target.low_rank.back().vectors = face->basis.transpose() * term.vectors;
    }
  }
  return result;
}

TRAMMEL_INLINE void lift(const Problem& problem, const std::vector<Face>& faces, const std::vector<int>& kept,
                         double constant, double deficit, Solution& solution) {
  constexpr double kAbove = 1.0 + 1e-6;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(problem.cost.size());
  x(kept) = solution.x;
  const BlockMatrix image = combine(problem, x, constant);
  for (const Face& face : faces) {
    const auto b = static_cast<std::size_t>(face.block);
    const double multiple = kAbove * face_detail::smallest_multiple(image[b], face.factor, deficit);
    for (const Face::Term& term : face.terms) {
      x[term.variable] = term.sign * multiple;
    }
    solution.multiplier[b] = (face.basis * solution.multiplier[b] * face.basis.transpose()).eval();
  }
  solution.x = std::move(x);
  const BlockMatrix slack = combine(problem, solution.x, constant);
  for (const Face& face : faces) {
    solution.slack[static_cast<std::size_t>(face.block)] = slack[static_cast<std::size_t>(face.block)];
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::sdp::detail
