// SPDX-License-Identifier: Apache-2.0
/// @file
/// Counter-based random numbers: the n-th number of a stream is a pure function of (seed, stream, n), so
/// results do not depend on the number of threads, shards or the order of work.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// Upper and lower half of a 64-bit product.
template <class Word>
struct WideProduct {
  Word high;
  Word low;  ///< the upper half of a wider Word is undefined
};

[[nodiscard]] constexpr WideProduct<std::uint32_t> wide_product(std::uint32_t factor,
                                                                std::uint32_t word) noexcept {
  const std::uint64_t product = std::uint64_t{factor} * word;
  return {static_cast<std::uint32_t>(product >> 32U), static_cast<std::uint32_t>(product)};
}
[[nodiscard]] constexpr WideProduct<std::uint64_t> wide_product(std::uint32_t factor,
                                                                std::uint64_t word) noexcept {
  constexpr std::uint64_t kLower = 0xFFFFFFFFU;
  const std::uint64_t product = factor * (word & kLower);
  return {product >> 32U, product};
}

/// Philox 4x32 with ten rounds (Salmon, Moraes, Dror, Shaw 2011, "Parallel random numbers: as easy as
/// 1, 2, 3", section 4.3): four 32-bit words from a 128-bit counter and a 64-bit key. Word: a 32-bit number,
/// or numbers of 64 bits whose lower halves count and whose upper halves are left undefined.
template <class Word = std::uint32_t>
[[nodiscard]] constexpr std::array<Word, 4> philox4x32(std::array<Word, 4> counter,
                                                       std::array<std::uint32_t, 2> key) noexcept {
  constexpr int kRounds = 10;
  constexpr std::uint32_t kMultiplier0 = 0xD2511F53U;
  constexpr std::uint32_t kMultiplier1 = 0xCD9E8D57U;
  constexpr std::uint32_t kWeyl0 = 0x9E3779B9U;  // golden ratio
  constexpr std::uint32_t kWeyl1 = 0xBB67AE85U;  // sqrt(3) - 1
  for (int round = 0; round < kRounds; ++round) {
    const WideProduct<Word> product0 = wide_product(kMultiplier0, counter[0]);
    const WideProduct<Word> product1 = wide_product(kMultiplier1, counter[2]);
    counter = {product1.high ^ counter[1] ^ Word(key[0]), product1.low,
               product0.high ^ counter[3] ^ Word(key[1]), product0.low};
    key[0] += kWeyl0;
    key[1] += kWeyl1;
  }
  return counter;
}

/// A stream of random numbers. Two streams with different (seed, stream) are independent.
/// Meets UniformRandomBitGenerator, so the standard distributions accept it; `uniform` and `normal` below
/// give the same numbers with every standard library.
class RandomStream {
 public:
  using result_type = std::uint64_t;

  explicit constexpr RandomStream(std::uint64_t seed, std::uint64_t stream = 0) noexcept
      : seed_(seed), stream_(stream) {}

  [[nodiscard]] static constexpr result_type min() noexcept { return 0; }
  [[nodiscard]] static constexpr result_type max() noexcept { return ~result_type{0}; }

  /// Next 64 random bits.
  constexpr result_type operator()() noexcept {
    if (!half_used_) {
      block_ = philox4x32({static_cast<std::uint32_t>(counter_), static_cast<std::uint32_t>(counter_ >> 32U),
                           static_cast<std::uint32_t>(stream_), static_cast<std::uint32_t>(stream_ >> 32U)},
                          {static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32U)});
      ++counter_;
    }
    const std::size_t first = half_used_ ? 2 : 0;
    half_used_ = !half_used_;
    return (static_cast<std::uint64_t>(block_[first]) << 32U) | block_[first + 1];
  }

  /// Uniform on [0, 1), 53 random bits.
  constexpr double uniform() noexcept { return static_cast<double>((*this)() >> 11U) * 0x1p-53; }

  /// +1 or -1 with equal probability.
  constexpr double sign() noexcept { return ((*this)() >> 63U) != 0 ? 1.0 : -1.0; }

  /// Standard normal (Box-Muller, both values used).
  double normal() noexcept {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    const double angle = 2.0 * std::numbers::pi * uniform();
    spare_ = radius * std::sin(angle);
    has_spare_ = true;
    return radius * std::cos(angle);
  }

 private:
  std::uint64_t seed_;
  std::uint64_t stream_;
  std::uint64_t counter_ = 0;
  std::array<std::uint32_t, 4> block_{};
  bool half_used_ = false;
  bool has_spare_ = false;
  double spare_ = 0.0;
};

/// SplitMix64 (Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators", figure 15): a
/// sequential generator of a 64-bit state. For work that runs in parallel use RandomStream; this one
/// reproduces data that were drawn in sequence.
class SplitMix64 {
 public:
  using result_type = std::uint64_t;

  explicit constexpr SplitMix64(std::uint64_t seed) noexcept : state_(seed) {}

  [[nodiscard]] static constexpr result_type min() noexcept { return 0; }
  [[nodiscard]] static constexpr result_type max() noexcept { return ~result_type{0}; }

  /// Next 64 random bits.
  constexpr result_type operator()() noexcept {
    constexpr std::uint64_t kIncrement = 0x9E3779B97F4A7C15U;  // golden ratio, odd
    constexpr std::uint64_t kMultiplier1 = 0xBF58476D1CE4E5B9U;
    constexpr std::uint64_t kMultiplier2 = 0x94D049BB133111EBU;
    state_ += kIncrement;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * kMultiplier1;
    z = (z ^ (z >> 27U)) * kMultiplier2;
    return z ^ (z >> 31U);
  }

  /// Uniform on [0, 1), 53 random bits.
  constexpr double uniform() noexcept { return static_cast<double>((*this)() >> 11U) * 0x1p-53; }
  /// The top bit of the next number.
  constexpr bool bit() noexcept { return ((*this)() >> 63U) != 0; }
  /// +1 where the top bit of the next number is set, -1 otherwise.
  constexpr double sign() noexcept { return bit() ? 1.0 : -1.0; }

 private:
  std::uint64_t state_;
};

}  // namespace trammel::inline TRAMMEL_ABI
