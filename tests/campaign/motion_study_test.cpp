// SPDX-License-Identifier: Apache-2.0
// Random runs of one estimator and their summary.
#include <cmath>

#include <gtest/gtest.h>

#include "trammel/campaign/motion_study.hpp"
#include "trammel/core/error.hpp"
#include "trammel/core/parallel.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

using namespace trammel;
using campaign::MotionStudy;
using campaign::RandomMotion;

/// Small bounds and precise stations: the sensors are as good as linear.
Scenario small_deviations() {
  Scenario scenario = zoo::manoeuvre().scenario;
  constexpr double kSmall = 1e-5;
  scenario.bounds.position_m *= kSmall;
  scenario.bounds.velocity_mps *= kSmall;
  for (Eigen::Vector3d& axes : scenario.bounds.acceleration_mps2) {
    axes *= kSmall;
  }
  for (Station& station : scenario.stations) {
    station.covariance *= kSmall * kSmall;
  }
  return scenario;
}

std::vector<double> errors(const MotionStudy& study, std::uint64_t seed, int runs, bool linear) {
  std::vector<double> values;
  for (int run = 0; run < runs; ++run) {
    const campaign::RunErrors result = study.run(seed, static_cast<std::uint64_t>(run));
    values.push_back(linear ? result.linear_m : result.nonlinear_m);
  }
  return values;
}

TEST(MotionStudy, TheGuaranteeHoldsAndSmallMotionsAreLinear) {
  const Scenario scenario = small_deviations();
  const minimax::Solution solution = minimax::solve(assemble(scenario).problem);
  const double guaranteed = std::sqrt(solution.upper);
  constexpr int kRuns = 600;
  const MotionStudy hard(scenario, solution.gain, RandomMotion::kOnBoundary);
  const auto linear = campaign::summarise(errors(hard, 11, kRuns, true), guaranteed);
  const auto nonlinear = campaign::summarise(errors(hard, 11, kRuns, false), guaranteed);
  EXPECT_FALSE(linear.contradicts()) << linear.ratio;
  EXPECT_GT(linear.ratio, 0.7);  // the surface of every bound is nearly the worst case here
  EXPECT_NEAR(nonlinear.ratio, linear.ratio, linear.ratio_high - linear.ratio_low);
  const MotionStudy easy(scenario, solution.gain, RandomMotion::kWithin);
  const auto within = campaign::summarise(errors(easy, 11, kRuns, true), guaranteed);
  EXPECT_LT(within.ratio, linear.ratio);
  // A guarantee that is half the true one is found out.
  EXPECT_TRUE(campaign::summarise(errors(hard, 11, kRuns, true), guaranteed / 2).contradicts());
}

TEST(MotionStudy, ARunDependsOnSeedAndNumberOnly) {
  const Scenario scenario = small_deviations();
  const minimax::Solution solution = minimax::solve(assemble(scenario).problem);
  const MotionStudy study(scenario, solution.gain, RandomMotion::kWithin);
  const MotionStudy again(scenario, solution.gain, RandomMotion::kWithin);
  const campaign::RunErrors seventh = study.run(5, 7);
  (void)again.run(5, 2);
  EXPECT_EQ(again.run(5, 7).linear_m, seventh.linear_m);
  EXPECT_EQ(again.run(5, 7).nonlinear_m, seventh.nonlinear_m);
  EXPECT_NE(study.run(5, 8).linear_m, seventh.linear_m);
  EXPECT_NE(study.run(6, 7).linear_m, seventh.linear_m);
  std::vector<double> threaded(40);
  for_each_in_parallel(
      threaded.size(), 3, [&](std::size_t i) { threaded[i] = study.run(5, i).nonlinear_m; },
      [](std::size_t /*done*/) {});
  EXPECT_EQ(threaded, errors(study, 5, 40, false));
}

TEST(MotionStudy, RefusesAGainOfAnotherShape) {
  EXPECT_THROW(MotionStudy(small_deviations(), Eigen::MatrixXd::Zero(3, 3), RandomMotion::kWithin), Error);
}

TEST(StudySummary, ByHand) {
  const campaign::StudySummary summary = campaign::summarise({1.0, 2.0, 3.0}, 2.0);
  EXPECT_EQ(summary.runs, 3U);
  EXPECT_DOUBLE_EQ(summary.mean_square_m2, 14.0 / 3.0);
  // Squares 1, 4, 9: variance ((11/3)^2 + (2/3)^2 + (13/3)^2) / 2 = 49/3, over three runs.
  EXPECT_NEAR(summary.standard_error_m2, std::sqrt(49.0 / 9.0), 1e-14);
  EXPECT_DOUBLE_EQ(summary.largest_rms_m, 3.0);
  EXPECT_DOUBLE_EQ(summary.ratio, 14.0 / 12.0);
  EXPECT_NEAR(summary.ratio_high - summary.ratio, 2.575829 * 7.0 / 12.0, 1e-6);
  EXPECT_FALSE(summary.contradicts());
  EXPECT_TRUE(std::isnan(campaign::summarise({1.0}, 2.0).ratio_low));
  EXPECT_FALSE(campaign::summarise({9.0}, 2.0).contradicts());
  EXPECT_THROW((void)campaign::summarise({}, 1.0), Error);
}

TEST(Parallel, DoesEveryPieceOnceAndHandsOnFailures) {
  for (const unsigned threads : {1U, 2U, 7U}) {
    std::vector<std::atomic<int>> count(100);
    std::size_t last = 0;
    for_each_in_parallel(
        count.size(), threads, [&](std::size_t i) { ++count[i]; },
        [&](std::size_t done) {
          EXPECT_GT(done, last);
          last = done;
        });
    for (const auto& times : count) {
      EXPECT_EQ(times, 1);
    }
    EXPECT_THROW(for_each_in_parallel(
                     50, threads, [](std::size_t i) { require(i != 20, "piece", "bad", "good"); },
                     [](std::size_t /*done*/) {}),
                 Error);
  }
}

}  // namespace
