// SPDX-License-Identifier: Apache-2.0
// The iteration loops of the structured solver take no memory from the heap: this program counts every call
// of malloc.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "heap_watch.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

/// Calls of malloc between one report of progress and the next.
std::vector<long> allocations_per_iteration(const trammel::GuaranteedProblem& problem) {
  std::vector<long> counts;
  counts.reserve(1000);
  long last = -1;
  const auto solution = trammel::minimax::solve(problem, {}, [&](const trammel::Progress&) {
    const long now = trammel::test::allocation_count();
    if (last >= 0) {
      counts.push_back(now - last);
    }
    last = now;
  });
  EXPECT_EQ(solution.status, trammel::SolveStatus::kOptimal);
  return counts;
}

TEST(Allocation, TheCounterCounts) {
  const long before = trammel::test::allocation_count();
  const std::vector<double> block(1000, 1.0);
  EXPECT_EQ(block.back(), 1.0);
  EXPECT_GE(trammel::test::allocation_count(), before + 1);
}

TEST(Allocation, IterationsTakeNone) {
  for (const auto& instance :
       {trammel::zoo::manoeuvre_noisy(), trammel::zoo::r20(), trammel::zoo::r40_noisy()}) {
    const std::vector<long> counts = allocations_per_iteration(trammel::assemble(instance.scenario).problem);
    ASSERT_GE(counts.size(), 10U);
    // Once, where Newton's method in the multipliers hands over to the interior point, memory is taken.
    EXPECT_GE(std::count(counts.begin(), counts.end(), 0L), static_cast<long>(counts.size()) - 1)
        << instance.name;
  }
}

}  // namespace
