// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>

#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/region/prediction.hpp"

namespace {

using namespace trammel::region;
using trammel::RandomStream;

constexpr double kRelative = 1e-12;

Eigen::VectorXd pair(double x, double y) {
  Eigen::VectorXd result(2);
  result << x, y;
  return result;
}

Eigen::MatrixXd square(double a, double b, double c, double d) {
  Eigen::MatrixXd result(2, 2);
  result << a, b, c, d;
  return result;
}

/// Six steps with every number written out.
TEST(RegionPrediction, PublishedAlgorithm) {
  const PredictionSettings settings{.transition = square(0.9, -0.2, 0.1, 0.95),
                                    .gain = square(1.0, 0.2, 0.2, 0.5),
                                    .step = 0.05,
                                    .centring = 0.0};
  validate(settings);
  const double regressors[6][2] = {{2.0, 0.5}, {0.0, -1.5}, {2.0, -1.5}, {0.0, 0.5}, {0.0, -1.5}, {2.0, 0.5}};
  const double drift[6][2] = {{0.1, -0.1}, {0.0, 0.2}, {-0.1, 0.0}, {0.05, 0.05}, {0.0, -0.1}, {0.1, 0.1}};
  const double noise[6] = {20.0, 20.0, -19.0, 5.0, 0.5, 20.0};
  const double residuals[6] = {
      -21.5, -22.6908125, 14.9164883359375, -4.720899648450195, -0.9874877911528803, -24.06888175622937};
  const double predictions[6][2] = {{1.0105, 0.8438750000000002},
                                    {-0.32579318749999997, 0.012116859374999955},
                                    {-0.8773802857265626, 0.1318257030996093},
                                    {-1.000122484063386, 0.08588561076858706},
                                    {-0.9636992839949502, -0.05717981397893147},
                                    {0.27534404974311155, 0.7940128572525229}};
  Eigen::VectorXd theta = pair(1.0, -1.0);
  RandomisedPrediction state{pair(0.0, 0.0), 0.0};
  for (int t = 0; t < 6; ++t) {
    const Eigen::VectorXd phi = pair(regressors[t][0], regressors[t][1]);
    const double y = phi.dot(theta) + noise[t];
    const double residual = predict_step(settings, phi, phi - pair(1.0, -0.5), y, state);
    theta = settings.transition * theta + pair(drift[t][0], drift[t][1]);
    EXPECT_NEAR(residual, residuals[t], kRelative * std::abs(residuals[t]));
    EXPECT_NEAR(state.theta(0), predictions[t][0], kRelative);
    EXPECT_NEAR(state.theta(1), predictions[t][1], kRelative);
    EXPECT_EQ(state.centre, 0.0);
  }
}

struct BoundCase {
  PredictionProblem problem;
  double alpha_1, psi_1, limit_1;  ///< at rho = 1
  double alpha_joint, rho_joint, limit_joint;
};

TEST(RegionPrediction, BoundsAndBestSteps) {
  const BoundCase cases[] = {
      {{1, 0.1, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 20.0},
       0.0049875156249755866,
       0.9900498440621582,
       2.0050062499902412,
       0.0049875156249755866,
       std::nan(""),
       2.0050062499902412},
      {{2, 0.05, 1.0, 0.7, 1.0, 1.0, 4.0, 1.0, 2.0, 5.0},
       0.006791123472286192,
       0.9908613820029261,
       1.0517931491021137,
       0.008228742643200762,
       0.18633707685178508,
       0.868037494009984},
      {{2, 0.05, std::sqrt(0.9860190913390017), 0.4298437881283576, std::sqrt(1.145234317807464),
        std::sqrt(0.8938870590837793), 4.0, 1.118033988749895, 2.0, 5.0},
       0.001479678529144896,
       0.9847864135027086,
       0.3422771024971803,
       0.002353171510934727,
       0.12987708438094864,
       0.33381707473322725},
      {{2, 0.05, std::sqrt(0.9409), 0.7, 1.0, std::sqrt(0.9409), 4.0, 1.0, 2.0, 5.0},
       0.0005844541310425491,
       0.9401326931422339,
       0.08405488989330664,
       0.001040106093602539,
       0.0578388029449657,
       0.08363295525842569}};
  for (const BoundCase& item : cases) {
    const BestStep fixed = best_step(item.problem, 1.0);
    EXPECT_NEAR(fixed.alpha, item.alpha_1, kRelative * item.alpha_1);
    EXPECT_NEAR(prediction_error_bound(item.problem, fixed.alpha, 1.0).contraction, item.psi_1, kRelative);
    EXPECT_NEAR(fixed.limit, item.limit_1, kRelative * item.limit_1);
    const BestStep joint = best_step(item.problem);
    EXPECT_NEAR(joint.limit, item.limit_joint, kRelative * item.limit_joint);
    EXPECT_NEAR(joint.alpha, item.alpha_joint, 1e-6 * item.alpha_joint);  // the minimum is flat
    if (std::isnan(item.rho_joint)) {
      EXPECT_TRUE(std::isnan(joint.rho));
    } else {
      EXPECT_NEAR(joint.rho, item.rho_joint, 1e-5 * item.rho_joint);
    }
    // A stationary point: both neighbours are worse.
    for (const double factor : {0.99, 1.01}) {
      EXPECT_GT(prediction_error_bound(item.problem, factor * fixed.alpha, 1.0).limit, fixed.limit);
    }
  }
}

TEST(RegionPrediction, NoNoiseLimitOfTheBestStep) {
  PredictionProblem problem;
  problem.sigma_w = 0.1;
  problem.lambda_min = 0.6;
  problem.m4_4 = 3.0;
  EXPECT_NEAR(best_step(problem).alpha, 0.6 / 3.0, 1e-15);
}

/// Exact second moments of the scalar case, with a constant noise, against their recursion, and the bound
/// above them; the mean of a million short runs would say the same.
TEST(RegionPrediction, ExactMomentsOfTheScalarCase) {
  constexpr double kAlpha = 0.02;
  constexpr double kMean = 0.5;
  constexpr double kNoise = 20.0;
  constexpr double kDrift = 0.1;
  // All sign sequences of the probe and of a two-point drift, eight steps each: expectation by enumeration.
  const PredictionSettings settings{.transition = Eigen::MatrixXd::Identity(1, 1),
                                    .gain = Eigen::MatrixXd::Identity(1, 1),
                                    .step = kAlpha,
                                    .centring = 0.0};
  constexpr int kSteps = 3;
  const double expected[kSteps] = {1.1224999999999998, 1.2403212499999998, 1.3536453606249996};
  double moments[kSteps] = {};
  for (int bits = 0; bits < 1 << (2 * kSteps); ++bits) {
    RandomisedPrediction state{Eigen::VectorXd::Constant(1, 1.0), 0.0};
    double theta = 0.0;
    for (int t = 0; t < kSteps; ++t) {
      const double probe = (bits >> (2 * t) & 1) != 0 ? 1.0 : -1.0;
      const double phi = kMean + probe;
      predict_step(settings, Eigen::VectorXd::Constant(1, phi), Eigen::VectorXd::Constant(1, probe),
                   phi * theta + kNoise, state);
      theta += (bits >> (2 * t + 1) & 1) != 0 ? kDrift : -kDrift;
      const double error = state.theta(0) - theta;
      moments[t] += error * error / (1 << (2 * kSteps));
    }
  }
  PredictionProblem problem;
  problem.sigma_w = kDrift;
  problem.c_v = kNoise;
  problem.m_phi = kMean;
  for (int t = 0; t < kSteps; ++t) {
    EXPECT_NEAR(moments[t], expected[t], 1e-12);
    EXPECT_LE(moments[t], prediction_error_bound(problem, kAlpha, 1.0).at(t + 1, 1.0));
  }
}

/// Monte Carlo of the limit, where the bound is an equality.
TEST(RegionPrediction, BoundIsAttained) {
  PredictionProblem problem;
  problem.sigma_w = 0.1;
  problem.c_v = 20.0;
  const BestStep best = best_step(problem);
  const PredictionSettings settings{.transition = Eigen::MatrixXd::Identity(1, 1),
                                    .gain = Eigen::MatrixXd::Identity(1, 1),
                                    .step = best.alpha,
                                    .centring = 0.0};
  double sum = 0.0;
  double squares = 0.0;
  constexpr int kRuns = 1500;
  for (int run = 0; run < kRuns; ++run) {
    RandomStream random(99, static_cast<std::uint64_t>(run));
    RandomisedPrediction state{Eigen::VectorXd::Zero(1), 0.0};
    double theta = 0.0;
    for (int t = 0; t < 1000; ++t) {
      const double probe = random.sign();
      predict_step(settings, Eigen::VectorXd::Constant(1, probe), Eigen::VectorXd::Constant(1, probe),
                   probe * theta + 20.0, state);
      theta += 0.1 * random.normal();
    }
    const double error = std::pow(state.theta(0) - theta, 2);
    sum += error;
    squares += error * error;
  }
  const double mean = sum / kRuns;
  const double deviation = std::sqrt((squares / kRuns - mean * mean) / kRuns);
  EXPECT_NEAR(mean, best.limit, 4.0 * deviation + 1e-4) << "seed 99";
}

/// Predictable centring takes a constant noise out.
TEST(RegionPrediction, CentringRemovesConstantNoise) {
  PredictionSettings settings{.transition = Eigen::MatrixXd::Identity(1, 1),
                              .gain = Eigen::MatrixXd::Identity(1, 1),
                              .step = 0.1,
                              .centring = 0.1};
  double errors[2] = {};
  for (int kind = 0; kind < 2; ++kind) {
    settings.centring = kind == 0 ? 0.0 : 0.1;
    RandomStream random(5);
    RandomisedPrediction state{Eigen::VectorXd::Zero(1), 0.0};
    double theta = 0.0;
    for (int t = 0; t < 20000; ++t) {
      const double probe = random.sign();
      predict_step(settings, Eigen::VectorXd::Constant(1, probe), Eigen::VectorXd::Constant(1, probe),
                   probe * theta + 20.0, state);
      theta += 0.1 * random.normal();
      errors[kind] += t > 1000 ? std::pow(state.theta(0) - theta, 2) / 19000.0 : 0.0;
    }
  }
  EXPECT_NEAR(errors[1], 0.053, 0.01);
  EXPECT_GT(errors[0], 10.0);
}

TEST(RegionPrediction, WrongUseNamesTheArgument) {
  PredictionProblem problem;
  problem.lambda_min = 0.0;
  problem.sigma_w = 1.0;
  EXPECT_THROW((void)best_step(problem), trammel::Error);
  problem.lambda_min = 1.0;
  problem.sigma_w = 0.0;
  EXPECT_THROW((void)best_step(problem), trammel::Error);
  EXPECT_THROW((void)prediction_error_bound(PredictionProblem{}, -1.0, 1.0), trammel::Error);
  EXPECT_THROW(validate(PredictionSettings{.transition = 2.0 * Eigen::MatrixXd::Identity(1, 1),
                                           .gain = Eigen::MatrixXd::Identity(1, 1),
                                           .step = 1.0,
                                           .centring = 0.0}),
               trammel::Error);
  // A contraction above one: no bound.
  EXPECT_TRUE(std::isinf(prediction_error_bound(PredictionProblem{}, 3.0, 1.0).limit));
}

}  // namespace
