// SPDX-License-Identifier: Apache-2.0
// What measured data say about segment length and bounds, on motions whose accelerations are known.
#include <cmath>

#include <gtest/gtest.h>

#include "localise/reference_cases.hpp"
#include "trammel/core/random.hpp"
#include "trammel/estimate/simulate_measurements.hpp"
#include "trammel/localise/suggest.hpp"

namespace {

using namespace trammel;

/// A circle of radius 2 km at 120 m/s: acceleration 7.2 m/s^2, jerk 0.432 m/s^3.
struct Turn {
  static constexpr double kAcceleration_mps2 = 7.2;
  static constexpr double kJerk_mps3 = 0.432;
};

TEST(Suggest, FindsTheAccelerationAndTheJerkOfATurn) {
  const Scenario scenario = test::turn_by_radar();
  const localise::Suggestion suggestion =
      localise::suggest_segments(scenario, {.lengths_s = {20.0, 3.0, 5.0, 10.0}});
  ASSERT_EQ(suggestion.trials.size(), 4U);
  EXPECT_EQ(suggestion.trials[0].segments, 20U);
  EXPECT_EQ(suggestion.trials[3].segments, 3U);
  const localise::LengthTrial& best = suggestion.trials[suggestion.best];
  EXPECT_TRUE(best.fits());
  EXPECT_LE(best.segment_s, 10.0);
  EXPECT_GT(best.acceleration_mps2.x(), Turn::kAcceleration_mps2);
  EXPECT_LT(best.acceleration_mps2.x(), 2.5 * Turn::kAcceleration_mps2);
  EXPECT_LT(best.acceleration_mps2.z(), 2.5);  // there is none
  EXPECT_GT(suggestion.jerk_mps3, 0.8 * Turn::kJerk_mps3);
  EXPECT_LT(suggestion.jerk_mps3, 4 * Turn::kJerk_mps3);
  for (const localise::LengthTrial& trial : suggestion.trials) {
    EXPECT_GE(localise::Suggestion::kAsGood * trial.stated_rms_m, best.stated_rms_m) << trial.segment_s;
    EXPECT_NEAR(trial.model_error.position_m, suggestion.jerk_mps3 * std::pow(trial.segment_s, 3) / 24, 1e-9);
    EXPECT_NEAR(trial.stated_rms_m, trial.linear_rms_m + trial.curvature_rms_m + trial.model_rms_m,
                1e-9 * trial.stated_rms_m);
  }
  EXPECT_TRUE(suggestion.trials[3].dominated_by_model_error());
  EXPECT_FALSE(suggestion.trials[0].dominated_by_model_error());
  // What the data leave open grows as segments get shorter.
  EXPECT_GT(suggestion.trials[0].noise_share, suggestion.trials[2].noise_share);
}

TEST(Suggest, AStraightFlightNeedsFewSegments) {
  Scenario scenario = test::turn_by_radar();
  const trajectory::NominalTrajectory straight = trajectory::NominalTrajectory::line(
      0.0, Eigen::Vector3d(12000, 17000, 1500), Eigen::Vector3d(110, 2, 1));
  scenario.observations.clear();
  scenario.observations = estimate::simulate_measurements(scenario, straight, 8);
  const localise::Suggestion suggestion =
      localise::suggest_segments(scenario, {.lengths_s = {5.0, 10.0, 20.0}});
  const localise::LengthTrial& best = suggestion.trials[suggestion.best];
  EXPECT_GE(best.segment_s, 10.0);
  EXPECT_LT(suggestion.jerk_mps3, Turn::kJerk_mps3 / 2);
  EXPECT_LT(best.acceleration_mps2.maxCoeff(), 2.0);
}

TEST(Suggest, SaysWhereNothingFits) {
  Scenario scenario = test::turn_by_radar();
  scenario.stations[0].covariance *= 0.04;  // five times better than it is
  const localise::Suggestion suggestion = localise::suggest_segments(scenario, {.lengths_s = {10.0, 20.0}});
  for (const localise::LengthTrial& trial : suggestion.trials) {
    EXPECT_FALSE(trial.fits());
    EXPECT_GT(trial.excess(), localise::LengthTrial::kMisfit);
  }
}

TEST(Suggest, ChoosesLengthsAndRefusesNonsense) {
  const Scenario scenario = test::turn_by_radar();
  EXPECT_THROW((void)localise::suggest_segments(scenario, {.lengths_s = {-1.0}}), Error);
  EXPECT_THROW((void)localise::suggest_segments(scenario, {.lengths_s = {50.0}}), Error);
  EXPECT_THROW((void)localise::suggest_segments(scenario, {.quantile = 0.0}), Error);
  EXPECT_THROW((void)localise::suggest_segments(scenario, {.margin = -1.0}), Error);
  Scenario planned = scenario;
  planned.observations.clear();
  EXPECT_THROW((void)localise::suggest_segments(planned), Error);
}

}  // namespace
