// SPDX-License-Identifier: Apache-2.0
#include "trammel/certify/correlated_prior.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace {

using trammel::certify::cut_off_information;
using trammel::certify::GaussianNorm;

TEST(GaussianNorm, EqualVariancesAreChiDistributions) {
  const auto expect = [](Eigen::Index dimension, double variance, auto&& truth) {
    const GaussianNorm norm(Eigen::VectorXd::Constant(dimension, variance));
    for (double r = 0.02; r < 8.0; r *= 1.21) {
      EXPECT_NEAR(norm.probability(r * std::sqrt(variance)), truth(r), GaussianNorm::kProbabilityError)
          << dimension << " at " << r;
    }
  };
  expect(1, 0.3, [](double r) { return std::erf(r / std::numbers::sqrt2); });
  expect(2, 1.0, [](double r) { return -std::expm1(-r * r / 2.0); });
  expect(3, 1e-6, [](double r) {
    return std::erf(r / std::numbers::sqrt2) - std::sqrt(2.0 / std::numbers::pi) * r * std::exp(-r * r / 2.0);
  });
  expect(4, 7.0, [](double r) { return -std::expm1(-r * r / 2.0) - r * r / 2.0 * std::exp(-r * r / 2.0); });
  expect(8, 1.0, [](double r) {
    const double x = r * r / 2.0;
    return 1.0 - std::exp(-x) * (1.0 + x + x * x / 2.0 + x * x * x / 6.0);
  });
}

TEST(GaussianNorm, UnequalVariances) {
  // Two variances: P = 1 - 2/pi int_0^(pi/2) exp(-r^2 /(2 (e1 cos^2 + e2 sin^2)))... by a fine midpoint rule,
  // from polar coordinates of the standard normal pair: |g|^2 = R^2 (e1 cos^2 + e2 sin^2).
  for (const double small : {0.5, 1e-2, 1e-5}) {
    const GaussianNorm norm(Eigen::Vector2d(small, 1.0));
    for (const double r : {0.05, 0.3, 1.0, 2.0, 4.0}) {
      constexpr int kPoints = 200000;
      double outside = 0.0;
      for (int i = 0; i < kPoints; ++i) {
        const double angle = (i + 0.5) / kPoints * std::numbers::pi / 2.0;
        const double size = std::pow(std::cos(angle), 2) + small * std::pow(std::sin(angle), 2);
        outside += std::exp(-r * r / (2.0 * size)) / kPoints;
      }
      EXPECT_NEAR(norm.probability(r), 1.0 - outside, 2e-7) << small << " at " << r;
    }
  }
}

TEST(CutOffInformation, FallsToNothingForANarrowPriorAndGrowsWithIt) {
  const GaussianNorm norm(Eigen::VectorXd::Constant(3, 1.0 / 3.0));
  double last = 0.0;
  for (double factor = 0.05; factor < 2.0; factor *= 1.3) {
    const double d = cut_off_information(norm, factor);
    EXPECT_GE(d, last);
    last = d;
  }
  EXPECT_LT(cut_off_information(norm, 0.05), 1e-3);
  EXPECT_GT(last, 3.0);
  EXPECT_TRUE(std::isfinite(last));
}

}  // namespace
