// SPDX-License-Identifier: Apache-2.0
#include "report/truth_comparison.hpp"

#include <gtest/gtest.h>

#include "sample_estimate.hpp"

namespace {

using namespace trammel;

TEST(TruthComparison, ConstantOffsetIsTheErrorUnderEveryCriterion) {
  Scenario scenario = test::sample_scenario().scenario;
  const estimate::TrajectoryEstimate estimate = test::sample_estimate();
  for (const CriterionKind kind :
       {CriterionKind::kIntegral, CriterionKind::kTimes, CriterionKind::kWindow, CriterionKind::kFinal}) {
    scenario.criterion.kind = kind;
    scenario.criterion.times_s = {0.0, 3.3, test::kSampleEnd_s};
    scenario.criterion.window_s = {10.1, 20.7};
    const auto comparison = report::compare_with_truth(scenario, estimate, test::sample_truth());
    EXPECT_NEAR(comparison.estimate_rms_m, 3.0, 1e-9);
    EXPECT_NEAR(comparison.gauss_markov_rms_m, 4.0, 1e-9);
  }
}

TEST(TruthComparison, WindowSeesOnlyItsPartOfTheError) {
  Scenario scenario = test::sample_scenario().scenario;
  scenario.criterion.kind = CriterionKind::kWindow;
  scenario.criterion.window_s = {40.0, 60.0};
  estimate::TrajectoryEstimate estimate = test::sample_estimate();
  auto& path = estimate.observed->path;
  path = test::sample_path(0.0);
  for (std::size_t i = 0; i < path.times_s.size(); ++i) {
    const double t = path.times_s[i];
    path.position_m(static_cast<Eigen::Index>(i), 2) += t < 40.0 ? 100.0 : (t > 60.0 ? -100.0 : 7.0);
  }
  const auto comparison = report::compare_with_truth(scenario, estimate, test::sample_truth());
  EXPECT_NEAR(comparison.estimate_rms_m, 7.0, 1e-9);
}

}  // namespace
