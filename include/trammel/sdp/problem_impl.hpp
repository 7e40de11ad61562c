// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of problem.hpp.
#pragma once

#include <cmath>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/sdp/problem.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp {

namespace detail {

[[noreturn]] inline void reject(const std::string& where, const std::string& found,
                                const std::string& expected) {
  throw Error({where, found, expected});
}

inline bool fits(const Problem& problem, const Entry& entry) {
  if (entry.variable < kConstant || entry.variable >= problem.cost.size() || entry.block < 0 ||
      entry.block >= static_cast<int>(problem.blocks.size())) {
    return false;
  }
  const Block& block = problem.blocks[static_cast<std::size_t>(entry.block)];
  return entry.row >= 0 && entry.row < block.size && entry.column >= 0 && entry.column < block.size &&
         (block.kind == BlockKind::kDense || entry.row == entry.column) && std::isfinite(entry.value);
}

/// Says what is wrong with an entry that does not fit.
inline void explain_entry(const Problem& problem, std::size_t index_of_entry) {
  const Entry& entry = problem.entries[index_of_entry];
  const std::string where = "problem.entries[" + std::to_string(index_of_entry) + "]";
  const auto variables = static_cast<int>(problem.cost.size());
  const auto blocks = static_cast<int>(problem.blocks.size());
  if (entry.variable != kConstant && (entry.variable < 0 || entry.variable >= variables)) {
    reject(where + ".variable", std::to_string(entry.variable),
           "kConstant or 0 to " + std::to_string(variables - 1));
  }
  if (entry.block < 0 || entry.block >= blocks) {
    reject(where + ".block", std::to_string(entry.block), "0 to " + std::to_string(blocks - 1));
  }
  const Block& block = problem.blocks[static_cast<std::size_t>(entry.block)];
  for (const int index : {entry.row, entry.column}) {
    if (index < 0 || index >= block.size) {
      reject(where, "row or column " + std::to_string(index), "0 to " + std::to_string(block.size - 1));
    }
  }
  if (block.kind != BlockKind::kDense && entry.row != entry.column) {
    reject(where, "row " + std::to_string(entry.row) + ", column " + std::to_string(entry.column),
           "equal row and column in a diagonal block");
  }
  if (!std::isfinite(entry.value)) {
    reject(where + ".value", shortest(entry.value), "a finite number");
  }
}

inline void validate_low_rank(const Problem& problem, const LowRankTerm& term, const std::string& where) {
  if (term.variable < 0 || term.variable >= problem.cost.size()) {
    reject(where + ".variable", std::to_string(term.variable),
           "0 to " + std::to_string(problem.cost.size() - 1));
  }
  if (term.block < 0 || term.block >= static_cast<int>(problem.blocks.size()) ||
      problem.blocks[static_cast<std::size_t>(term.block)].kind != BlockKind::kDense) {
    reject(where + ".block", std::to_string(term.block), "the index of a dense block");
  }
  const int size = problem.blocks[static_cast<std::size_t>(term.block)].size;
  if (term.vectors.rows() != size) {
    reject(where + ".vectors", std::to_string(term.vectors.rows()) + " rows", std::to_string(size));
  }
  if (term.vectors.cols() != term.weights.size()) {
    reject(where + ".weights", std::to_string(term.weights.size()) + " numbers",
           "one per column of vectors, " + std::to_string(term.vectors.cols()));
  }
  if (!term.vectors.allFinite() || !term.weights.allFinite()) {
    reject(where, "NaN or an infinity", "finite numbers");
  }
}

}  // namespace detail

TRAMMEL_INLINE void validate(const Problem& problem) {
  if (problem.cost.size() == 0) {
    detail::reject("problem.cost", "no variables", "at least one");
  }
  if (!problem.cost.allFinite()) {
    detail::reject("problem.cost", "NaN or an infinity", "finite numbers");
  }
  if (problem.blocks.empty()) {
    detail::reject("problem.blocks", "no blocks", "at least one");
  }
  for (std::size_t b = 0; b < problem.blocks.size(); ++b) {
    if (problem.blocks[b].size < 1) {
      detail::reject("problem.blocks[" + std::to_string(b) + "].size", std::to_string(problem.blocks[b].size),
                     "at least 1");
    }
  }
  for (std::size_t k = 0; k < problem.entries.size(); ++k) {
    if (!detail::fits(problem, problem.entries[k])) {
      detail::explain_entry(problem, k);
    }
  }
  for (std::size_t k = 0; k < problem.low_rank.size(); ++k) {
    detail::validate_low_rank(problem, problem.low_rank[k], "problem.low_rank[" + std::to_string(k) + "]");
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::sdp
