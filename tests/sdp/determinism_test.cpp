// SPDX-License-Identifier: Apache-2.0
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "small_problems.hpp"
#include "trammel/sdp/solve.hpp"

namespace {

using trammel::RandomStream;
using trammel::sdp::Problem;
using trammel::sdp::Solution;

void expect_same_bits(const Solution& a, const Solution& b) {
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.slack, b.slack);
  EXPECT_EQ(a.multiplier, b.multiplier);
  EXPECT_EQ(a.dimacs, b.dimacs);
}

TEST(SdpDeterminism, SameBitsAgainAndInEightThreads) {
  constexpr int kThreads = 8;
  RandomStream random(31);
  const std::vector<Problem> problems{trammel::test::theta_of_cycle(9), trammel::test::cut_bound(61, random)};
  for (const Problem& problem : problems) {
    const Solution reference = solve(problem);
    expect_same_bits(reference, solve(problem));
    std::vector<Solution> solutions(kThreads);
    std::vector<std::thread> threads;
    threads.reserve(kThreads);
    for (Solution& solution : solutions) {
      threads.emplace_back([&problem, &solution] { solution = solve(problem); });
    }
    for (std::thread& thread : threads) {
      thread.join();
    }
    for (const Solution& solution : solutions) {
      expect_same_bits(reference, solution);
    }
  }
}

}  // namespace
