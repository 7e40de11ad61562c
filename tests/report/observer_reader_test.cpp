// SPDX-License-Identifier: Apache-2.0
#include "io/observer_reader.hpp"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "io/temporary_folder.hpp"
#include "trammel/core/error.hpp"

namespace {

using namespace trammel;

constexpr const char* kPlan = R"(
title = "approach"
position_m = [-10000, 50, -100]
covariance_m2 = [[640000, 0, 0], [0, 400, 0], [0, 0, 400]]
speed_mps = 100
time_to_go_s = 80
sigma0 = 0.002
measurement_interval_s = 0.2
beta_per_s = [10, 0, 0]
)";

/// kPlan with one line replaced, or a line added.
std::string changed(const std::string& key, const std::string& line) {
  std::string text = kPlan;
  const auto at = text.find("\n" + key + " ");
  if (at == std::string::npos) {
    return text + line + "\n";
  }
  const auto end = text.find('\n', at + 1);
  return text.substr(0, at + 1) + line + text.substr(end);
}

io::ObserverInput read(const std::string& text, io::ObserverUse use = io::ObserverUse::kPlan,
                       const std::string& name = "plan.toml") {
  const test::TemporaryFolder folder;
  return io::read_observer(folder.write(name, text), use);
}

void expect_rejected(const std::string& text, const std::string& where, const std::string& expected,
                     io::ObserverUse use = io::ObserverUse::kPlan) {
  try {
    (void)read(text, use);
    ADD_FAILURE() << "accepted: " << text;
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("plan.toml"), std::string::npos) << error.what();
    EXPECT_NE((error.detail().where + error.detail().found).find(where), std::string::npos) << error.what();
    EXPECT_NE(error.detail().expected.find(expected), std::string::npos) << error.what();
  }
}

TEST(ObserverReader, ReadsWhatIsThereAndFillsDefaults) {
  const io::ObserverInput input = read(kPlan);
  EXPECT_EQ(input.title, "approach");
  EXPECT_EQ(input.problem.position_m, Eigen::Vector3d(-10000, 50, -100));
  EXPECT_EQ(input.problem.terminal_m, Eigen::Vector2d(0, 0));
  EXPECT_EQ(input.problem.beacon_velocity_mps.norm(), 0.0);
  EXPECT_EQ(input.flight.replan_interval_s, 1.0);
  EXPECT_TRUE(std::isinf(input.max_start_x_m));
}

TEST(ObserverReader, JsonIsTheSameTree) {
  const io::ObserverInput input = read(
      R"({"position_m": [-7000, 120, 60], "covariance_m2": [[90000, -1800, 1800], [-1800, 144, 18], [1800, 18, 225]],
          "speed_mps": 100.0, "time_to_go_s": 50, "sigma0": 2e-3, "measurement_interval_s": 0.2,
          "beta_per_s": [0.1, 2, 3], "terminal_m": [30, -60], "replan_interval_s": "inf", "max_start_x_m": -8000,
          "filter": "range_grid", "measured": "tangents", "beacon_velocity_mps": [1, 2, 3], "gate_m": 10,
          "min_final_distance_m": 20, "max_lateral_speed_mps": 30})",
      io::ObserverUse::kSimulate, "plan.json");
  EXPECT_EQ(input.problem.covariance_m2(1, 2), 18.0);
  EXPECT_EQ(input.problem.terminal_m, Eigen::Vector2d(30, -60));
  EXPECT_TRUE(std::isinf(input.flight.replan_interval_s));
  EXPECT_EQ(input.flight.filter, observer::FilterKind::kRangeGrid);
  EXPECT_EQ(input.max_start_x_m, -8000.0);
  EXPECT_EQ(input.flight.gate_m, 10.0);
}

TEST(ObserverReader, SaysWhatIsWrongAndWhere) {
  expect_rejected(changed("position_m", "position_m = [10, 50, -100]"), "position_m", "x < 0");
  expect_rejected(changed("position_m", "position_m = [0, 50, -100]"), ":3: position_m", "x < 0");
  expect_rejected(changed("position_m", "position_m = [-10000, 50]"), "position_m", "3");
  expect_rejected(changed("position_m", "position_m = [-10000, nan, 0]"), "position_m", "a number");
  expect_rejected(changed("position_m", "position_m = [-inf, 1, 0]"), "position_m", "finite");
  expect_rejected(changed("time_to_go_s", "time_to_go_s = 100"), "time_to_go_s", "x + V * time_to_go_s < 0");
  expect_rejected(changed("time_to_go_s", "time_to_go_s = -1"), "time_to_go_s", "positive");
  expect_rejected(changed("covariance_m2", "covariance_m2 = [[1, 0], [0, 1]]"), "covariance_m2", "3 rows");
  expect_rejected(changed("covariance_m2", "covariance_m2 = [[1, 0, 0], [0, 1]]"), "covariance_m2", "");
  expect_rejected(changed("covariance_m2", "covariance_m2 = [[1, 2, 0], [2, 1, 0], [0, 0, 1]]"),
                  "covariance_m2", "positive definite");
  expect_rejected(changed("covariance_m2", "covariance_m2 = [[4, 1, 0], [0, 4, 0], [0, 0, 4]]"),
                  "covariance_m2", "symmetric");
  expect_rejected(changed("sigma0", "sigma0 = 0"), "sigma0", "positive");
  expect_rejected(changed("sigma0", "sigma0 = \"small\""), "sigma0", "number");
  expect_rejected(changed("beta_per_s", "beta_per_s = [1, -1, 0]"), "beta_per_s", ">= 0");
  expect_rejected(changed("beta_per_s", ""), "beta_per_s", "");
  expect_rejected(changed("sigma", "sigma = 1"), "sigma", "");
  expect_rejected(changed("filter", "filter = \"magic\""), "filter", "range_grid");
  expect_rejected("", "position_m", "");
  expect_rejected(changed("replan_interval_s", "replan_interval_s = 0"), "replan_interval_s", "positive",
                  io::ObserverUse::kSimulate);
  expect_rejected(changed("gate_m", "gate_m = -3"), "gate_m", ">= 0", io::ObserverUse::kSimulate);
  expect_rejected(changed("target_sigma_x_m", "target_sigma_x_m = 3"), "target_sigma_x_m", "beta_per_s",
                  io::ObserverUse::kSimulate);
  expect_rejected(changed("energy_budget_m2ps", "target_sigma_x_m = 3\nenergy_budget_m2ps = 5"), "plan.toml",
                  "at most one");
  expect_rejected(changed("measurement_interval_s", "measurement_interval_s = 1e-6"),
                  "measurement_interval_s", "million", io::ObserverUse::kSimulate);
}

constexpr const char* kScenario = R"(
title = "flight"
[model]
knots_s = {start = 0, stop = 60, step = 10}
[nominal]
position_m = [0, 0, 1000]
velocity_mps = [50, 0, 0]
[bounds]
position_m = 1000
velocity_mps = 100
acceleration_mps2 = 2
[[station]]
name = "radar"
kind = "azimuth_elevation_range"
position_m = [-3000, -3000, 0]
covariance = [[1e-6, 0, 0], [0, 1e-6, 0], [0, 0, 100]]
times_s = {start = 0, stop = 60, step = 5}
)";

io::CompareInput read_comparison(const std::string& text,
                                 const std::string& path = "t_s,x_m,y_m,z_m\n0,0,0,0\n60,9,9,9\n") {
  const test::TemporaryFolder folder;
  (void)folder.write("flight.toml", kScenario);
  (void)folder.write("path.csv", path);
  return io::read_comparison(folder.write("compare.toml", text));
}

TEST(ComparisonReader, SitesAndPaths) {
  const io::CompareInput input =
      read_comparison(R"(
scenario = "flight.toml"
[[candidate]]
name = "near"
station = "radar"
position_m = [500, -500, 0]
[[candidate]]
name = "carried"
station = "radar"
path = "path.csv"
)",
                      // the columns of a path that observer plan wrote
                      "t_s,x_m,y_m,z_m,u1_mps,u2_mps\n0,0,0,0,1,1\n60,9,9,9,1,1\n");
  ASSERT_EQ(input.candidates.size(), 2U);
  EXPECT_EQ(input.candidates[0].scenario.stations[0].position_m, Eigen::Vector3d(500, -500, 0));
  ASSERT_EQ(input.candidates[1].scenario.stations.size(), 1U);
  EXPECT_EQ(input.candidates[1].scenario.stations[0].track.times_s, (std::vector<double>{0.0, 60.0}));
  EXPECT_EQ(input.candidates[1].scenario.stations[0].track.positions_m[1], Eigen::Vector3d(9, 9, 9));
  EXPECT_EQ(input.candidates[1].scenario.stations[0].times_s.size(), 13U);
  EXPECT_EQ(input.base.inputs.size(), 3U);
}

TEST(ComparisonReader, SaysWhatIsWrong) {
  const auto rejects = [](const std::string& text, const std::string& part,
                          const std::string& path = "t_s,x_m\n") {
    try {
      (void)read_comparison(text, path);
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  const std::string head = "scenario = \"flight.toml\"\n[[candidate]]\nname = \"a\"\n";
  rejects("scenario = \"flight.toml\"\n", "candidate");
  rejects("scenario = \"nowhere.toml\"\n", "nowhere.toml");
  rejects(head + "station = \"lidar\"\nposition_m = [0, 0, 0]\n", "radar");
  rejects(head + "station = \"radar\"\n", "neither");
  rejects(head + "station = \"radar\"\nposition_m = [0, 0, 0]\npath = \"path.csv\"\n", "both");
  rejects(head + "station = \"radar\"\nposition_m = [0, 0]\n", "position_m");
  rejects(head + "station = \"radar\"\npath = \"path.csv\"\n", "path.csv");
  rejects(head + "station = \"radar\"\npath = \"path.csv\"\n", "path.csv",
          "t_s,x_m,y_m,z_m\n0,0,0,0\n30,9,9,9\n");
  rejects(head + "station = \"radar\"\nposition_m = [0, 0, 0]\nheight = 3\n", "height");
  const std::string once = "station = \"radar\"\nposition_m = [0, 0, 0]\n";
  rejects(head + once + "[[candidate]]\nname = \"a\"\n" + once, "a second time");
}

TEST(Comparison, TheBestSiteIsFoundAndProved) {
  const io::CompareInput input = read_comparison(R"(
scenario = "flight.toml"
[[candidate]]
name = "far"
station = "radar"
position_m = [-40000, -30000, 0]
[[candidate]]
name = "near"
station = "radar"
position_m = [1500, -800, 0]
[[candidate]]
name = "standing carried"
station = "radar"
path = "path.csv"
)",
                                                 "t_s,x_m,y_m,z_m\n0,-40000,-30000,0\n60,-40000,-30000,0\n");
  const observer::Comparison comparison = observer::compare(input.candidates, input.base.settings.estimate);
  ASSERT_EQ(comparison.ranking.size(), 3U);
  EXPECT_EQ(comparison.ranking[0].name, "near");
  EXPECT_EQ(comparison.ranking[0].index, 1U);
  EXPECT_TRUE(comparison.decided);
  EXPECT_LE(comparison.ranking[0].lower_bound_rms_m, comparison.ranking[0].guaranteed_rms_m);
  // A station carried along a path that stands still is the same station.
  EXPECT_NEAR(comparison.ranking[1].guaranteed_rms_m, comparison.ranking[2].guaranteed_rms_m,
              1e-7 * comparison.ranking[1].guaranteed_rms_m);
  EXPECT_THROW((void)observer::compare({}), Error);
}

}  // namespace
