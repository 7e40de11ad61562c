// SPDX-License-Identifier: Apache-2.0
// The result of a whole scenario by windows beside that of the dense solver.
#include "trammel/window/flight.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "trammel/core/error.hpp"
#include "trammel/estimate/simulate_measurements.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

using namespace trammel;

/// A circling flight of 40 segments with measurements drawn along the plan itself.
Scenario observed_flight() {
  Scenario scenario = zoo::long_flight(40).scenario;
  scenario.observations = estimate::simulate_measurements(scenario, make_nominal(scenario), 5);
  return scenario;
}

TEST(WindowFlight, AgreesWithTheDenseEstimate) {
  const Scenario scenario = observed_flight();
  estimate::EstimateSettings bounds_only;
  bounds_only.near_optimality.reset();
  const estimate::TrajectoryEstimate whole = estimate::estimate_trajectory(scenario, bounds_only);
  const estimate::TrajectoryEstimate windows =
      window::estimate_flight(scenario, {.windows = {.core = 10, .overlap = 14}, .relinearise = false});
  EXPECT_EQ(windows.solution.status, SolveStatus::kOptimal) << windows.certificate.remark;
  EXPECT_EQ(windows.solution.claim, Claim::kVerified);
  EXPECT_EQ(windows.solution.method, minimax::Method::kWindows);
  EXPECT_EQ(windows.parameters, whole.parameters);
  EXPECT_EQ(windows.observations, whole.observations);
  EXPECT_GE(windows.guaranteed_rms_m, whole.lower_bound_rms_m);
  EXPECT_LE(windows.lower_bound_rms_m, whole.guaranteed_rms_m);
  EXPECT_NEAR(windows.guaranteed_rms_m, whole.guaranteed_rms_m, 1e-5 * whole.guaranteed_rms_m);
  EXPECT_NEAR(windows.gauss_markov_rms_m, whole.gauss_markov_rms_m, 1e-9 * whole.gauss_markov_rms_m);
  EXPECT_NEAR(windows.prior_rms_m, whole.prior_rms_m, 1e-6 * whole.prior_rms_m);
  EXPECT_NEAR(windows.lambda_m2.sum(), whole.lambda_m2.sum(), 0.02 * whole.lambda_m2.sum());
  ASSERT_TRUE(windows.observed && whole.observed);
  EXPECT_NEAR(windows.observed->chi2, whole.observed->chi2, 1e-4 * whole.observed->chi2);
  const Eigen::MatrixXd apart = windows.observed->path.position_m - whole.observed->path.position_m;
  EXPECT_LT(apart.rowwise().norm().maxCoeff(), 0.02 * whole.guaranteed_rms_m);
  const Eigen::MatrixXd least_squares =
      windows.observed->gauss_markov_path->position_m - whole.observed->gauss_markov_path->position_m;
  EXPECT_LT(least_squares.norm(), 1e-6);
  ASSERT_EQ(windows.guaranteed_rms_at_m.size(), whole.guaranteed_rms_at_m.size());
  for (std::size_t i = 0; i < windows.guaranteed_rms_at_m.size(); ++i) {
    EXPECT_NEAR(windows.guaranteed_rms_at_m[i], whole.guaranteed_rms_at_m[i],
                1e-2 * whole.guaranteed_rms_at_m[i]);
  }
}

TEST(WindowFlight, LinearisesAboutThePathItFits) {
  Scenario scenario = observed_flight();
  for (Eigen::Vector3d& x : scenario.nominal.sample_positions_m) {
    x += Eigen::Vector3d(400.0, -300.0, 200.0);  // a plan far from the flight
  }
  scenario.bounds.position_m.setConstant(1000.0);
  const estimate::TrajectoryEstimate about_plan =
      window::estimate_flight(scenario, {.windows = {}, .relinearise = false});
  const estimate::TrajectoryEstimate about_fit = window::estimate_flight(scenario);
  EXPECT_TRUE(about_fit.observed->linearisation.converged);
  EXPECT_LT(about_fit.observed->linearisation.ratio, 0.05);
  EXPECT_GT(about_plan.observed->linearisation.ratio, 1.0);
}

// The guarantee over noise: the errors of repeated measurements of one flight.
TEST(WindowFlight, ErrorsStayWithinTheGuarantee) {
  Scenario scenario = zoo::long_flight(40).scenario;
  const trajectory::NominalTrajectory truth = make_nominal(scenario);
  constexpr int kRuns = 20;
  double squares = 0.0;
  double guaranteed = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    scenario.observations.clear();
    scenario.observations =
        estimate::simulate_measurements(scenario, truth, 100 + static_cast<std::uint64_t>(run));
    const estimate::TrajectoryEstimate result =
        window::estimate_flight(scenario, {.windows = {.core = 40, .overlap = 1}});
    squares += (result.observed->path.position_m - result.nominal.position_m).rowwise().squaredNorm().mean();
    guaranteed = result.guaranteed_rms_m;
  }
  constexpr double kSampling = 1.05;
  EXPECT_LE(std::sqrt(squares / kRuns), kSampling * guaranteed);
  EXPECT_GT(std::sqrt(squares / kRuns), 0.8 * guaranteed);
}

}  // namespace
