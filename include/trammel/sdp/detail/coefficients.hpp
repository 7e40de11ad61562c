// SPDX-License-Identifier: Apache-2.0
/// @file
/// Sparse coefficient matrices of one dense block, laid out for the loops of the solver.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

#include "trammel/sdp/detail/cone.hpp"
#include "trammel/sdp/detail/model.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp::detail {

/// The F_i of one block, the fullest first. Entries are in the upper triangle (row <= column); `half` is half
/// the weight that an entry has in an inner product with a symmetric matrix: the value off the diagonal, half
/// the value on it. So <F, S> = sum 2 half S(row, column), and <F, U> = sum half (U(row, column) + U(column,
/// row)) for any U.
struct Coefficients {
  struct Range {
    std::size_t begin;
    std::size_t end;
  };

  explicit Coefficients(const DenseData& data) {
    std::vector<Range> ranges;
    for (std::size_t k = 0; k < data.entries.size();) {
      std::size_t end = k;
      while (end < data.entries.size() && data.entries[end].variable == data.entries[k].variable) {
        ++end;
      }
      ranges.push_back({k, end});
      k = end;
    }
    std::stable_sort(ranges.begin(), ranges.end(),
                     [](const Range& a, const Range& b) { return a.end - a.begin > b.end - b.begin; });
    for (const Range& range : ranges) {
      const int variable_here = data.entries[range.begin].variable;
      if (variable_here != kConstant) {
        append(data, range);
        variable.push_back(variable_here);
        start.push_back(row.size());
      }
    }
    constant_begin = row.size();
    for (const Range& range : ranges) {
      if (data.entries[range.begin].variable == kConstant) {
        append(data, range);
      }
    }
  }

  [[nodiscard]] std::size_t count() const { return variable.size(); }
  [[nodiscard]] double value(std::size_t k) const { return row[k] == column[k] ? 2.0 * half[k] : half[k]; }

  /// Sum over the entries of the k-th matrix with a symmetric matrix whose upper triangle is valid.
  template <class Scalar>
  [[nodiscard]] Scalar inner(std::size_t begin, std::size_t end, const MatrixOf<Scalar>& symmetric) const {
    Scalar sum(0);
    for (std::size_t e = begin; e < end; ++e) {
      sum += Scalar(half[e]) * symmetric(row[e], column[e]);
    }
    return sum + sum;
  }

  std::vector<int> variable;          ///< of the k-th matrix
  std::vector<std::size_t> start{0};  ///< entries of the k-th matrix: start[k] to start[k + 1]
  std::size_t constant_begin = 0;     ///< entries of F_0: from here to the end
  std::vector<int> row;
  std::vector<int> column;
  std::vector<double> half;

 private:
  void append(const DenseData& data, const Range& range) {
    for (std::size_t k = range.begin; k < range.end; ++k) {
      const Entry& e = data.entries[k];
      row.push_back(e.row);
      column.push_back(e.column);
      half.push_back(e.row == e.column ? e.value / 2 : e.value);
    }
  }
};

/// Positions (row <= column) used by any coefficient, and the diagonal.
struct Pattern {
  std::vector<int> row;
  std::vector<int> column;

  /// `from` and `to` bound the entries; the diagonal is always part.
  Pattern(const Coefficients& coefficients, std::size_t from, std::size_t to, int size) {
    std::vector<std::pair<int, int>> positions;
    for (int k = 0; k < size; ++k) {
      positions.emplace_back(k, k);
    }
    for (std::size_t k = from; k < to; ++k) {
      positions.emplace_back(coefficients.column[k], coefficients.row[k]);
    }
    std::sort(positions.begin(), positions.end());
    positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
    for (const auto& [c, r] : positions) {
      row.push_back(r);
      column.push_back(c);
    }
  }
};

}  // namespace trammel::inline TRAMMEL_ABI::sdp::detail
