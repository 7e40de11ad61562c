// SPDX-License-Identifier: Apache-2.0
#include "trammel/estimate/trajectory_estimate.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "trammel/core/random.hpp"
#include "trammel/estimate/bias_bound.hpp"
#include "trammel/estimate/pointwise_guarantee.hpp"
#include "trammel/estimate/simulate_measurements.hpp"
#include "trammel/linalg/cholesky.hpp"
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
    EXPECT_NEAR(result.prior_rms_m / *instance.optimum->prior_rms_m, 1.0, 1e-9);
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

/// A random map with blocks of the given sizes.
Eigen::MatrixXd random_map(RandomStream& stream, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd map(rows, columns);
  for (double& x : map.reshaped()) {
    x = stream.normal();
  }
  return map;
}

TEST(BiasBound, MultipliersAreFeasibleAndTheGapCloses) {
  constexpr std::uint64_t kSeed = 31;
  RandomStream stream(kSeed);
  for (const Eigen::Index rows : {1, 2, 3, 7, 40}) {
    for (int draw = 0; draw < 10; ++draw) {
      const std::vector<Eigen::Index> sizes{3, 1, 2, 3, 3, 3, 3, 2, 3, 3};
      Eigen::MatrixXd map = random_map(stream, rows, 26);
      map.middleCols(6, 3) *= 1e-5;
      map.middleCols(9, 3) *= 1e3;
      map.middleCols(12, 3).setZero();
      const estimate::BiasBound bound = estimate::bound_bias(map, sizes);
      EXPECT_LE(bound.upper - bound.lower, 1e-8 * bound.upper) << "seed " << kSeed << " rows " << rows;
      EXPECT_NEAR(bound.multipliers.sum(), bound.upper, 1e-12 * bound.upper);
      // sum lambda_l |u_l|^2 - |G u|^2 >= 0: smallest eigenvalue of diag(lambda) - G'G.
      Eigen::VectorXd diagonal(26);
      Eigen::Index at = 0;
      for (std::size_t l = 0; l < sizes.size(); ++l) {
        diagonal.segment(at, sizes[l]).setConstant(bound.multipliers(static_cast<Eigen::Index>(l)));
        at += sizes[l];
      }
      Eigen::MatrixXd slack = -map.transpose() * map;
      slack.diagonal() += diagonal;
      EXPECT_GE(linalg::SymmetricEigen(slack).eigenvalues()(0), -1e-12 * bound.upper);
    }
  }
}

TEST(BiasBound, IsTheSumOfLengthsInOneDimension) {
  Eigen::MatrixXd map(1, 5);
  map << 3.0, 4.0, 2.0, 0.0, 1.0;
  const estimate::BiasBound bound = estimate::bound_bias(map, {2, 1, 2});
  EXPECT_NEAR(bound.upper, 64.0, 1e-7);  // (5 + 2 + 1)^2
  EXPECT_EQ(estimate::bound_bias(Eigen::MatrixXd::Zero(3, 2), {2}).upper, 0.0);
  EXPECT_THROW((void)estimate::bound_bias(map, {2, 1}), Error);
}

// The criterion at one time is one of the pointwise values: no estimator is better there than the one made
// for it, and the value of the estimator made for it is its guarantee.
TEST(PointwiseGuarantee, AgreesWithTheSolverAtASingleTime) {
  Scenario scenario = zoo::manoeuvre_noisy().scenario;
  scenario.criterion = {.kind = CriterionKind::kTimes, .times_s = {33.0}};
  const TrajectoryProblem at_once = assemble(scenario);
  const minimax::Solution best = minimax::solve(at_once.problem);
  const double own = estimate::PointwiseGuarantee(at_once, scenario.bounds, best.gain).rms_m(33.0);
  EXPECT_NEAR(own / std::sqrt(best.upper), 1.0, 1e-7);
  scenario.criterion = {};
  const TrajectoryProblem overall = assemble(scenario);
  const minimax::Solution mean = minimax::solve(overall.problem);
  const double other = estimate::PointwiseGuarantee(overall, scenario.bounds, mean.gain).rms_m(33.0);
  EXPECT_GE(other, own * (1 - 1e-9));
  EXPECT_LE(other, 1.5 * own);
}

TEST(Estimate, NamesWhatNothingLimits) {
  Scenario scenario = zoo::manoeuvre().scenario;
  scenario.stations.clear();
  scenario.bounds.velocity_mps.y() = kInfinity;
  scenario.bounds.acceleration_mps2[3].z() = kInfinity;
  const TrajectoryEstimate result = estimate_trajectory(scenario);
  EXPECT_EQ(result.solution.status, SolveStatus::kUnbounded);
  EXPECT_EQ(result.guaranteed_rms_m, kInfinity);
  EXPECT_EQ(result.prior_rms_m, kInfinity);
  EXPECT_TRUE(std::isnan(result.gauss_markov_rms_m));
  EXPECT_EQ(result.observations, 0U);
  EXPECT_EQ(result.unbounded_directions,
            (std::vector<std::string>{"velocity y", "acceleration of segment 4 z"}));
}

TEST(Estimate, FollowsUnboundedMotionsThatMeasurementsSee) {
  Scenario scenario = zoo::manoeuvre().scenario;
  scenario.bounds.velocity_mps.y() = kInfinity;
  scenario.bounds.position_m.setConstant(kInfinity);
  const TrajectoryEstimate result = estimate_trajectory(scenario);
  EXPECT_EQ(result.solution.status, SolveStatus::kOptimal);
  EXPECT_EQ(result.prior_rms_m, kInfinity);
  EXPECT_EQ(result.lambda_m2(0), 0.0);
  EXPECT_GT(result.guaranteed_rms_m, 148.789);
  EXPECT_LT(result.guaranteed_rms_m, result.gauss_markov_rms_m);
  for (const double rms : result.guaranteed_rms_at_m) {
    EXPECT_TRUE(std::isfinite(rms));
  }
}

TEST(Estimate, IsThePriorWithoutMeasurements) {
  Scenario scenario = zoo::paper004().scenario;
  scenario.stations.clear();
  const TrajectoryEstimate result = estimate_trajectory(scenario);
  EXPECT_NEAR(result.prior_rms_m / 382.23085618214645, 1.0, 1e-9);
  // At the start only the position's bound counts; at the end 250 m and 10 s at 25 m/s add up.
  EXPECT_NEAR(estimate::PointwiseGuarantee(assemble(scenario), scenario.bounds, Eigen::MatrixXd::Zero(6, 6))
                  .rms_m(10.0),
              500.0, 1e-6);
}

TEST(Estimate, SaysHowFarTheLinearModelHolds) {
  Scenario scenario = zoo::manoeuvre().scenario;
  const trajectory::NominalTrajectory truth =
      trajectory::NominalTrajectory::line(0.0, {1050.0, 980.0, 5020.0}, {214.0, 209.0, 3.0});
  scenario.observations = estimate::simulate_measurements(scenario, truth, 9);
  const TrajectoryEstimate result = estimate_trajectory(scenario);
  ASSERT_TRUE(result.observed.has_value());
  const estimate::ObservationResult& observed = *result.observed;
  // The remainder by hand, of the first station's measurements.
  const Station& station = scenario.stations[0];
  const TrajectoryProblem problem = assemble(scenario);
  const auto deviation = problem.coordinates.spline(problem.coordinates.from_motion(observed.theta));
  double ratio = 0.0;
  double chi2 = 0.0;
  for (const Measurement& m : scenario.observations) {
    const Eigen::Vector3d x = problem.nominal.position(m.t_s);
    const Eigen::Vector3d d = deviation.position(m.t_s);
    const Eigen::Vector3d e = x.normalized();
    const Eigen::Vector3d y = x + d;
    Eigen::Vector3d remainder;
    remainder.head<2>() = y.normalized().head<2>() - e.head<2>() - ((d - e * e.dot(d)) / x.norm()).head<2>();
    remainder(2) = y.norm() - x.norm() - e.dot(d);
    const Eigen::Vector3d sigma = station.covariance.diagonal().cwiseSqrt();
    ratio = std::max(ratio, remainder.cwiseQuotient(sigma).cwiseAbs().maxCoeff());
    const Eigen::Vector3d residual = m.value - Eigen::Vector3d(y(0) / y.norm(), y(1) / y.norm(), y.norm());
    chi2 += residual.dot(linalg::Cholesky(station.covariance).solve(residual));
  }
  EXPECT_NEAR(observed.linearisation.ratio / ratio, 1.0, 1e-6);
  EXPECT_NEAR(observed.chi2 / chi2, 1.0, 1e-9);
  EXPECT_EQ(observed.residuals.size(), scenario.observations.size());
  EXPECT_EQ(observed.linearisation.iterations, 0);
  EXPECT_FALSE(observed.linearisation.converged);
  EXPECT_EQ(observed.theta.size(), 27);
  ASSERT_TRUE(observed.gauss_markov_path.has_value());
  // Knots lie on the path.
  EXPECT_LT((observed.knot_position_m.row(7) - observed.path.position_m.bottomRows<1>()).norm(), 1e-9);
}

// Every method's answer is verified, attained, and compared with estimators of any kind.
TEST(Estimate, SaysHowGoodTheGuaranteeIs) {
  const zoo::Instance instance = zoo::manoeuvre();
  for (const char* method : {"structured", "sdp", "conditional-gradient"}) {
    estimate::EstimateSettings settings;
    settings.method.method = minimax::method_of(method);
    const TrajectoryEstimate result = estimate_trajectory(instance.scenario, settings);
    EXPECT_EQ(result.solution.claim, Claim::kVerified) << method << ": " << result.certificate.remark;
    EXPECT_GE(result.certificate.inflation, 0.0) << method;
    EXPECT_EQ(result.solution.upper, result.certificate.upper) << method;
    EXPECT_GE(result.guaranteed_rms_m * result.guaranteed_rms_m, result.certificate.upper) << method;
    EXPECT_LE(result.lower_bound_rms_m * result.lower_bound_rms_m, result.certificate.lower) << method;
    ASSERT_TRUE(result.near_optimality.has_value()) << method;
    const certify::NearOptimality& near = *result.near_optimality;
    EXPECT_NEAR(near.attained_fraction, 1.0, 1e-6) << method;
    EXPECT_GE(std::sqrt(near.any_estimator), 0.995 * 139.1) << method;
    EXPECT_LE(std::sqrt(near.any_estimator), result.lower_bound_rms_m) << method;
    EXPECT_EQ(result.worst_case_theta.size(), 27) << method;
  }
}

TEST(Estimate, WithoutNearOptimalityOnlyTheBounds) {
  estimate::EstimateSettings settings;
  settings.near_optimality.reset();
  const TrajectoryEstimate result = estimate_trajectory(zoo::manoeuvre().scenario, settings);
  EXPECT_EQ(result.solution.claim, Claim::kVerified);
  EXPECT_FALSE(result.near_optimality.has_value());
  EXPECT_EQ(result.worst_case_theta.size(), 0);
  EXPECT_EQ(result.worst_case_motion.position_m.rows(), 0);
}

// The worst-case motion touches the bounds and none more.
TEST(Estimate, WorstCaseMotionTouchesTheBounds) {
  const Scenario scenario = zoo::manoeuvre_noisy().scenario;
  const TrajectoryEstimate result = estimate_trajectory(scenario);
  const estimate::PathTable& worst = result.worst_case_motion;
  ASSERT_EQ(worst.position_m.rows(), static_cast<Eigen::Index>(worst.times_s.size()));
  double reach = std::max(worst.position_m.row(0).norm() / 100.0, worst.velocity_mps.row(0).norm() / 10.0);
  const auto step = static_cast<Eigen::Index>(worst.times_s.size() - 1) / 7;
  for (Eigen::Index i = 0; i < 7; ++i) {
    const Eigen::RowVector3d change =
        worst.velocity_mps.row((i + 1) * step) - worst.velocity_mps.row(i * step);
    reach = std::max(reach, change.norm() / (10.0 * 37.0));
  }
  EXPECT_NEAR(reach, 1.0, 1e-9);
}

estimate::EstimateSettings with_step(double step_s) {
  estimate::EstimateSettings settings;
  settings.output_step_s = step_s;
  return settings;
}

TEST(Estimate, GridFollowsTheRequest) {
  Scenario scenario = zoo::manoeuvre().scenario;
  const TrajectoryEstimate result = estimate_trajectory(scenario, with_step(20.0));
  EXPECT_EQ(result.nominal.times_s, (std::vector<double>{0.0, 20.0, 40.0, 60.0, 70.0}));
  EXPECT_THROW((void)estimate_trajectory(scenario, with_step(-1.0)), Error);
  scenario.knots_s[2] = 95.0;
  EXPECT_THROW((void)estimate_trajectory(scenario), Error);
}

TEST(Estimate, ProgressNeverGoesBackWithinAPhase) {
  std::string phase;
  double last = 0.0;
  int calls = 0;
  (void)estimate_trajectory(zoo::manoeuvre().scenario, {}, [&](const Progress& progress) {
    if (progress.phase != phase) {
      phase = progress.phase;
      last = 0.0;
    }
    EXPECT_GE(progress.fraction, last);
    EXPECT_LE(progress.fraction, 1.0);
    last = progress.fraction;
    ++calls;
  });
  EXPECT_GT(calls, 200);
}

}  // namespace
