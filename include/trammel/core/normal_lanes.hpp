// SPDX-License-Identifier: Apache-2.0
/// @file
/// Standard normal numbers of several random streams at once.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/elementary.hpp"
#include "trammel/core/packet.hpp"
#include "trammel/core/random.hpp"

namespace trammel::inline TRAMMEL_ABI {

[[nodiscard]] inline WideProduct<PacketWords> wide_product(std::uint32_t factor,
                                                           const PacketWords& words) noexcept {
  constexpr unsigned kHalf = 32;
  const PacketWords product = lower_product(factor, words);
  return {product >> kHalf, product};
}

/// Pairs of standard normal numbers: lane l of the n-th pair is a pure function of (seed, first_stream + l,
/// n). Box and Muller's method with 32 random bits for the radius (which ends at 6.8) and 32 for the angle:
/// one block of Philox yields two pairs. Independent of RandomStream(seed, stream), which counts its blocks
/// from 0 where these are counted from 2^63.
template <class Real>
class NormalLanes {
 public:
  using Vector = Eigen::Matrix<Real, 2, 1>;

  NormalLanes(std::uint64_t seed, std::uint64_t first_stream) noexcept
      : key_{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> kHalf)} {
    for (std::size_t lane = 0; lane < kLanesOf<Real>; ++lane) {
      const std::uint64_t stream = first_stream + lane;
      set_lane(stream_low_, lane, stream & kLower);
      set_lane(stream_high_, lane, stream >> kHalf);
    }
  }

  /// The next pair.
  Vector operator()() noexcept {
    first_ = !first_;
    if (first_) {
      draw();
      return pairs_.front();
    }
    return pairs_.back();
  }

 private:
  using Words = WordsOf<Real>;
  static constexpr unsigned kHalf = 32;
  static constexpr std::uint64_t kLower = 0xFFFFFFFFU;

  /// The lower half as a number.
  [[nodiscard]] static Real number(const Words& word) noexcept {
    constexpr double kTwo52 = 0x1p52;
    return from_bits((word & Words(kLower)) | bits_of(Real(kTwo52))) - kTwo52;
  }

  /// Two pairs from the next block, side by side: each hides the other's latency.
  void draw() noexcept {
    constexpr std::uint64_t kTopBit = std::uint64_t{1} << 31U;
    const std::array<Words, 4> block = philox4x32<Words>(
        {Words(counter_ & kLower), Words((counter_ >> kHalf) | kTopBit), stream_low_, stream_high_}, key_);
    ++counter_;
    // Odd multiples of 2^-33: neither 0 nor 1.
    constexpr double kStep = 0x1p-32;
    std::array<Real, 2> minus_log;
    std::array<SineCosine<Real>, 2> direction;
    for (std::size_t i = 0; i < 2; ++i) {
      minus_log[i] = -2.0 * logarithm<Real>(number(block[2 * i]) * kStep + 0.5 * kStep);
      const Real turn = number(block[2 * i + 1]) * kStep + (0.5 * kStep - 0.5);
      direction[i] = sine_cosine<Real>(2.0 * std::numbers::pi * turn);
    }
    for (std::size_t i = 0; i < 2; ++i) {
      using std::sqrt;
      const Real radius = sqrt(minus_log[i]);
      pairs_[i] = Vector(radius * direction[i].cosine, radius * direction[i].sine);
    }
  }

  std::array<std::uint32_t, 2> key_;
  Words stream_low_{};
  Words stream_high_{};
  std::uint64_t counter_ = 0;
  std::array<Vector, 2> pairs_;
  bool first_ = false;
};

}  // namespace trammel::inline TRAMMEL_ABI
