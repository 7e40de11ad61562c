// SPDX-License-Identifier: Apache-2.0
// Every rule a scenario can break is refused with a message that names the place.
#include <functional>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trammel/problem/assemble.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

using namespace trammel;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const double kNan = std::nan("");

struct Broken {
  std::string name;
  std::function<void(Scenario&)> breaks;
  std::string where;  ///< part of the message
};

class ScenarioErrors : public testing::TestWithParam<Broken> {};

Scenario good() {
  Scenario scenario = zoo::manoeuvre().scenario;
  scenario.observations.push_back(
      {.t_s = 3.0, .station = 0, .value = Eigen::Vector3d(0.2, 0.2, 6000.0), .covariance = std::nullopt});
  return scenario;
}

TEST_P(ScenarioErrors, AreNamed) {
  Scenario scenario = good();
  EXPECT_NO_THROW(check(scenario));
  GetParam().breaks(scenario);
  try {
    (void)assemble(scenario);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(GetParam().where));
    EXPECT_THAT(error.what(), testing::HasSubstr("expected"));
  }
}

using S = Scenario&;
const std::vector<Broken> kBroken{
    {"one_knot", [](S s) { s.knots_s = {0.0}; }, "knots_s"},
    {"equal_knots", [](S s) { s.knots_s[3] = s.knots_s[2]; }, "knots_s[3]"},
    {"nan_knot", [](S s) { s.knots_s[1] = kNan; }, "knots_s[1]"},
    {"bounds_per_segment", [](S s) { s.bounds.acceleration_mps2.pop_back(); }, "bounds.acceleration_mps2"},
    {"negative_bound", [](S s) { s.bounds.position_m.y() = -1.0; }, "bounds.position_m"},
    {"nan_bound", [](S s) { s.bounds.acceleration_mps2[4].z() = kNan; }, "bounds.acceleration_mps2[4]"},
    {"all_removed",
     [](S s) {
       s.bounds.position_m.setZero();
       s.bounds.velocity_mps.setZero();
       s.bounds.acceleration_mps2.assign(7, Eigen::Vector3d::Zero());
     },
     "bounds"},
    {"criterion_time",
     [](S s) {
       s.criterion = {.kind = CriterionKind::kTimes, .times_s = {5.0, 71.0}};
     },
     "criterion.times_s[1]"},
    {"criterion_no_times", [](S s) { s.criterion.kind = CriterionKind::kTimes; }, "criterion.times_s"},
    {"criterion_window",
     [](S s) {
       s.criterion.kind = CriterionKind::kWindow;
       s.criterion.window_s = {30.0, 20.0};
     },
     "criterion.window_s"},
    {"criterion_window_outside",
     [](S s) {
       s.criterion.kind = CriterionKind::kWindow;
       s.criterion.window_s = {30.0, 90.0};
     },
     "criterion.window_s[1]"},
    {"station_position", [](S s) { s.stations[0].position_m.x() = kInfinity; },
     "station 'station1' position_m"},
    {"track_counts",
     [](S s) {
       s.stations[0].track = {.times_s = {0.0, 70.0}, .positions_m = {{1, 2, 3}}};
     },
     "station 'station1' track samples"},
    {"track_order",
     [](S s) {
       s.stations[0].track = {.times_s = {0.0, 0.0}, .positions_m = {{1, 2, 3}, {4, 5, 6}}};
     },
     "station 'station1' track sample 2"},
    {"track_too_short",
     [](S s) {
       s.stations[0].track = {.times_s = {4.0, 70.0}, .positions_m = {{1, 2, 3}, {4, 5, 6}}};
     },
     "observation 0 at 3"},
    {"bias_shape", [](S s) { s.stations[0].bias.components = Eigen::VectorXd::Ones(2); }, "bias"},
    {"bias_negative", [](S s) { s.stations[0].bias.time_s = -0.1; }, "bias"},
    {"bias_nan",
     [](S s) {
       s.stations[0].bias.components = Eigen::VectorXd{{0.0, kNan, 0.0}};
     },
     "bias"},
    {"covariance_shape", [](S s) { s.stations[0].covariance = Eigen::Matrix2d::Identity(); }, "covariance"},
    {"covariance_nan", [](S s) { s.stations[0].covariance(1, 1) = kNan; }, "covariance"},
    {"covariance_asymmetric", [](S s) { s.stations[0].covariance(0, 1) *= 1.01; }, "covariance"},
    {"covariance_negative", [](S s) { s.stations[0].covariance(2, 2) = -1.0; }, "covariance"},
    {"covariance_indefinite",
     [](S s) {
       s.stations[0].covariance = Eigen::Matrix3d::Identity();
       s.stations[0].covariance(0, 1) = s.stations[0].covariance(1, 0) = 1.5;
     },
     "covariance"},
    {"own_covariance", [](S s) { s.observations[0].covariance = Eigen::Matrix3d::Zero(); }, "observation 0"},
    {"time_outside", [](S s) { s.observations[0].t_s = 70.5; }, "observation 0 at 70.5"},
    {"time_nan", [](S s) { s.observations[0].t_s = kNan; }, "observation 0"},
    {"planned_time_outside",
     [](S s) {
       s.observations.clear();
       s.stations[0].times_s[2] = -1.0;
     },
     "planned measurement 2"},
    {"unknown_station", [](S s) { s.observations[0].station = 1; }, "observation 0"},
    {"value_shape", [](S s) { s.observations[0].value = Eigen::Vector2d::Zero(); }, "observation 0"},
    {"value_infinite", [](S s) { s.observations[0].value(1) = kInfinity; }, "observation 0"},
    {"at_the_station",
     [](S s) {
       s.stations[0].position_m = {1636.0, 1636.0, 5000.0};
     },
     "at the station"},
    {"nominal_nan", [](S s) { s.nominal.position_m.x() = kNan; }, "nominal"},
    {"nominal_too_short",
     [](S s) {
       s.nominal.sample_times_s = {0.0, 69.0};
       s.nominal.sample_positions_m = {{1, 2, 3}, {4, 5, 6}};
     },
     "nominal samples"},
    {"nominal_counts",
     [](S s) {
       s.nominal.sample_times_s = {0.0, 70.0};
       s.nominal.sample_positions_m = {{1, 2, 3}};
     },
     "nominal samples"},
};

INSTANTIATE_TEST_SUITE_P(Problem, ScenarioErrors, testing::ValuesIn(kBroken),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
