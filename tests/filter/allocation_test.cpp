// SPDX-License-Identifier: Apache-2.0
/// The filters at run time take no memory from the heap: every malloc of this program is counted.
#include <cmath>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "heap_watch.hpp"
#include "trammel/filter/fading_memory_filter.hpp"
#include "trammel/filter/fixed_gain_filter.hpp"
#include "trammel/filter/tracker.hpp"

namespace {

using namespace trammel::filter;
using trammel::test::allocation_count;

/// Allocations of `work` called 100 times with the count so far.
template <class Work>
long allocations_of(const Work& work) {
  const long before = allocation_count();
  for (int n = 0; n < 100; ++n) {
    work(n);
  }
  return allocation_count() - before;
}

TEST(FilterAllocation, TheCountSeesAVector) {
  EXPECT_GE(allocations_of([](int n) { EXPECT_EQ(std::vector<int>(10, n).back(), n); }), 100);
}

TEST(FilterAllocation, FixedGainFilter) {
  FixedGainFilter<double, 3, 3> filter(Eigen::Vector3d(0.6, 0.3, 0.1), 0.5);
  EXPECT_EQ(allocations_of([&](int n) { filter.update(Eigen::Vector3d(n, -n, 2.0 * n)); }), 0);
  EXPECT_TRUE(filter.state().allFinite());
}

TEST(FilterAllocation, FadingMemoryFilter) {
  FadingMemoryFilter<float, 4, 2> filter(5.0F, 0.5F);
  EXPECT_EQ(allocations_of([&](int n) {
              filter.predict(n % 2 == 0 ? 0.3F : 0.8F);
              filter.correct(Eigen::Vector2f(1.0F, static_cast<float>(n)));
            }),
            0);
  EXPECT_TRUE(filter.state().allFinite());
}

TEST(FilterAllocation, TrackerFromStartUpOverGapsAndOutliers) {
  TrackerSettings settings;
  settings.gate = 4.0;
  settings.max_rejections = 2;
  Tracker<double, 2, 3> tracker(Eigen::Vector2d(0.5, 0.3), 13.0 / 27.0, 25.0 / 27.0, settings);
  int rejected = 0;
  EXPECT_EQ(allocations_of([&](int n) {
              std::optional<Eigen::Vector3d> z(Eigen::Vector3d(n, 2.0 * n, 3.0));
              if (n % 10 == 9) {
                z.reset();
              } else if (n % 20 == 15) {
                z->x() += 1000.0;
              }
              rejected += tracker.step(z) == SampleUse::kRejected ? 1 : 0;
              const Tracker<double, 2, 3> branch = tracker;
              EXPECT_EQ(branch.starting(), tracker.starting());
            }),
            0);
  EXPECT_GT(rejected, 0);
}

}  // namespace
