// SPDX-License-Identifier: Apache-2.0
#include "trammel/estimate/trajectory_estimate.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "trammel/core/random.hpp"
#include "trammel/estimate/bias_bound.hpp"
#include "trammel/estimate/pointwise_guarantee.hpp"
#include "trammel/estimate/simulate_measurements.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

using namespace trammel;
using estimate::estimate_trajectory;
using estimate::TrajectoryEstimate;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

class Zoo : public testing::TestWithParam<zoo::Instance> {};

TEST_P(Zoo, ReproducesTheCertifiedInterval) {
  const zoo::Instance& instance = GetParam();
  const TrajectoryEstimate result = estimate_trajectory(instance.scenario);
  EXPECT_EQ(result.solution.status, SolveStatus::kOptimal);
  EXPECT_LE(result.solution.relative_gap(), 1e-8);
  constexpr double kTolerance = 1e-7;
  EXPECT_GE(result.guaranteed_rms_m, instance.optimum->lower_rms_m * (1 - kTolerance));
  EXPECT_LE(result.guaranteed_rms_m, instance.optimum->upper_rms_m * (1 + kTolerance));
  EXPECT_GE(result.lower_bound_rms_m, instance.optimum->lower_rms_m * (1 - kTolerance));
  EXPECT_LE(result.lower_bound_rms_m, instance.optimum->upper_rms_m * (1 + kTolerance));
  EXPECT_NEAR(result.gauss_markov_rms_m / instance.optimum->gauss_markov_rms_m, 1.0, 1e-9);
  if (instance.optimum->prior_rms_m) {
    EXPECT_NEAR(result.prior_rms_m / *instance.optimum->prior_rms_m, 1.0, 1e-8);
  }
  EXPECT_GE(result.prior_rms_m, result.guaranteed_rms_m * (1 - 1e-8));
  EXPECT_EQ(result.lambda_m2.size(), static_cast<Eigen::Index>(instance.scenario.segments()) + 2);
  EXPECT_GE(result.guaranteed_rms_at_m.size(), 200U);
  for (const double rms : result.guaranteed_rms_at_m) {
    EXPECT_TRUE(std::isfinite(rms));
  }
}

INSTANTIATE_TEST_SUITE_P(Estimate, Zoo, testing::ValuesIn(zoo::all_instances()), [](const auto& tested) {
  return std::string(tested.param.name) + "_" + std::to_string(tested.param.scenario.segments());
});

}  // namespace
