// SPDX-License-Identifier: Apache-2.0
#include "trammel/observer/plan.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "cases.hpp"
#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/observer/single_weight.hpp"

namespace {

using trammel::observer::ChannelProblem;
using trammel::observer::Frequency;
using trammel::observer::make_plan;
using trammel::observer::Plan;
using trammel::observer::PlanProblem;
using trammel::observer::PlanStatus;
using trammel::test::kPaperCovariance;
using trammel::test::kReferencePlans;
using trammel::test::paper_problem;
using trammel::test::ReferencePlan;

constexpr double kTolerance = 1e-9;

void expect_near(double value, double reference, double scale, const char* what) {
  EXPECT_NEAR(value, reference, kTolerance * scale) << what;
}

class Reference : public testing::TestWithParam<ReferencePlan> {};

TEST_P(Reference, IsReproduced) {
  const ReferencePlan& r = GetParam();
  const Plan plan = make_plan(trammel::test::problem_of(r));
  expect_near(plan.xi_critical, r.xi_critical, r.xi_critical, "xi_1");
  expect_near(plan.xi, r.xi, r.xi, "xi");
  expect_near(plan.epsilon_m, r.epsilon, r.epsilon, "epsilon");
  expect_near(plan.cost_information, r.cost_information, r.cost_information, "J_Gamma");
  expect_near(plan.cost_control, r.cost_control, r.cost_control, "J_R");
  // The reference is the largest of many samples.
  EXPECT_NEAR(plan.max_speed_mps(), r.max_speed, 1e-7 * r.max_speed);
  EXPECT_GE(plan.max_speed_mps(), r.max_speed * (1.0 - 1e-12));
  const double centre = std::hypot(r.centre[0], r.centre[1]);
  // An exactly symmetric start has mirror optima: only the size of B is unique.
  EXPECT_NEAR(plan.wave_centre.norm(), centre, kTolerance * centre);
  const bool symmetric = r.position[1] == 0.0 && r.position[2] == 0.0;
  const double sign = symmetric && plan.wave_centre.x() * r.centre[0] < 0.0 ? -1.0 : 1.0;
  for (int i = 0; i < 2; ++i) {
    const auto k = static_cast<std::size_t>(i);
    expect_near(sign * plan.wave_centre[i], r.centre[k], centre, "B");
    const double reach = std::hypot(r.position_half_way[0], r.position_half_way[1]);
    expect_near(sign * plan.position(0.5 * r.time_to_go)[i + 1], r.position_half_way[k], reach, "y, z");
    expect_near(sign * plan.control(0.75 * r.time_to_go)[i], r.control_three_quarters[k], r.max_speed, "u");
  }
  const Eigen::Matrix3d information = trammel::test::symmetric(r.information);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double flip = (i == 0) != (j == 0) ? sign : 1.0;
      expect_near(flip * plan.information(i, j), information(i, j),
                  std::sqrt(information(i, i) * information(j, j)), "D");
    }
  }
  EXPECT_LT((plan.information * plan.final_covariance_m2 - Eigen::Matrix3d::Identity()).norm(), 1e-8);
  EXPECT_LE(plan.lower_bound, plan.cost);
  if (std::string_view(r.name) == "G7gap") {
    EXPECT_EQ(plan.status, PlanStatus::kBestFound);
    EXPECT_NEAR(plan.lower_bound, 104962.02957, 1e-9 * plan.cost);
  } else {
    EXPECT_EQ(plan.status, PlanStatus::kOptimal);
    EXPECT_LT(plan.relative_gap(), 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(Paper, Reference, testing::ValuesIn(kReferencePlans), [](const auto& param_info) {
  std::string name(param_info.param.name);
  std::erase(name, '.');
  return name;
});

// Published to 12 digits only (xi, cost).
TEST(Plan, GeneralWeightsWithCorrelatedPrior) {
  const Plan third =
      make_plan(paper_problem({-7000, 120, 60}, {90000, -1800, 1800, 144, 18, 225}, 50, {10, 1e5, 1e4}));
  EXPECT_NEAR(third.xi, 5.61020942282, 1e-9);
  EXPECT_NEAR(third.cost, 32946.2878009, 1e-6);
  EXPECT_EQ(third.status, PlanStatus::kOptimal);
  const Plan fifth =
      make_plan(paper_problem({-3000, 5, -8}, {3600, -90, 60, 9, -1.2, 4}, 10, {0.1, 100, 30}));
  EXPECT_NEAR(fifth.xi, 1.33423623672, 1e-9);
  EXPECT_NEAR(fifth.cost, 295.318025348, 1e-7);
  EXPECT_EQ(fifth.status, PlanStatus::kOptimal);
}

TEST(Plan, SecularFunctionOfThePaper) {
  const ChannelProblem problem(paper_problem({-10000, 50, -100}, kPaperCovariance, 80, {0, 0, 0}));
  const std::vector<std::array<double, 2>> table{{1e-8, 5.372391929035482e-05},
                                                 {1e-3, 5.3723921026472503e-05},
                                                 {0.5, 5.416185650292178e-05},
                                                 {2.0, 6.181173304560898e-05},
                                                 {std::numbers::pi, 7.976567319142773e-05},
                                                 {5.0, 0.0002615972621417123},
                                                 {6.2, 0.045793673803651534}};
  for (const auto& [xi, f2] : table) {
    EXPECT_NEAR(trammel::observer::detail::secular(problem, Frequency(xi)).value / xi, f2, 1e-12 * f2) << xi;
  }
}

TEST(Plan, WithoutWeightsTheFlightIsStraight) {
  const Plan plan = make_plan(paper_problem({-10000, 50, -100}, kPaperCovariance, 80, {0, 0, 0}));
  EXPECT_EQ(plan.xi, 0.0);
  EXPECT_EQ(plan.status, PlanStatus::kOptimal);
  EXPECT_NEAR(plan.cost, 12500.0 / 80.0, 1e-10);
  EXPECT_NEAR(plan.control(13.0).x(), -50.0 / 80.0, 1e-12);
  EXPECT_NEAR(plan.position(40.0).z(), -50.0, 1e-10);
}

TEST(Plan, WithoutMeasurementsTheCovarianceStays) {
  PlanProblem problem = paper_problem({-7000, 120, 60}, {90000, -1800, 1800, 144, 18, 225}, 50, {10, 0, 0});
  problem.measurement_interval_s = 51.0;
  for (const double lateral_weight : {0.0, 5.0}) {
    problem.beta_per_s.y() = lateral_weight;
    const Plan plan = make_plan(problem);
    EXPECT_EQ(plan.information_gain, 0.0);
    EXPECT_LT((plan.final_covariance_m2 - problem.covariance_m2).norm(), 1e-9 * 90000);
    EXPECT_NEAR(plan.cost_control, (120.0 * 120 + 60 * 60) / 50, 1e-9);
    EXPECT_EQ(plan.status, PlanStatus::kOptimal);
    EXPECT_TRUE(std::isfinite(plan.lower_bound));
  }
}

TEST(Plan, MovingBeaconKeepsTheOptimum) {
  const PlanProblem still = paper_problem({-10000, 50, -100}, kPaperCovariance, 80, {10, 0, 0});
  PlanProblem moving = still;
  moving.speed_mps = 130.0;
  moving.beacon_velocity_mps << 30.0, -4.0, 2.5;
  const Plan a = make_plan(still);
  const Plan b = make_plan(moving);
  EXPECT_NEAR(a.xi, b.xi, 1e-12);
  EXPECT_NEAR(a.cost_information, b.cost_information, 1e-9);
  // The own control energy by quadrature of the own control.
  const int steps = 20000;
  double energy = 0.0;
  for (int i = 0; i < steps; ++i) {
    energy += b.control((i + 0.5) * 80.0 / steps).squaredNorm() * 80.0 / steps;
  }
  EXPECT_NEAR(energy, b.cost_control, 1e-6 * energy);
  EXPECT_EQ(b.status, PlanStatus::kOptimal);
}

TEST(Plan, RejectsWhatItCannotSolve) {
  const PlanProblem good = paper_problem({-10000, 50, -100}, kPaperCovariance, 80, {1, 0, 0});
  const auto rejects = [&](auto&& spoil, const char* where) {
    PlanProblem bad = good;
    spoil(bad);
    try {
      (void)make_plan(bad);
      ADD_FAILURE() << "accepted: " << where;
    } catch (const trammel::Error& error) {
      EXPECT_EQ(error.detail().where, where);
      EXPECT_FALSE(error.detail().expected.empty());
    }
  };
  const double nan = std::nan("");
  rejects([](PlanProblem& p) { p.position_m.x() = 0.0; }, "position_m");
  rejects([](PlanProblem& p) { p.position_m.x() = 3.0; }, "position_m");
  rejects([&](PlanProblem& p) { p.position_m.y() = nan; }, "position_m");
  rejects([](PlanProblem& p) { p.time_to_go_s = 100.0; }, "time_to_go_s");
  rejects([](PlanProblem& p) { p.time_to_go_s = 101.0; }, "time_to_go_s");
  rejects([](PlanProblem& p) { p.time_to_go_s = 0.0; }, "time_to_go_s");
  rejects([](PlanProblem& p) { p.speed_mps = -100.0; }, "speed_mps");
  rejects([](PlanProblem& p) { p.sigma0 = 0.0; }, "sigma0");
  rejects([](PlanProblem& p) { p.measurement_interval_s = -0.2; }, "measurement_interval_s");
  rejects([](PlanProblem& p) { p.beta_per_s.y() = -1.0; }, "beta_per_s");
  rejects([&](PlanProblem& p) { p.beta_per_s.x() = nan; }, "beta_per_s");
  rejects([](PlanProblem& p) { p.covariance_m2(1, 1) = 0.0; }, "covariance_m2");
  rejects([](PlanProblem& p) { p.covariance_m2(0, 0) = -1.0; }, "covariance_m2");
  rejects([](PlanProblem& p) { p.covariance_m2(0, 1) = 5.0; }, "covariance_m2");
  rejects([](PlanProblem& p) { p.covariance_m2(1, 2) = p.covariance_m2(2, 1) = 400.0; }, "covariance_m2");
  rejects([](PlanProblem& p) { p.beacon_velocity_mps.x() = 100.0; }, "beacon_velocity_mps");
}

}  // namespace
