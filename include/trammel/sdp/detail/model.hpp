// SPDX-License-Identifier: Apache-2.0
/// @file
/// A Problem taken apart into the cones that the solver works on, and the way back.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/sdp/problem.hpp"
#include "trammel/sdp/solution.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp::detail {

/// Coefficient in a diagonal block: `value` in row `row` of F_variable.
struct DiagonalEntry {
  int variable;  ///< or kConstant
  int row;
  double value;
};

/// A connected dense block.
struct DenseData {
  int size = 0;
  std::vector<Entry> entries;  ///< row <= column, ordered by variable, no duplicates
  std::vector<LowRankTerm> low_rank;
};

/// All diagonal rows together, or all equations.
struct DiagonalData {
  int size = 0;
  std::vector<DiagonalEntry> entries;  ///< ordered by row, then variable; no duplicates
};

/// Where a row of an original block went.
struct Place {
  enum class Kind {
    kDense,
    kDiagonal,
    kFree,
    kFreeNegated,  ///< the opposite of an equation: its Y is the negative part
    kFreePositive,
    kAbsent,  ///< no coefficient at all: X = 0, Y = 0
  };
  Kind kind = Kind::kAbsent;
  int part = 0;  ///< index of the dense part
  int row = 0;
};

/// Connected dense parts, one nonnegative part and one set of equations. Built by `reduce`.
struct Model {
  Eigen::VectorXd cost;
  std::vector<DenseData> dense;
  DiagonalData diagonal;
  DiagonalData equations;
  std::vector<std::vector<Place>> places;  ///< per original block and row
};

/// Splits dense blocks into the connected components of their joint sparsity pattern (Y may vanish outside
/// them without loss, since X does), puts components of one row with the diagonal rows, and turns pairs of
/// opposite diagonal rows (a'x >= b and -a'x >= -b) into equations.
[[nodiscard]] Model reduce(const Problem& problem);

/// Share of the pairs (i, j) of variables that have coefficients in a common part: the filled entries of the
/// Schur complement. Counts in m^2 / 8 bytes.
[[nodiscard]] double schur_density(const Model& model);

/// The parts' X or Y in the problem's own blocks.
struct Parts {
  std::vector<Eigen::MatrixXd> dense;
  Eigen::VectorXd diagonal;
  Eigen::VectorXd free;  ///< Y of the equations (any sign)
};
[[nodiscard]] BlockMatrix expand(const Problem& problem, const Model& model, const Parts& parts);

}  // namespace trammel::inline TRAMMEL_ABI::sdp::detail

#ifndef TRAMMEL_COMPILED
#include "trammel/sdp/detail/model_impl.hpp"
#endif
