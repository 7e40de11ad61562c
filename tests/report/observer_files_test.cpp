// SPDX-License-Identifier: Apache-2.0
#include "report/observer_files.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "browser.hpp"

namespace {

using namespace trammel;

io::ObserverInput paper_input() {
  io::ObserverInput input;
  input.title = "approach </script> & \"weave\"";
  input.problem.position_m << -10000, 50, -100;
  input.problem.covariance_m2 = Eigen::Vector3d(640000, 400, 400).asDiagonal();
  input.problem.speed_mps = 100;
  input.problem.time_to_go_s = 80;
  input.problem.sigma0 = 0.002;
  input.problem.measurement_interval_s = 0.2;
  input.problem.beta_per_s << 10, 0, 0;
  return input;
}

TEST(ObserverFiles, PlanHasTheFieldsPromised) {
  const io::ObserverInput input = paper_input();
  const observer::LimitedPlan plan{observer::make_plan(input.problem), input.problem.beta_per_s};
  const io::Json json = io::Json::parse(report::plan_json(input, plan).dump());
  EXPECT_NEAR(json.at("xi").get<double>(), 5.9085152083511, 1e-9);
  EXPECT_NEAR(json.at("xi1").get<double>(), 6.280045287116, 1e-9);
  EXPECT_NEAR(json.at("epsilon").get<double>(), 14771.288020878, 1e-5);
  EXPECT_NEAR(json.at("B1").get<double>(), -0.00251963425269, 1e-12);
  EXPECT_NEAR(json.at("B2").get<double>(), 0.00503926850537, 1e-12);
  EXPECT_EQ(json.at("D").size(), 3U);
  EXPECT_NEAR(json.at("gamma_T")[0][0].get<double>(), 417.7951170568924, 1e-6);
  EXPECT_NEAR(json.at("J_gamma").get<double>() + json.at("J_control").get<double>(),
              json.at("J").get<double>(), 1e-9);
  EXPECT_LE(json.at("lower_bound").get<double>(), json.at("J").get<double>());
  EXPECT_NEAR(json.at("max_speed_mps").get<double>(), 21.774556198629, 1e-7);
  EXPECT_EQ(json.at("status"), "optimal");
  const std::string csv = report::plan_csv(input, plan.plan);
  EXPECT_EQ(csv.substr(0, csv.find('\n')), "t_s,x_m,y_m,z_m,u1_mps,u2_mps");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 402);
  EXPECT_NE(report::plan_summary(input, plan).find("optimal"), std::string::npos);
}

class SimulatedFlights : public testing::Test {
 protected:
  SimulatedFlights() {
    settings_.runs = 150;
    result_ = observer::simulate(loop_, settings_);
  }
  io::ObserverInput input_ = paper_input();
  observer::FlightLoop loop_{input_.problem, input_.flight};
  observer::MonteCarloSettings settings_;
  observer::MonteCarloResult result_;
};

TEST_F(SimulatedFlights, HaveTheFieldsPromised) {
  const report::SimulationReport report{input_, loop_, settings_, result_};
  const io::Json json = io::Json::parse(report::simulation_json(report).dump());
  for (const char* name : {"mean_error_m", "sd_error_m", "miss_mean_m", "miss_sd_m", "effort_mean_m",
                           "effort_sd_m", "median_nees"}) {
    EXPECT_TRUE(std::isfinite(json.at(name).get<double>())) << name;
  }
  EXPECT_EQ(json.at("runs"), 150);
  const std::string csv = report::runs_csv(result_);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 151);
}

TEST_F(SimulatedFlights, ThePageDrawsEveryPlot) {
#ifndef TRAMMEL_CHROMIUM
  GTEST_SKIP() << "no chromium on this machine";
#else
  const test::PageCheck page = test::open_page(report::simulation_html({input_, loop_, settings_, result_}));
  EXPECT_TRUE(page.errors.empty()) << page.errors;
  for (const char* plot : {"spread", "hist-error", "hist-miss", "hist-effort", "hist-nees"}) {
    ASSERT_TRUE(page.drawn.contains(plot)) << plot;
    EXPECT_GT(page.drawn.at(plot).get<int>(), 500) << plot;
  }
  for (const char* curve : {"plan-xy0", "plan-xz0", "plan-yz11"}) {
    ASSERT_TRUE(page.drawn.contains(curve)) << curve << page.drawn;
    EXPECT_GT(page.drawn.at(curve).get<int>(), 50) << curve;
  }
#endif
}

}  // namespace
