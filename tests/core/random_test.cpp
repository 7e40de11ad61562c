// SPDX-License-Identifier: Apache-2.0
#include "trammel/core/random.hpp"

#include <gtest/gtest.h>

namespace {

// Known answers of the reference implementation (kat_vectors of Random123, philox4x32 with ten rounds).
TEST(Random, PhiloxKnownAnswers) {
  const std::array<std::uint32_t, 4> zero = trammel::philox4x32({0, 0, 0, 0}, {0, 0});
  EXPECT_EQ(zero, (std::array<std::uint32_t, 4>{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  const std::uint32_t ones = 0xffffffff;
  const std::array<std::uint32_t, 4> full = trammel::philox4x32({ones, ones, ones, ones}, {ones, ones});
  EXPECT_EQ(full, (std::array<std::uint32_t, 4>{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
}

TEST(Random, NormalHasItsMoments) {
  trammel::RandomStream stream(7, 3);
  const int count = 200000;
  double mean = 0.0;
  double square = 0.0;
  double fourth = 0.0;
  for (int i = 0; i < count; ++i) {
    const double x = stream.normal();
    mean += x / count;
    square += x * x / count;
    fourth += x * x * x * x / count;
  }
  const double se = 1.0 / std::sqrt(count);
  EXPECT_LT(std::abs(mean), 5 * se);
  EXPECT_LT(std::abs(square - 1), 5 * std::sqrt(2.0) * se);
  EXPECT_LT(std::abs(fourth - 3), 5 * std::sqrt(96.0) * se);
}

TEST(Random, StreamsDoNotDependOnEachOther) {
  trammel::RandomStream one(1, 1);
  trammel::RandomStream two(1, 2);
  trammel::RandomStream again(1, 1);
  int equal = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto a = one();
    equal += static_cast<int>(a == two());
    EXPECT_EQ(a, again());
  }
  EXPECT_EQ(equal, 0);
}

}  // namespace
