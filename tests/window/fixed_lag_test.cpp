// SPDX-License-Identifier: Apache-2.0
#include "trammel/window/fixed_lag.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "trammel/core/error.hpp"
#include "trammel/estimate/simulate_measurements.hpp"
#include "trammel/problem/zoo.hpp"
#include "trammel/window/flight.hpp"

namespace {

using namespace trammel;

/// Feeds a flight's measurements as they are made; every state given out, in order.
std::vector<window::LaggedState> follow(const Scenario& scenario, const window::FixedLagSettings& settings) {
  window::FixedLag filter(scenario, settings);
  std::vector<Measurement> stream = scenario.observations;
  std::stable_sort(stream.begin(), stream.end(),
                   [](const Measurement& a, const Measurement& b) { return a.t_s < b.t_s; });
  std::vector<window::LaggedState> path;
  const auto keep = [&](const std::vector<window::LaggedState>& states) {
    path.insert(path.end(), states.begin(), states.end());
  };
  for (const Measurement& m : stream) {
    keep(filter.advance(m.t_s - 0.5));
    filter.add(m);
  }
  keep(filter.finish());
  return path;
}

TEST(FixedLag, GivesEveryKnotOnceWithAGuaranteeThatHolds) {
  Scenario scenario = zoo::long_flight(30).scenario;
  const trajectory::NominalTrajectory truth = make_nominal(scenario);
  scenario.observations = estimate::simulate_measurements(scenario, truth, 11);
  const std::vector<window::LaggedState> path = follow(scenario, {.lag = 4, .memory = 8});
  ASSERT_EQ(path.size(), scenario.knots_s.size());
  const estimate::TrajectoryEstimate whole = window::estimate_flight(scenario);
  double ratio = 0.0;
  double apart = 0.0;
  for (std::size_t k = 0; k < path.size(); ++k) {
    EXPECT_EQ(path[k].t_s, scenario.knots_s[k]);
    ratio +=
        std::pow((path[k].position_m - truth.position(path[k].t_s)).norm() / path[k].guaranteed_rms_m, 2);
    const auto row = static_cast<Eigen::Index>(k);
    apart += (path[k].position_m.transpose() - whole.observed->knot_position_m.row(row)).squaredNorm();
    EXPECT_LT(path[k].guaranteed_rms_m, 3.0 * whole.guaranteed_rms_m);
  }
  EXPECT_LT(std::sqrt(ratio / static_cast<double>(path.size())), 1.2);
  EXPECT_LT(std::sqrt(apart / static_cast<double>(path.size())), 0.3 * whole.guaranteed_rms_m);
}

// In the middle of a flight: later measurements help.
TEST(FixedLag, AccuracyGrowsWithTheLag) {
  Scenario scenario = zoo::long_flight(16).scenario;
  scenario.observations = estimate::simulate_measurements(scenario, make_nominal(scenario), 12);
  const std::vector<window::LaggedState> late = follow(scenario, {.lag = 5, .memory = 6});
  const std::vector<window::LaggedState> soon = follow(scenario, {.lag = 1, .memory = 6});
  for (std::size_t k = 2; k < 10; ++k) {
    EXPECT_LT(late[k].guaranteed_rms_m, soon[k].guaranteed_rms_m);
  }
}

TEST(FixedLag, RefusesWhatItCannotUse) {
  Scenario scenario = zoo::long_flight(10).scenario;
  EXPECT_THROW(window::FixedLag(scenario, {.lag = 0}), Error);
  EXPECT_THROW(window::FixedLag(scenario, {.lag = 11}), Error);
  window::FixedLag filter(scenario, {.lag = 2, .memory = 2});
  EXPECT_TRUE(filter.advance(19.0).empty());
  EXPECT_THROW((void)filter.advance(25.0), Error);  // nothing measured
}

}  // namespace
