// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of strings.hpp.
#pragma once

#include <algorithm>
#include <bit>

#include "trammel/region/strings.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

TRAMMEL_INLINE bool BinaryStrings::is_new(int j) const {
  const std::span<const std::uint64_t> candidate = row(j);
  if (std::all_of(candidate.begin(), candidate.end(), [](std::uint64_t word) { return word == 0; })) {
    return false;
  }
  for (int other = 0; other < j; ++other) {
    const std::span<const std::uint64_t> old = row(other);
    if (old[0] == candidate[0] && std::equal(old.begin(), old.end(), candidate.begin())) {
      return false;
    }
  }
  return true;
}

namespace detail {

inline constexpr int kGroupBits = 8;       // a table of 256 rows stays in the first-level cache
inline constexpr int kColumnMultiple = 4;  // doubles in a 256-bit register

/// All sums over subsets of `rows` consecutive rows of values; kWidth = 0: any number of columns.
template <int kWidth>
void fill_table(const double* values, int rows, int width, double* table) {
  const int columns = kWidth == 0 ? width : kWidth;
  std::fill_n(table, columns, 0.0);
  for (unsigned mask = 1; mask < (1U << static_cast<unsigned>(rows)); ++mask) {
    const double* rest = table + static_cast<std::ptrdiff_t>(mask & (mask - 1)) * columns;
    const double* added = values + static_cast<std::ptrdiff_t>(std::countr_zero(mask)) * columns;
    double* target = table + static_cast<std::ptrdiff_t>(mask) * columns;
    for (int c = 0; c < columns; ++c) {
      target[c] = rest[c] + added[c];
    }
  }
}

template <int kWidth>
void add_group(const BinaryStrings& strings, int group, int width, const double* table, double* sums) {
  const int columns = kWidth == 0 ? width : kWidth;
  constexpr int kGroupsPerWord = BinaryStrings::kWordBits / kGroupBits;
  const auto word = static_cast<std::size_t>(group / kGroupsPerWord);
  const auto shift = static_cast<unsigned>(kGroupBits * (group % kGroupsPerWord));
  for (int j = 0; j < strings.count(); ++j) {
    const auto mask = static_cast<std::ptrdiff_t>((strings.row(j)[word] >> shift) & 0xFFU);
    const double* row = table + mask * columns;
    double* target = sums + static_cast<std::ptrdiff_t>(j) * columns;
    for (int c = 0; c < columns; ++c) {
      target[c] += row[c];
    }
  }
}

template <int kWidth>
void subset_sums_of_width(const BinaryStrings& strings, SubsetSumWork& work, RowMatrix& sums) {
  const int length = strings.length();
  const auto width = static_cast<int>(work.padded.cols());
  for (int first = 0; first < length; first += kGroupBits) {
    const int rows = std::min(kGroupBits, length - first);
    fill_table<kWidth>(work.padded.data() + static_cast<std::ptrdiff_t>(first) * width, rows, width,
                       work.table.data());
    add_group<kWidth>(strings, first / kGroupBits, width, work.table.data(), sums.data());
    // The full set of the group also goes to the row of totals.
    const double* full =
        work.table.data() + static_cast<std::ptrdiff_t>((1U << static_cast<unsigned>(rows)) - 1U) * width;
    double* total = sums.data() + static_cast<std::ptrdiff_t>(strings.count()) * width;
    for (int c = 0; c < width; ++c) {
      total[c] += full[c];
    }
  }
}

}  // namespace detail

TRAMMEL_INLINE void subset_sums(const BinaryStrings& strings, const RowMatrix& values, SubsetSumWork& work,
                                RowMatrix& sums) {
  require(values.rows() == strings.length(), [&] {
    return ErrorDetail{"subset_sums: values", std::to_string(values.rows()) + " rows",
                       "as many as bits in a string, " + std::to_string(strings.length())};
  });
  using detail::kColumnMultiple;
  const Eigen::Index width = (values.cols() + kColumnMultiple - 1) / kColumnMultiple * kColumnMultiple;
  work.padded.setZero(values.rows(), width);
  work.padded.leftCols(values.cols()) = values;
  work.table.resize(Eigen::Index{1} << detail::kGroupBits, width);
  sums.setZero(strings.count() + 1, width);
  switch (width) {
    case 4:
      return detail::subset_sums_of_width<4>(strings, work, sums);
    case 8:
      return detail::subset_sums_of_width<8>(strings, work, sums);
    case 12:
      return detail::subset_sums_of_width<12>(strings, work, sums);
    default:
      return detail::subset_sums_of_width<0>(strings, work, sums);
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::region
