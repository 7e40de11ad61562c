// SPDX-License-Identifier: Apache-2.0
// Counts calls of malloc: the iteration loop of the structured solvers must not allocate.
#include <atomic>
#include <cstdlib>
#include <new>

#include <gtest/gtest.h>

#include "trammel/minimax/solve.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/zoo.hpp"

namespace {
std::atomic<long> allocations{0};
}  // namespace

extern "C" void* __libc_malloc(std::size_t size);
// Eigen allocates with malloc; the replacement counts and passes on.
extern "C" void* malloc(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}

namespace {

long allocations_of(const trammel::GuaranteedProblem& problem, int iterations) {
  const long before = allocations.load();
  (void)trammel::minimax::solve(problem, {.relative_gap = 1e-13, .max_iterations = iterations});
  return allocations.load() - before;
}

TEST(Allocation, NoneInTheIterationLoop) {
  const trammel::TrajectoryProblem trajectory = trammel::assemble(trammel::zoo::manoeuvre_noisy().scenario);
  (void)allocations_of(trajectory.problem, 5);
  const long few = allocations_of(trajectory.problem, 15);
  const long many = allocations_of(trajectory.problem, 30);
  EXPECT_GT(few, 0);
  EXPECT_EQ(many, few);
}

}  // namespace
