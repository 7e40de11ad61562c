// SPDX-License-Identifier: Apache-2.0
#include "trammel/filter/rules.hpp"

#include <cmath>
#include <complex>

#include <gtest/gtest.h>

#include "filter/filter_cases.hpp"
#include "trammel/filter/analysis.hpp"

namespace {

using namespace trammel::filter;
using trammel::RandomStream;
using trammel::test::design_of;
using trammel::test::error_of;
using trammel::test::expect_near;
using trammel::test::random_stable_gains;
using trammel::test::vec;

constexpr double kFormula = 1e-12;

TEST(Rules, PolePlacementReturnsThePoles) {
  constexpr std::uint64_t kSeed = 5;
  RandomStream random(kSeed);
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::VectorXd gains = random_stable_gains(random, 1 + trial % 5);
    const auto analysis = analyse(design_of(static_cast<int>(gains.size()), 1.0, gains));
    if (analysis.poles.size() == gains.size()) {
      expect_near(pole_placement(analysis.poles), gains, 1e-9, "seed 5, trial " + std::to_string(trial));
    }
  }
  EXPECT_NE(
      error_of([] {
        (void)pole_placement(Eigen::Vector2cd(std::complex<double>(0.5), std::complex<double>(0.1, 0.2)));
      }),
      "no error");
}

TEST(Rules, FadingMemoryClosedForms) {
  for (const double t : {0.0, 0.3, 0.7, 0.99}) {
    const double r = 1.0 - t;
    expect_near(fading_memory(1, t), vec({r}), kFormula, "1");
    expect_near(fading_memory(2, t), vec({1 - t * t, r * r}), kFormula, "2");
    expect_near(fading_memory(3, t), vec({1 - t * t * t, 1.5 * r * r * (1 + t), 2 * r * r * r}), kFormula,
                "3");
    expect_near(fading_memory(4, t),
                vec({1 - std::pow(t, 4), r * r * (11 + 14 * t + 11 * t * t) / 6, 4 * std::pow(r, 3) * (1 + t),
                     6 * std::pow(r, 4)}),
                kFormula, "4");
    expect_near(fading_memory(5, t),
                vec({1 - std::pow(t, 5), 5.0 / 12 * r * r * (1 + t) * (5 + 2 * t + 5 * t * t),
                     5.0 / 6 * std::pow(r, 3) * (7 + 10 * t + 7 * t * t), 15 * std::pow(r, 4) * (1 + t),
                     24 * std::pow(r, 5)}),
                kFormula, "5");
  }
}

TEST(Rules, MemoriesGrowIntoOneAnother) {
  for (int order = 1; order <= 5; ++order) {
    expect_near(finite_fading_memory(order, 2000, 0.9), fading_memory(order, 0.9), 1e-11, "long memory");
    expect_near(finite_fading_memory(order, 30, 1.0), expanding_memory(order, 30), 1e-11, "equal weights");
  }
  for (const int n : {1, 2, 3, 10, 1000}) {
    expect_near(expanding_memory(2, n), vec({2.0 * (2 * n - 1), 6.0}) / (n * (n + 1.0)), kFormula, "order 2");
    expect_near(
        expanding_memory(3, n),
        vec({3.0 * (3.0 * n * n - 3 * n + 2), 18.0 * (2 * n - 1), 120.0}) / (n * (n + 1.0) * (n + 2.0)),
        kFormula, "order 3");
  }
  // Finite fading memory, order 2, theta = 0.8, third sample.
  expect_near(finite_fading_memory(2, 3, 0.8), vec({0.8677685950413223, 0.5371900826446281}), kFormula,
              "3rd");
}

TEST(Rules, KalataIndexAndRiccatiAgree) {
  expect_near(kalata(1, 0.1), vec({0.04876562255935639}), kFormula, "alpha");
  expect_near(kalata(2, 1.0), vec({0.75, 0.5}), kFormula, "alpha-beta");
  expect_near(kalata(2, 2.0), vec({0.854101966249685, 0.763932022500210}), kFormula, "alpha-beta");
  expect_near(kalata(3, 0.1), vec({0.604758751247757, 0.275753887885569, 0.125736430480946}), kFormula,
              "abg");
  expect_near(kalata(3, 1.0), vec({0.864317940853744, 0.797962290432881, 0.736700913929816}), kFormula,
              "abg");
  for (const double index : {1e-6, 1e-3, 0.1, 1.0, 10.0, 1e3}) {
    // Doubling loses digits as the memory grows.
    const double tolerance = index < 1e-4 ? 1e-9 : 1e-11;
    expect_near(kalman(2, ProcessNoise::kDiscrete, index), kalata(2, index), tolerance, "discrete");
    expect_near(kalman(3, ProcessNoise::kIncrements, index), kalata(3, index), tolerance, "increments");
    expect_near(kalman(2, ProcessNoise::kIncrements, index), benedict_bordner_from_index(index), tolerance,
                "BB");
    const Eigen::VectorXd alpha = kalman(1, ProcessNoise::kDiscrete, 0.5 * index);
    expect_near(alpha, kalata(1, index), tolerance, "alpha");
    // Any process noise: beta^2/(1 - alpha) = T^2 Q_22 / R.
    const Eigen::VectorXd gains = kalman(2, ProcessNoise::kContinuous, index);
    EXPECT_NEAR(gains[1] * gains[1] / (1.0 - gains[0]) / (index * index), 1.0, 1e-9) << index;
  }
  expect_near(kalman(2, ProcessNoise::kContinuous, 1.0), vec({0.756738198274059, 0.493215776031080}),
              kFormula, "continuous");
  expect_near(benedict_bordner_from_index(1.0), vec({0.769087251503358, 0.480533816184295}), kFormula, "BB");
}

TEST(Rules, KalmanIsTheBestFilterForItsNoise) {
  // Predicted variance R rho + process part: perturbing the gains never helps (order 4, any process noise).
  const Eigen::VectorXd best = kalman(4, ProcessNoise::kDiscrete, 0.2);
  // The variance of the prediction error obeys P = Phi (I - K H) P (..)' Phi' + Phi K K' Phi' + Q.
  const auto predicted_variance = [](const Eigen::VectorXd& gains) {
    Eigen::MatrixXd transition = Eigen::MatrixXd::Zero(4, 4);
    Eigen::VectorXd k(4);
    for (int i = 0; i < 4; ++i) {
      k[i] = gains[i] / factorial(i);
      for (int j = i; j < 4; ++j) {
        transition(i, j) = 1.0 / factorial(j - i);
      }
    }
    Eigen::MatrixXd closed = transition;
    closed.col(0) -= transition * k;
    const Eigen::VectorXd driven = transition * k;
    const Eigen::MatrixXd noise =
        0.04 * process_noise_covariance(4, ProcessNoise::kDiscrete) + driven * driven.transpose();
    Eigen::MatrixXd p = noise;
    for (int i = 0; i < 3000; ++i) {
      p = (closed * p * closed.transpose() + noise).eval();
    }
    return p(0, 0);
  };
  const double value = predicted_variance(best);
  for (int i = 0; i < 4; ++i) {
    for (const double factor : {0.99, 1.01}) {
      Eigen::VectorXd other = best;
      other[i] *= factor;
      EXPECT_GT(predicted_variance(other), value) << i << " " << factor;
    }
  }
  EXPECT_NEAR(value / (1.0 + value), best[0], 1e-10);
}

TEST(Rules, LeastNoiseOfThePrediction) {
  for (int order = 1; order <= 7; ++order) {
    for (const double b : {0.1, 0.5, 1.0}) {
      const Eigen::VectorXd gains = minimum_noise_prediction(order, b);
      const FilterAnalysis analysis = analyse(design_of(order, 1.0, gains));
      EXPECT_TRUE(analysis.stable);
      const double expected = std::pow(1.0 - 0.5 * b, -order) - 1.0;
      EXPECT_NEAR(analysis.prediction_noise_gain, expected, 1e-9 * expected) << order << " " << b;
      EXPECT_NEAR(analysis.prediction_error_coefficients[order] * std::pow(b, order), 1.0, 1e-9);
    }
  }
  const double b = 0.6;
  expect_near(minimum_noise_prediction(3, b),
              vec({b * (8 - 4 * b + b * b) / 4, b * b * (2 - b) / 2, 2 * b * b * b}), kFormula, "order 3");
  expect_near(minimum_noise_prediction(4, b),
              vec({b * (2 - b) * (8 - 4 * b + b * b) / 8, b * b * (18 - 9 * b + 2 * b * b) / 6,
                   b * b * b * (2 - b), 6 * std::pow(b, 4)}),
              kFormula, "order 4");
  EXPECT_NE(error_of([] { (void)minimum_noise_prediction(2, 2.0); }), "no error");
}

TEST(Rules, LeastNoiseOfTheEstimateKeepsItsLag) {
  const double t = 0.4;
  expect_near(minimum_noise_estimate(2, std::pow(1 - t, 2) / (4 * t * t)),
              vec({2 * t / (1 + t * t), 4 * t * t / (1 + t * t)}), kFormula, "order 2");
  for (int order = 1; order <= 7; ++order) {
    for (const double lag : {0.2, 3.0, 50.0}) {
      const FilterAnalysis best = analyse(design_of(order, 1.0, minimum_noise_estimate(order, lag)));
      ASSERT_TRUE(best.stable) << order << " " << lag;
      EXPECT_NEAR(best.error_coefficients(0, order), lag, 1e-9 * lag);
      const double shrunk = 1.0 / (1.0 + 2.0 * std::pow(lag, 1.0 / order));
      EXPECT_NEAR(best.covariance(0, 0), 1.0 - std::pow(1.0 - shrunk, order), 1e-9) << order << " " << lag;
      // Less noise than the critically damped filter of the same lag.
      const double root = std::pow(lag, 1.0 / order);
      const FilterAnalysis damped = analyse(design_of(order, 1.0, fading_memory(order, root / (1 + root))));
      EXPECT_NEAR(damped.error_coefficients(0, order), lag, 1e-8 * lag);
      EXPECT_LE(best.covariance(0, 0), damped.covariance(0, 0) * (1 + 1e-12)) << order << " " << lag;
    }
  }
}

TEST(Rules, NoNeighbourOfTheLeastNoiseHasLess) {
  // The lag is (1 - kappa_0) (v-1)! / kappa_(v-1): move along it, in each of the v - 1 free directions.
  constexpr double kLag = 2.0;
  constexpr double kMove = 1e-3;
  for (int order = 2; order <= 6; ++order) {
    const Eigen::VectorXd best = minimum_noise_estimate(order, kLag);
    const double least = analyse(design_of(order, 1.0, best)).covariance(0, 0);
    for (int i = 0; i + 1 < order; ++i) {
      for (const double move : {-kMove, kMove}) {
        Eigen::VectorXd other = best;
        other[i] *= 1.0 + move;
        other[order - 1] = (1.0 - other[0]) * factorial(order - 1) / kLag;
        const FilterAnalysis analysis = analyse(design_of(order, 1.0, other));
        if (analysis.stable) {
          EXPECT_NEAR(analysis.error_coefficients(0, order), kLag, 1e-9 * kLag);
          EXPECT_GT(analysis.covariance(0, 0), least) << "order " << order << " gain " << i;
        }
      }
    }
  }
}

TEST(Rules, RejectArgumentsOutOfRange) {
  EXPECT_NE(error_of([] { (void)fading_memory(2, 1.0); }).find("theta"), std::string::npos);
  EXPECT_NE(error_of([] { (void)kalata(4, 1.0); }).find("order"), std::string::npos);
  EXPECT_NE(error_of([] { (void)kalata(2, -1.0); }).find("tracking_index"), std::string::npos);
  EXPECT_NE(error_of([] { (void)kalman(Eigen::MatrixXd::Zero(2, 2)); }).find("process_noise"),
            std::string::npos);
  Eigen::Matrix2d indefinite;
  indefinite << 1.0, 2.0, 2.0, 1.0;
  EXPECT_NE(error_of([&] { (void)kalman(indefinite); }).find("negative eigenvalue"), std::string::npos);
  EXPECT_NE(error_of([] { (void)minimum_noise_estimate(2, 0.0); }).find("lag"), std::string::npos);
  EXPECT_NE(error_of([] { (void)benedict_bordner(1.5); }).find("alpha"), std::string::npos);
  EXPECT_NE(error_of([] { (void)expanding_memory(2, 0); }).find("samples"), std::string::npos);
}

}  // namespace
