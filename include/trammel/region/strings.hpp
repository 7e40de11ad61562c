// SPDX-License-Identifier: Apache-2.0
/// @file
/// Random binary strings, stored as bits, and the sums over the subsets they select.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/region/residuals.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// `count` strings of `length` bits each. Bit n of string j is bit n % 64 of word n / 64 of its row; unused
/// bits are zero.
class BinaryStrings {
 public:
  static constexpr int kWordBits = 64;

  /// Sets the size; all bits zero. Does not allocate if there is room.
  void resize(int count, int length) {
    require(count >= 1 && length >= 1, [&] {
      return ErrorDetail{"BinaryStrings::resize: size",
                         std::to_string(count) + " x " + std::to_string(length), "at least 1 x 1"};
    });
    count_ = count;
    length_ = length;
    words_ = (length + kWordBits - 1) / kWordBits;
    bits_.assign(static_cast<std::size_t>(count) * static_cast<std::size_t>(words_), 0);
  }
  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] int length() const { return length_; }
  [[nodiscard]] std::span<std::uint64_t> row(int j) {
    return {bits_.data() + static_cast<std::size_t>(j) * static_cast<std::size_t>(words_),
            static_cast<std::size_t>(words_)};
  }
  [[nodiscard]] std::span<const std::uint64_t> row(int j) const {
    return {bits_.data() + static_cast<std::size_t>(j) * static_cast<std::size_t>(words_),
            static_cast<std::size_t>(words_)};
  }
  [[nodiscard]] bool bit(int j, int n) const {
    return ((row(j)[static_cast<std::size_t>(n / kWordBits)] >> static_cast<unsigned>(n % kWordBits)) & 1U) !=
           0;
  }
  void set(int j, int n, bool value) {
    std::uint64_t& word = row(j)[static_cast<std::size_t>(n / kWordBits)];
    const std::uint64_t mask = std::uint64_t{1} << static_cast<unsigned>(n % kWordBits);
    word = value ? (word | mask) : (word & ~mask);
  }
  /// Bits of the last word that are in use.
  [[nodiscard]] std::uint64_t last_mask() const {
    const int used = length_ - (words_ - 1) * kWordBits;
    return used == kWordBits ? ~std::uint64_t{0} : (std::uint64_t{1} << static_cast<unsigned>(used)) - 1;
  }
  /// True if string j is not zero and differs from all before it.
  [[nodiscard]] bool is_new(int j) const;

 private:
  int count_ = 0;
  int length_ = 0;
  int words_ = 0;
  std::vector<std::uint64_t> bits_;
};

/// Fair bits for every string.
template <class Generator>
void draw_strings(Generator& random, BinaryStrings& strings) {
  for (int j = 0; j < strings.count(); ++j) {
    for (std::uint64_t& word : strings.row(j)) {
      word = random();
    }
    strings.row(j).back() &= strings.last_mask();
  }
}

/// Fair bits, every string distinct and none zero: a string that is not new is drawn again.
/// Error if there are fewer than count + 1 different strings.
template <class Generator>
void draw_distinct_strings(Generator& random, BinaryStrings& strings) {
  require(strings.length() >= 31 || (std::int64_t{1} << strings.length()) > strings.count(), [&] {
    return ErrorDetail{
        "strings",
        std::to_string(strings.count() + 1) + " strings of " + std::to_string(strings.length()) + " bits",
        "at most 2^length strings: use fewer strings or more probes"};
  });
  for (int j = 0; j < strings.count(); ++j) {
    do {
      for (std::uint64_t& word : strings.row(j)) {
        word = random();
      }
      strings.row(j).back() &= strings.last_mask();
    } while (!strings.is_new(j));
  }
}

/// Work space of subset_sums, kept between calls.
struct SubsetSumWork {
  RowMatrix padded;
  RowMatrix table;
};

/// sums.row(j) = sum of values.row(n) over the bits n set in string j; the extra row sums.row(count) is the
/// sum over all n. `sums` becomes (count + 1) x (columns rounded up to a multiple of four; extra ones zero).
/// Bits are taken eight at a time from tables of all 256 partial sums (Arlazarov, Dinic, Kronrod, Faradzev
/// 1970): count * length / 8 additions per column instead of count * length.
void subset_sums(const BinaryStrings& strings, const RowMatrix& values, SubsetSumWork& work, RowMatrix& sums);

/// A random order of 0 ... M-1 (Fisher and Yates): reference.size() = M - 1 flags, true where member j + 1
/// stands after member 0. Used to break ties with member 0.
template <class Generator>
void draw_tie_flags(Generator& random, int members, std::vector<char>& after_reference) {
  // Only who stands after member 0 matters: its place is uniform, and so is the set of those after it.
  after_reference.assign(static_cast<std::size_t>(members - 1), 0);
  auto remaining = static_cast<int>(random.uniform() * members);  // members after the reference
  for (int j = 0; j < members - 1; ++j) {
    const int left = members - 1 - j;
    if (random.uniform() * left < remaining) {
      after_reference[static_cast<std::size_t>(j)] = 1;
      --remaining;
    }
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::region

#ifndef TRAMMEL_COMPILED
#include "trammel/region/strings_impl.hpp"
#endif
