// SPDX-License-Identifier: Apache-2.0
// The memory of a solution by windows grows in proportion to the flight: this program keeps count of the
// bytes malloc has given out.
#include <algorithm>

#include <gtest/gtest.h>

#include "heap_watch.hpp"
#include "trammel/problem/zoo.hpp"
#include "trammel/window/solve.hpp"

namespace {

/// Most bytes held at a time beyond those held before, for a flight of so many segments.
long most_bytes(int segments) {
  trammel::test::forget_most_bytes();
  const long before = trammel::test::bytes_held();
  const trammel::BandedProblem problem =
      trammel::assemble_banded(trammel::zoo::long_flight(segments).scenario);
  const auto solution = trammel::window::solve_windows(problem, {.core = 10, .overlap = 10});
  EXPECT_NE(solution.certificate.claim, trammel::Claim::kNone);
  return trammel::test::most_bytes_held() - before;
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
