// SPDX-License-Identifier: Apache-2.0
// The memory of a solution by windows grows in proportion to the flight: this program keeps count of the
// bytes malloc has given out.
#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstddef>

#include <gtest/gtest.h>

#include "trammel/problem/zoo.hpp"
#include "trammel/window/solve.hpp"

namespace {
std::atomic<long> held{0};
std::atomic<long> most{0};

void* counted(void* block) {
  const long now = held += static_cast<long>(malloc_usable_size(block));
  long before = most.load();
  while (now > before && !most.compare_exchange_weak(before, now)) {
  }
  return block;
}
}  // namespace

// glibc's own names behind malloc and its relatives.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);

void* malloc(std::size_t size) { return counted(__libc_malloc(size)); }
void* calloc(std::size_t count, std::size_t size) { return counted(__libc_calloc(count, size)); }
void* realloc(void* block, std::size_t size) {
  held -= static_cast<long>(malloc_usable_size(block));
  return counted(__libc_realloc(block, size));
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return counted(__libc_memalign(alignment, size));
}
void free(void* block) {
  held -= static_cast<long>(malloc_usable_size(block));
  __libc_free(block);
}
}

namespace {

/// Most bytes held at a time beyond those held before, for a flight of so many segments.
long most_bytes(int segments) {
  const long before = held.load();
  most = before;
  const trammel::BandedProblem problem =
      trammel::assemble_banded(trammel::zoo::long_flight(segments).scenario);
  const auto solution = trammel::window::solve_windows(problem, {.core = 10, .overlap = 10});
  EXPECT_NE(solution.certificate.claim, trammel::Claim::kNone);
  return most.load() - before;
}

TEST(WindowMemory, GrowsInProportionToTheFlight) {
  const long small = most_bytes(100);
  const long middle = most_bytes(200);
  const long large = most_bytes(400);
  EXPECT_GT(small, 1000000);
  EXPECT_NEAR(static_cast<double>(large - middle), 2.0 * static_cast<double>(middle - small),
              0.1 * static_cast<double>(large - middle));
  RecordProperty("bytes_per_segment", std::to_string((large - middle) / 200));
}

}  // namespace
