// SPDX-License-Identifier: Apache-2.0
/// @file
/// Semidefinite programs as plain data.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp {

/// What one block of X and Y is.
enum class BlockKind {
  kDense,     ///< symmetric matrix, positive semidefinite
  kDiagonal,  ///< diagonal matrix with entries >= 0, stored as a vector
  kFree,      ///< diagonal of Y without sign, diagonal of X zero: linear equations in x
};

struct Block {
  BlockKind kind = BlockKind::kDense;
  int size = 0;  ///< rows
};

/// Value of Entry::variable for the constant matrix F_0.
inline constexpr int kConstant = -1;

/// One entry of a coefficient matrix. Each off-diagonal pair is given once, in either triangle; entries given
/// twice are summed. All indices count from zero.
struct Entry {
  int variable = kConstant;  ///< i of F_i, or kConstant
  int block = 0;
  int row = 0;
  int column = 0;
  double value = 0.0;
};

/// A part `vectors diag(weights) vectors'` of one dense block of F_i; added to its entries.
struct LowRankTerm {
  int variable = 0;  ///< i of F_i; the constant matrix takes entries only
  int block = 0;
  Eigen::MatrixXd vectors;  ///< n x k, n the size of the block
  Eigen::VectorXd weights;  ///< k
};

/// Primal and dual semidefinite program in the convention of the SDPA format:
///
///   (P) min c'x          s.t.  X = sum_i x_i F_i - F_0,  X in K
///   (D) max <F_0, Y>     s.t.  <F_i, Y> = c_i,           Y in K*
///
/// | symbol | field      | shape               | meaning                                                  |
/// |--------|------------|---------------------|----------------------------------------------------------|
/// | c      | cost       | m                   | objective of (P), right-hand sides of (D)                |
/// | K      | blocks     | -                   | product of semidefinite, nonnegative and zero cones      |
/// | F_i    | entries    | block diagonal      | sparse part of the coefficient matrices                  |
/// | F_i    | low_rank   | block diagonal      | part with few eigenvectors                               |
///
/// A block of kind kFree puts X = 0 there: its rows are linear equations in x, its Y has no sign.
struct Problem {
  std::vector<Block> blocks;
  Eigen::VectorXd cost;
  std::vector<Entry> entries;
  std::vector<LowRankTerm> low_rank;
};

/// Throws Error naming the first field that is wrong: sizes, indices, off-diagonal entries of diagonal
/// blocks, numbers that are not finite.
void validate(const Problem& problem);

}  // namespace trammel::inline TRAMMEL_ABI::sdp

#ifndef TRAMMEL_COMPILED
#include "trammel/sdp/problem_impl.hpp"
#endif
