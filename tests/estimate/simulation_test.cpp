// SPDX-License-Identifier: Apache-2.0
// What the guarantee says, tried out by drawing noise and motions.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "trammel/core/random.hpp"
#include "trammel/estimate/bounded_motion.hpp"
#include "trammel/estimate/deviated_path.hpp"
#include "trammel/estimate/simulate_measurements.hpp"
#include "trammel/estimate/trajectory_estimate.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/problem/noise.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

using namespace trammel;

constexpr std::uint64_t kSeed = 77001;
constexpr int kDraws = 2000;
/// Sampling errors allowed, in standard errors.
constexpr double kSigmas = 5.0;

Eigen::VectorXd normal(RandomStream& stream, Eigen::Index size) {
  Eigen::VectorXd result(size);
  for (double& x : result) {
    x = stream.normal();
  }
  return result;
}

/// Running mean and its standard error.
struct Mean {
  double sum = 0.0;
  double square = 0.0;
  int count = 0;

  void add(double x) {
    sum += x;
    square += x * x;
    ++count;
  }
  [[nodiscard]] double value() const { return sum / count; }
  [[nodiscard]] double error() const {
    return std::sqrt(std::max(square / count - value() * value(), 0.0) / count);
  }
};

class Simulation : public testing::TestWithParam<zoo::Instance> {
 protected:
  void SetUp() override {
    solution_ = minimax::solve(assembled_.problem);
    ASSERT_EQ(solution_.status, SolveStatus::kOptimal);
  }

  /// Squared error of the estimate of motion z with the noise e.
  [[nodiscard]] double squared_error(const Eigen::VectorXd& z, const Eigen::VectorXd& e) const {
    const Eigen::MatrixXd& F = assembled_.problem.information_factor;
    const Eigen::VectorXd estimate = solution_.gain * (F.transpose() * (F * z + e));
    return (assembled_.problem.criterion_factor * (estimate - z)).squaredNorm();
  }
  [[nodiscard]] Eigen::Index noises() const { return assembled_.problem.information_factor.rows(); }

  TrajectoryProblem assembled_ = assemble(GetParam().scenario);
  minimax::Solution solution_;
};

// Each motion is on the boundary of every bound; the mean over the noise alone is at most the bound, so the
// mean over motions is too, and so it is for the motion that did worst in this draw.
TEST_P(Simulation, NoMotionWithinTheBoundsExceedsTheGuarantee) {
  RandomStream stream(kSeed);
  const estimate::BoundedMotion motion =
      estimate::bounded_motion(assembled_.coordinates, GetParam().scenario.bounds);
  Mean over_all;
  constexpr int kMotions = 10;
  for (int m = 0; m < kMotions; ++m) {
    Eigen::VectorXd u = normal(stream, motion.bounded.cols());
    Eigen::Index at = 0;
    for (const Eigen::Index size : motion.block_sizes) {
      u.segment(at, size).normalize();
      at += size;
    }
    const Eigen::VectorXd z = motion.bounded * u;
    for (const Eigen::MatrixXd& a : assembled_.problem.ellipsoids) {
      EXPECT_NEAR((a * z).norm(), 1.0, 1e-9);
    }
    Mean over_noise;
    for (int i = 0; i < kDraws / kMotions; ++i) {
      const double square = squared_error(z, normal(stream, noises()));
      over_noise.add(square);
      over_all.add(square);
    }
    EXPECT_LE(over_noise.value(), solution_.upper + kSigmas * over_noise.error()) << "seed " << kSeed;
  }
  EXPECT_LE(over_all.value(), solution_.upper + kSigmas * over_all.error()) << "seed " << kSeed;
}

TEST_P(Simulation, TheLeastFavourablePriorAttainsTheLowerBound) {
  RandomStream stream(kSeed + 1);
  Mean mean;
  for (int i = 0; i < kDraws; ++i) {
    const Eigen::VectorXd z = solution_.prior_factor * normal(stream, solution_.prior_factor.cols());
    mean.add(squared_error(z, normal(stream, noises())));
  }
  EXPECT_NEAR(mean.value(), solution_.lower, kSigmas * mean.error()) << "seed " << kSeed + 1;
  EXPECT_LT(mean.error(), 0.1 * mean.value());
}

/// The manoeuvre seen by a radar on the move whose readings and clock are off.
zoo::Instance biased() {
  zoo::Instance instance{.name = "biased", .scenario = zoo::manoeuvre_scenario(7, 1.0), .optimum = {}};
  Station& station = instance.scenario.stations[0];
  station.track = {.times_s = {0.0, 40.0, 70.0}, .positions_m = {{0, 0, 0}, {900, 300, 0}, {900, 1500, 40}}};
  station.bias = {.components = Eigen::VectorXd{{0.004, 0.006, 80.0}}, .time_s = 0.3};
  return instance;
}

INSTANTIATE_TEST_SUITE_P(Estimate, Simulation,
                         testing::Values(zoo::manoeuvre(), zoo::manoeuvre_noisy(), zoo::r20(),
                                         zoo::paper004(), biased()),
                         [](const auto& tested) { return std::string(tested.param.name); });

// From simulated files to the estimate: a linear sensor, so that the guarantee holds as it stands, at every
// time.
/// What differs from the plain case.
enum class Twist {
  kNone,
  kBias,          ///< a station's readings are off, within its ellipsoid
  kSmallerNoise,  ///< the covariance stated is an upper bound only
};

/// A covariance below W in the semidefinite order: L Q diag(d) Q' L' with d from 0 to 1.
Eigen::Matrix3d smaller(const Eigen::Matrix3d& W) {
  const Eigen::Matrix3d lower = noise_factor(W, 3, "W");
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.0, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  const Eigen::Matrix3d factor = lower * turn;
  return factor * Eigen::Vector3d(0.9, 0.01, 0.3).asDiagonal() * factor.transpose();
}

class WholeWay : public testing::TestWithParam<Twist> {};

TEST_P(WholeWay, KeepsTheGuaranteeAtEveryTime) {
  const bool biased = GetParam() == Twist::kBias;
  Scenario scenario;
  scenario.knots_s = {0.0, 7.0, 12.0, 25.0, 31.0};
  scenario.nominal.position_m = {100.0, -50.0, 900.0};
  scenario.nominal.velocity_mps = {40.0, 10.0, -2.0};
  scenario.bounds = {.position_m = {200.0, 100.0, 50.0},
                     .velocity_mps = Eigen::Vector3d::Constant(10.0),
                     .acceleration_mps2 = std::vector<Eigen::Vector3d>(4, Eigen::Vector3d::Constant(3.0))};
  scenario.stations.push_back({.name = "receiver",
                               .kind = SensorKind::kPosition,
                               .position_m = {5.0, 6.0, 7.0},
                               .covariance = Eigen::Vector3d(900.0, 900.0, 2500.0).asDiagonal(),
                               .times_s = {30.0, 0.5, 3.0, 21.0, 9.0, 13.0, 26.5}});
  // At the edge of its ellipsoid; the other stations of this test have none to compare with.
  const Eigen::VectorXd bias{{12.0, -16.0, 30.0}};
  if (biased) {
    scenario.stations.front().bias.components = std::sqrt(3.0) * bias.cwiseAbs();
    scenario.stations.push_back(scenario.stations.front());
    scenario.stations.back().name = "another";
    scenario.stations.back().bias = {};
    scenario.stations.back().times_s = {2.0, 24.0};
  }
  Scenario actual = scenario;
  if (GetParam() == Twist::kSmallerNoise) {
    actual.stations[0].covariance = smaller(scenario.stations[0].covariance);
  }
  const TrajectoryProblem assembled = assemble(scenario);
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(18);
  theta << 115.0, -57.0, 28.0, 5.0, -5.0, 5.0, 1.7, 1.7, 1.7, -1.7, 1.7, 1.7, 1.7, -1.7, 1.7, -1.7, -1.7, 1.7;
  const estimate::DeviatedPath truth{assembled.nominal,
                                     assembled.coordinates.spline(assembled.coordinates.from_motion(theta))};
  std::vector<Mean> at_time;
  std::vector<double> guaranteed;
  Mean chi2;
  std::vector<Mean> bias_error(biased ? 3 : 0);
  Eigen::VectorXd bias_rms;
  constexpr std::uint64_t kRuns = 200;
  estimate::EstimateSettings settings;
  settings.output_step_s = 1.0;
  settings.near_optimality.reset();
  for (std::uint64_t run = 0; run < kRuns; ++run) {
    Scenario observed = scenario;
    observed.observations = estimate::simulate_measurements(actual, truth, kSeed + run);
    for (Measurement& m : observed.observations) {
      if (biased && m.station == 0) {
        m.value += bias;
      }
    }
    const estimate::TrajectoryEstimate result = estimate::estimate_trajectory(observed, settings);
    ASSERT_TRUE(result.observed.has_value());
    EXPECT_LT(result.observed->linearisation.ratio, 1e-9);  // the sensor is linear
    chi2.add(result.observed->chi2);
    bias_rms = result.observed->biases_guaranteed_rms;
    ASSERT_EQ(result.observed->biases.size(), biased ? 3 : 0);
    for (std::size_t c = 0; c < bias_error.size(); ++c) {
      const auto at = static_cast<Eigen::Index>(c);
      bias_error[c].add(std::pow(result.observed->biases(at) - bias(at), 2));
    }
    guaranteed = result.guaranteed_rms_at_m;
    at_time.resize(guaranteed.size());
    for (std::size_t i = 0; i < guaranteed.size(); ++i) {
      const double t = result.observed->path.times_s[i];
      const Eigen::Vector3d x = result.observed->path.position_m.row(static_cast<Eigen::Index>(i));
      at_time[i].add((x - truth.position(t)).squaredNorm());
    }
  }
  ASSERT_EQ(at_time.size(), 32U);
  for (std::size_t i = 0; i < at_time.size(); ++i) {
    EXPECT_LE(at_time[i].value(), guaranteed[i] * guaranteed[i] + kSigmas * at_time[i].error()) << i;
    EXPECT_GE(at_time[i].value(), 0.01 * guaranteed[i] * guaranteed[i]) << "a bound far too wide, row " << i;
  }
  EXPECT_GT(chi2.value(), 1.0);                   // the residuals of 21 or 27 numbers,
  EXPECT_LT(chi2.value(), biased ? 27.0 : 21.0);  // less what the estimate adapts to
  for (std::size_t c = 0; c < bias_error.size(); ++c) {
    const double rms = bias_rms(static_cast<Eigen::Index>(c));
    EXPECT_LE(bias_error[c].value(), rms * rms + kSigmas * bias_error[c].error()) << c;
    EXPECT_LT(rms, 1.8 * std::sqrt(3.0) * std::abs(bias(static_cast<Eigen::Index>(c))));
  }
}

INSTANTIATE_TEST_SUITE_P(Estimate, WholeWay,
                         testing::Values(Twist::kNone, Twist::kBias, Twist::kSmallerNoise));

TEST(Simulation, DependsOnTheSeedOnly) {
  Scenario scenario = zoo::long_flight(2).scenario;
  const trajectory::NominalTrajectory truth = make_nominal(scenario);
  const auto first = estimate::simulate_measurements(scenario, truth, 5);
  const auto again = estimate::simulate_measurements(scenario, truth, 5);
  const auto other = estimate::simulate_measurements(scenario, truth, 6);
  ASSERT_EQ(first.size(), 42U);
  double range_square = 0.0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].value, again[i].value);
    EXPECT_NE(first[i].value, other[i].value);
    const Station& station = scenario.stations[first[i].station];
    range_square +=
        std::pow(first[i].value(2) - (truth.position(first[i].t_s) - station.position_m).norm(), 2) / 225.0;
    EXPECT_LE(std::abs(first[i].value(0)), std::numbers::pi);
  }
  EXPECT_NEAR(range_square / 42.0, 1.0, kSigmas * std::sqrt(2.0 / 42.0));
  // A measurement keeps its noise when others are removed behind it.
  scenario.stations[0].times_s.resize(5);
  EXPECT_EQ(estimate::simulate_measurements(scenario, truth, 5)[5].value, first[21].value);
  scenario.knots_s.back() += 100.0;
  scenario.stations[0].times_s[0] = 110.0;
  EXPECT_THROW((void)estimate::simulate_measurements(scenario, truth, 5), Error);
}

}  // namespace
