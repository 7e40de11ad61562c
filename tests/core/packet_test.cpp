// SPDX-License-Identifier: Apache-2.0
#include "trammel/core/packet.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "trammel/core/elementary.hpp"
#include "trammel/core/normal_lanes.hpp"
#include "trammel/core/random.hpp"

namespace {

using trammel::NormalLanes;
using trammel::Packet;
using trammel::PacketWords;

Packet counting(double first) {
  Packet result;
  for (std::size_t lane = 0; lane < Packet::kLanes; ++lane) {
    result.set(lane, first + static_cast<double>(lane));
  }
  return result;
}

TEST(Packet, ComputesLaneByLane) {
  const Packet a = counting(-3.0);
  const Packet b = counting(0.5);
  for (std::size_t lane = 0; lane < Packet::kLanes; ++lane) {
    const double x = a[lane];
    const double y = b[lane];
    EXPECT_EQ((a + b)[lane], x + y);
    EXPECT_EQ((a - b)[lane], x - y);
    EXPECT_EQ((a * b)[lane], x * y);
    EXPECT_EQ((a / b)[lane], x / y);
    EXPECT_EQ((-a)[lane], -x);
    EXPECT_EQ(sqrt(b)[lane], std::sqrt(y));
    EXPECT_EQ(abs(a)[lane], std::abs(x));
    EXPECT_EQ(copysign(b, a)[lane], std::copysign(y, x));
    EXPECT_EQ(atan2(a, b)[lane], std::atan2(x, y));
    EXPECT_EQ(select(a < b && !(a <= -2.0), a, b)[lane], x > -2.0 ? x : y);
    EXPECT_EQ(select(a == 0.0 || a > 2.0, a, b)[lane], x == 0.0 || x > 2.0 ? x : y);
  }
}

TEST(Packet, TellsWhetherAnyOrAllLanesHold) {
  const Packet a = counting(0.0);
  for (std::size_t lane = 0; lane < Packet::kLanes; ++lane) {
    const double value = static_cast<double>(lane);
    EXPECT_TRUE(any(a == value));
    EXPECT_FALSE(all(a == value));
    EXPECT_FALSE(all(!(a == value)));
  }
  EXPECT_TRUE(all(a >= 0.0));
  EXPECT_FALSE(any(a < 0.0));
  const auto one = [] { return Packet(1.0); };
  const auto two = [] { return Packet(2.0); };
  EXPECT_TRUE(all(choose(a >= 0.0, one, two) == 1.0));
  EXPECT_TRUE(all(choose(a < 0.0, one, two) == 2.0));
  EXPECT_TRUE(all(choose(a < 2.0, one, two) == select(a < 2.0, Packet(1.0), Packet(2.0))));
}

/// Error of `value` in units of the last place of `exact`.
double ulps(double value, long double exact) {
  const double near = std::abs(static_cast<double>(exact));
  const double unit = std::nextafter(near, std::numeric_limits<double>::infinity()) - near;
  return static_cast<double>(std::abs(static_cast<long double>(value) - exact) / unit);
}

TEST(Elementary, SineCosineAndLogarithmToTheLastPlace) {
  trammel::RandomStream random(11);
  double worst = 0.0;
  double worst_logarithm = 0.0;
  for (int i = 0; i < 200000; ++i) {
    double angle = (random.uniform() - 0.5) * (i % 3 == 0 ? 1e-3 : 20.0);
    if (i % 5 == 0) {
      angle = 0.5 * std::numbers::pi * (i % 9 - 4) + 1e-7 * angle;
    }
    const auto number = trammel::sine_cosine(angle);
    const auto lanes = trammel::sine_cosine(Packet(angle));
    const long double exact = angle;
    // Next to a multiple of a quarter turn the reduction leaves 1e-26.
    constexpr double kReduction = 1e-10;
    if (std::abs(number.sine) > kReduction && std::abs(number.cosine) > kReduction) {
      worst = std::max({worst, ulps(number.sine, std::sin(exact)), ulps(number.cosine, std::cos(exact)),
                        ulps(lanes.sine[1], std::sin(exact)), ulps(lanes.cosine[5], std::cos(exact))});
    }
    const double positive = std::exp(40.0 * angle) * random.uniform() + 1e-300;
    worst_logarithm =
        std::max({worst_logarithm, ulps(trammel::logarithm(positive), std::log(1.0L * positive)),
                  ulps(trammel::logarithm(Packet(positive))[3], std::log(1.0L * positive))});
  }
  EXPECT_LT(worst, 1.5);
  EXPECT_LT(worst_logarithm, 1.2);
  EXPECT_EQ(trammel::sine_cosine(0.0).cosine, 1.0);
  EXPECT_EQ(trammel::logarithm(1.0), 0.0);
}

TEST(NormalLanes, LanesArePureFunctionsOfTheirStreams) {
  NormalLanes<Packet> from_five(7, 5);
  NormalLanes<Packet> from_nine(7, 9);
  NormalLanes<double> nine(7, 9);
  NormalLanes<Packet> other_seed(8, 5);
  for (int i = 0; i < 1001; ++i) {
    const auto a = from_five();
    const auto b = from_nine();
    const auto c = nine();
    const auto d = other_seed();
    for (int k = 0; k < 2; ++k) {
      EXPECT_EQ(a[k][4], b[k][0]);
      EXPECT_NEAR(b[k][0], c[k], 1e-14);
      EXPECT_NE(a[k][0], a[k][1]);
      EXPECT_NE(a[k][0], d[k][0]);
    }
  }
}

TEST(NormalLanes, AreStandardNormalAndUncorrelated) {
  constexpr int kDraws = 200000;
  constexpr double kCount = 2.0 * kDraws * Packet::kLanes;
  NormalLanes<Packet> normal(3, 0);
  Packet sum = 0.0;
  Packet square = 0.0;
  Packet fourth = 0.0;
  Packet product = 0.0;
  Packet following = 0.0;
  Packet beyond = 0.0;  // |z| > 3
  Packet before = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const auto pair = normal();
    for (int k = 0; k < 2; ++k) {
      const Packet z2 = pair[k] * pair[k];
      sum += pair[k];
      square += z2;
      fourth += z2 * z2;
      beyond += select(z2 > 9.0, Packet(1.0), Packet(0.0));
    }
    product += pair[0] * pair[1];
    following += pair[0] * before;
    before = pair[1];
  }
  const auto total = [](const Packet& packet) {
    double result = 0.0;
    for (std::size_t lane = 0; lane < Packet::kLanes; ++lane) {
      result += packet[lane];
    }
    return result;
  };
  constexpr double kSigmas = 4.5;
  const double unit = kSigmas / std::sqrt(kCount);
  EXPECT_NEAR(total(sum) / kCount, 0.0, unit);
  EXPECT_NEAR(total(square) / kCount, 1.0, unit * std::sqrt(2.0));
  EXPECT_NEAR(total(fourth) / kCount, 3.0, unit * std::sqrt(96.0));
  EXPECT_NEAR(total(product) / (0.5 * kCount), 0.0, unit * std::sqrt(2.0));
  EXPECT_NEAR(total(following) / (0.5 * kCount), 0.0, unit * std::sqrt(2.0));
  constexpr double kBeyondThree = 2.699796063e-3;
  EXPECT_NEAR(total(beyond) / kCount, kBeyondThree, unit * std::sqrt(kBeyondThree));
}

TEST(NormalLanes, WideWordsGiveTheSameBlocks) {
  const std::array<std::uint32_t, 4> narrow = trammel::philox4x32({1, 2, 3, 4}, {5, 6});
  const auto wide = trammel::philox4x32<PacketWords>(
      {PacketWords(1), PacketWords(2), PacketWords(3), PacketWords(4)}, {5, 6});
  const auto number = trammel::philox4x32<std::uint64_t>({1, 2, 3, 4}, {5, 6});
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(static_cast<std::uint32_t>(wide[i][6]), narrow[i]);
    EXPECT_EQ(static_cast<std::uint32_t>(number[i]), narrow[i]);
  }
}

}  // namespace
