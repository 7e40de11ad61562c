// SPDX-License-Identifier: Apache-2.0
#include "trammel/filter/design.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "filter/filter_cases.hpp"
#include "trammel/filter/analysis.hpp"
#include "trammel/filter/design_runner.hpp"
#include "trammel/filter/rules.hpp"

namespace {

using namespace trammel::filter;
using trammel::RandomStream;
using trammel::test::design_of;
using trammel::test::error_of;
using trammel::test::expect_near;
using trammel::test::random_stable_gains;
using trammel::test::vec;

constexpr double kTransfer = 1e-12;
constexpr double kNoise = 1e-10;
constexpr double kSteady = 1e-9;

TEST(Synthesis, AlphaBetaFilter) {
  const FilterDesign design = design_of(2, 1.0, vec({0.5, 0.3}));
  expect_near(design.denominator, vec({1.0, -1.2, 0.5}), kTransfer, "denominator");
  expect_near(design.numerators[0], vec({0.5, -0.2}), kTransfer, "coordinate");
  expect_near(design.numerators[1], vec({0.3, -0.3}), kTransfer, "velocity");
  expect_near(design.prediction_numerator, vec({0.0, 0.8, -0.5}), kTransfer, "prediction");
  const FilterAnalysis analysis = analyse(design);
  EXPECT_TRUE(analysis.stable);
  EXPECT_EQ(analysis.astatism, (std::vector<int>{2, 2}));
  expect_near(analysis.covariance.diagonal(), vec({0.481481481481481481, 0.1333333333333333}), kNoise,
              "noise");
  EXPECT_NEAR(analysis.prediction_noise_gain, 0.92592592592592593, kNoise);
  EXPECT_NEAR(analysis.error_coefficients(0, 2), 5.0 / 3.0, kSteady);
  EXPECT_NEAR(analysis.error_coefficients(1, 2), 7.0 / 6.0, kSteady);
  EXPECT_NEAR(analysis.prediction_error_coefficients[2], 10.0 / 3.0, kSteady);
  ASSERT_EQ(analysis.poles.size(), 2);
  EXPECT_NEAR(std::abs(analysis.poles[0] - std::complex<double>(0.6, -0.374165738677394)), 0.0, 1e-12);
  const Eigen::VectorXd pulse = Eigen::VectorXd::Unit(10, 0);
  expect_near(response(design, 0, pulse),
              vec({.5, .4, .23, .076, -.0238, -.06656, -.067972, -.0482864, -.02395768, -.004606016}),
              kTransfer, "pulse response");
  expect_near(response(design, 1, pulse),
              vec({.3, .06, -.078, -.1236, -.10932, -.069384, -.0286008, .00037104, .014745648, .0175092576}),
              kTransfer, "pulse response of the velocity");
}

TEST(Synthesis, AlphaBetaGammaFilter) {
  const FilterDesign design = design_of(3, 1.0, vec({0.6, 0.3, 0.1}));
  const FilterAnalysis analysis = analyse(design);
  expect_near(design.denominator, vec({1.0, -2.075, 1.525, -0.4}), kTransfer, "denominator");
  expect_near(analysis.covariance.diagonal(), vec({0.542068965517241, 0.133793103448276, 0.004137931034483}),
              1e-10, "noise");
  EXPECT_NEAR(analysis.prediction_noise_gain, 1.137931034482759, kNoise);
  expect_near(analysis.error_coefficients.col(3), vec({8.0, 9.0 + 1.0 / 12.0, 5.5}), kSteady, "errors");
  EXPECT_NEAR(analysis.prediction_error_coefficients[3], 20.0, 20 * kSteady);
}

TEST(Synthesis, PolynomialSmoothing) {
  FilterSpecification specification;
  specification.a = {vec({1.0, 0.2}), vec({1.0, 0.1})};
  specification.b = {vec({0.6, -0.1}), vec({0.8, -0.05})};
  const FilterDesign design = synthesise(specification);
  const FilterAnalysis analysis = analyse(design);
  expect_near(design.denominator, vec({1.0, -0.88, 0.224, 0.1632, 0.0004, -0.0034, -0.0002}), kTransfer,
              "denominator");
  expect_near(analysis.covariance.diagonal(), vec({0.5775697533, 0.161114248408}), 1e-9, "noise");
  EXPECT_NEAR(analysis.prediction_noise_gain, 1.150917011703, 1e-11);
  EXPECT_NEAR(analysis.error_coefficients(0, 2), 1.440476190476190, kSteady);
  EXPECT_NEAR(analysis.error_coefficients(1, 2), 1.180555555555556, kSteady);
  EXPECT_TRUE(constant_gains(specification).size() == 0);
}

TEST(Synthesis, FewerRowsThanOrder) {
  const FilterDesign design = design_of(3, 1.0, vec({0.8, 0.2}));
  const FilterAnalysis analysis = analyse(design);
  expect_near(design.denominator, vec({1.0, -1.9, 1.3, -0.2}), kTransfer, "denominator");
  expect_near(analysis.covariance.diagonal(), vec({8.0 / 11.0, 6.0 / 11.0}), kNoise, "noise");
  EXPECT_NEAR(analysis.prediction_noise_gain, 24.0 / 11.0, kNoise);
  EXPECT_EQ(analysis.astatism, (std::vector<int>{3, 3}));
  EXPECT_NEAR(analysis.error_coefficients(1, 3), 3.5833333333333333, kSteady);
  EXPECT_NEAR(analysis.prediction_error_coefficients[3], 5.0, kSteady);
}

TEST(Synthesis, AdamsBashforthWeightsAndExactnessOfThePredictor) {
  // Explicit Adams formulas: 1, 1/2, 5/12, 3/8, 251/720 in backward differences.
  const double weights[] = {1.0, 0.5, 5.0 / 12.0, 0.375, 251.0 / 720.0};
  const double sampling_s = 0.25;
  for (int order = 2; order <= 6; ++order) {
    const auto f = predictor(order, 2, sampling_s);
    Polynomial expected = Polynomial::Zero(order - 1);
    for (int l = 0; l <= order - 2; ++l) {
      expected[l] = weights[l];
    }
    expect_near(f[0][1], raise(reflect(expected), 1) * sampling_s, kTransfer, "Adams-Bashforth");
    // Exact up to degree order - 1, not at degree order.
    for (int rows = 1; rows <= order; ++rows) {
      const auto predict = predictor(order, rows, sampling_s);
      for (int degree = 0; degree <= order; ++degree) {
        double worst = 0.0;
        for (int i = 0; i < rows; ++i) {
          double value = i <= degree ? (degree == i ? 1.0 : 0.0) : 0.0;  // i-th derivative of t^m/m! at 0
          for (int j = 0; j < rows; ++j) {
            const Polynomial& entry = predict[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
            for (Eigen::Index s = 0; s < entry.size(); ++s) {
              if (j <= degree) {
                value -= entry[s] * std::pow(-sampling_s * static_cast<double>(s), degree - j) /
                         factorial(degree - j);
              }
            }
          }
          worst = std::max(worst, std::abs(value));
        }
        if (degree < order) {
          EXPECT_LE(worst, 1e-11) << order << " " << rows << " " << degree;
        } else {
          EXPECT_GE(worst, 1e-9) << order << " " << rows;
        }
      }
    }
  }
}

TEST(Synthesis, PublishedFormIsBiasedByBetaOverAlpha) {
  const double alpha = 0.5;
  const double beta = 0.3;
  const FilterDesign literal = design_of(2, 1.0, vec({alpha, beta}), FilterMode::kDifferences);
  const FilterAnalysis analysis = analyse(literal);
  expect_near(literal.denominator, vec({1.0, -2.0 * (1.0 - alpha), 1.0 - alpha}), kTransfer, "denominator");
  EXPECT_EQ(analysis.astatism, (std::vector<int>{2, 1}));
  EXPECT_NEAR(analysis.error_coefficients(1, 1), 1.0 - beta / alpha, kSteady);
  expect_near(analysis.covariance.diagonal(), vec({0.6, 0.144}), kNoise, "noise");
  EXPECT_NEAR(analysis.prediction_noise_gain, 1.4, kNoise);
  // It is the alpha-beta filter if and only if alpha = beta.
  const FilterDesign equal = design_of(2, 1.0, vec({alpha, alpha}), FilterMode::kDifferences);
  const FilterDesign filter = design_of(2, 1.0, vec({alpha, alpha}));
  expect_near(equal.denominator, filter.denominator, kTransfer, "alpha = beta");
  expect_near(equal.numerators[1], filter.numerators[1], kTransfer, "alpha = beta");
  // Stable for 0 < alpha < 4/3 only (order 2), 1/2 < alpha < 8/7 (order 3).
  const auto stable = [](int order, double gain) {
    return analyse(design_of(order, 1.0, Eigen::VectorXd::Constant(order, gain), FilterMode::kDifferences))
        .stable;
  };
  EXPECT_TRUE(stable(2, 1.333));
  EXPECT_FALSE(stable(2, 1.334));
  EXPECT_TRUE(stable(3, 0.501));
  EXPECT_FALSE(stable(3, 0.499));
  EXPECT_TRUE(stable(3, 1.142));
  EXPECT_FALSE(stable(3, 1.143));
}

TEST(Synthesis, FilteredErrorIsBTimesPredictionError) {
  // b_0(1) = 0 raises the astatism of the filtered coordinate, not that of the prediction.
  FilterSpecification specification;
  specification.a = {vec({1.0}), vec({1.0})};
  specification.b = {vec({0.5, -0.5}), vec({0.7})};
  const FilterAnalysis analysis = analyse(synthesise(specification));
  EXPECT_EQ(analysis.astatism, (std::vector<int>{3, 2}));
  EXPECT_EQ(analysis.prediction_astatism, 2);
}

TEST(Synthesis, RejectsWhatCannotBeInvariant) {
  EXPECT_NE(error_of([] { (void)design_of(2, 1.0, vec({0.5, 0.3, 0.1})); }).find("rows"), std::string::npos);
  EXPECT_NE(error_of([] { (void)design_of(2, 0.0, vec({0.5, 0.3})); }).find("sampling_s"), std::string::npos);
  EXPECT_NE(error_of([] {
              (void)design_of(2, -1.0, vec({0.5, 0.3}));
            }).find("sampling_s"),
            std::string::npos);
  EXPECT_NE(error_of([] { (void)design_of(0, 1.0, vec({0.5})); }).find("order"), std::string::npos);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(error_of([&] { (void)design_of(2, 1.0, vec({0.5, nan})); }).find("gains"), std::string::npos);
  FilterSpecification specification;
  specification.a = {vec({0.9}), vec({1.0})};
  specification.b = {vec({0.5}), vec({0.5})};
  EXPECT_NE(error_of([&] { (void)synthesise(specification); }).find("a(0)"), std::string::npos);
  specification.a.pop_back();
  EXPECT_NE(error_of([&] { (void)synthesise(specification); }).find("polynomials"), std::string::npos);
}

TEST(Analysis, UnstableFiltersHaveNoNumbers) {
  for (const auto& gains : {vec({0.9, 0.5, 0.2}), vec({0.95, 0.3})}) {
    const FilterAnalysis analysis = analyse(design_of(4, 1.0, gains));
    EXPECT_FALSE(analysis.stable);
    EXPECT_TRUE(std::isnan(analysis.covariance(0, 0)));
    EXPECT_TRUE(std::isnan(analysis.prediction_noise_gain));
    EXPECT_TRUE(std::isnan(analysis.error_coefficients(0, 4)));
  }
  EXPECT_FALSE(analyse(design_of(2, 1.0, vec({0.5, 3.0}))).stable) << "pole at z = -1";
  EXPECT_FALSE(analyse(design_of(2, 1.0, vec({0.5, 0.0}))).stable) << "pole at z = 1";
}

TEST(Analysis, StabilityRegionsAgreeWithSchurCohn) {
  constexpr std::uint64_t kSeed = 20240601;
  RandomStream random(kSeed);
  int stable = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const double alpha = 2.4 * random.uniform() - 0.2;
    const double beta = 4.4 * random.uniform() - 0.2;
    const double gamma = 6.4 * random.uniform() - 0.2;
    const bool second = alpha > 0.0 && beta > 0.0 && beta < 4.0 - 2.0 * alpha;
    const bool third = alpha > 0.0 && alpha < 2.0 && gamma > 0.0 && beta < 4.0 - 2.0 * alpha &&
                       gamma * (2.0 - alpha) < 4.0 * alpha * beta;
    const FilterDesign two = design_of(2, 1.0, vec({alpha, beta}));
    const FilterDesign three = design_of(3, 1.0, vec({alpha, beta, gamma}));
    ASSERT_EQ(is_stable(two.denominator_d), second) << "seed " << kSeed << " trial " << trial;
    ASSERT_EQ(is_stable(three.denominator_d), third) << "seed " << kSeed << " trial " << trial;
    const auto inside = [](const std::vector<double>& reflections) {
      return std::all_of(reflections.begin(), reflections.end(), [](double k) { return std::abs(k) < 1.0; });
    };
    ASSERT_EQ(inside(reflection_coefficients(three.denominator)), third) << "seed " << kSeed;
    stable += third ? 1 : 0;
  }
  EXPECT_GT(stable, 1000);
}

TEST(Analysis, LongMemoriesKeepTheirDigits) {
  // Five poles at 0.999: P(1) = 1e-15, beyond coefficients in q. Noise gains in closed form: order 2.
  for (int order = 1; order <= 6; ++order) {
    const FilterDesign design = design_of(order, 1.0, fading_memory(order, 0.999));
    EXPECT_TRUE(is_stable(design.denominator_d)) << order;
    Polynomial outside = design.denominator_d;
    outside[0] = -outside[0];
    EXPECT_FALSE(is_stable(outside)) << order;
  }
  for (const double theta : {0.3, 0.9, 0.99, 0.999}) {
    const FilterAnalysis two = analyse(design_of(2, 1.0, fading_memory(2, theta)));
    const double rest = 1.0 - theta;
    const double cube = std::pow(1.0 + theta, 3);
    expect_near(two.covariance.diagonal(),
                vec({rest * (1 + 4 * theta + 5 * theta * theta) / cube, 2 * std::pow(rest, 3) / cube}),
                kNoise, "order 2");
    EXPECT_NEAR(two.covariance(1, 1) / (2 * std::pow(rest, 3) / cube), 1.0, kNoise);
    const FilterAnalysis three = analyse(design_of(3, 1.0, fading_memory(3, theta)));
    EXPECT_NEAR(three.covariance(2, 2) / (6 * std::pow(rest, 5) / std::pow(1 + theta, 5)), 1.0, kNoise)
        << theta;
  }
}

TEST(Analysis, ClosedFormsOfAlphaBeta) {
  constexpr std::uint64_t kSeed = 77;
  RandomStream random(kSeed);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::VectorXd gains = random_stable_gains(random, 2);
    const double t = 0.1 + 3.0 * random.uniform();
    const double a = gains[0];
    const double b = gains[1];
    const FilterAnalysis analysis = analyse(design_of(2, t, gains));
    ASSERT_TRUE(analysis.stable) << "seed " << kSeed << " trial " << trial;
    const double delta = a * (4 - 2 * a - b);
    const auto check = [&](double found, double expected, double tolerance) {
      EXPECT_NEAR(found, expected, tolerance * std::max(1.0, std::abs(expected)))
          << "seed " << kSeed << " trial " << trial << " alpha " << a << " beta " << b;
    };
    check(analysis.covariance(0, 0), (2 * a * a + 2 * b - 3 * a * b) / delta, kNoise);
    check(analysis.covariance(0, 1), b * (2 * a - b) / (t * delta), kNoise);
    check(analysis.covariance(1, 1), 2 * b * b / (t * t * delta), kNoise);
    check(analysis.prediction_noise_gain, (2 * a * a + a * b + 2 * b) / delta, kNoise);
    check(analysis.error_coefficients(0, 2), (1 - a) * t * t / b, kSteady);
    check(analysis.error_coefficients(1, 2), (2 * a - b) * t / (2 * b), kSteady);
    check(analysis.prediction_error_coefficients[2], t * t / b, kSteady);
  }
}

TEST(Analysis, ClosedFormsOfAlphaBetaGamma) {
  constexpr std::uint64_t kSeed = 78;
  RandomStream random(kSeed);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::VectorXd gains = random_stable_gains(random, 3);
    const double t = 0.1 + 3.0 * random.uniform();
    const double a = gains[0];
    const double b = gains[1];
    const double g = gains[2];
    const FilterAnalysis analysis = analyse(design_of(3, t, gains));
    ASSERT_TRUE(analysis.stable) << "seed " << kSeed << " trial " << trial;
    const double delta = (4 - 2 * a - b) * (4 * a * b + a * g - 2 * g);
    const auto check = [&](double found, double expected, double tolerance) {
      EXPECT_NEAR(found, expected, tolerance * std::max(1.0, std::abs(expected)))
          << "seed " << kSeed << " trial " << trial << " gains " << gains.transpose();
    };
    check(analysis.covariance(0, 0),
          (8 * a * a * b + 2 * a * a * g - 12 * a * b * b + a * b * g - 4 * a * g + 8 * b * b) / delta,
          kNoise);
    check(analysis.covariance(1, 1), (8 * b * b * b - 4 * b * b * g + (2 - a) * g * g) / (t * t * delta),
          kNoise);
    check(analysis.covariance(2, 2), 2 * b * g * g / (std::pow(t, 4) * delta), kNoise);
    check(analysis.covariance(0, 1), b * (2 * a - b) * (4 * b - g) / (t * delta), kNoise);
    check(analysis.prediction_noise_gain,
          (8 * a * a * b + 2 * a * a * g + 4 * a * b * b + a * b * g - 4 * a * g + 8 * b * b) / delta,
          kNoise);
    check(analysis.error_coefficients(0, 3), 2 * (1 - a) * t * t * t / g, kSteady);
    check(analysis.error_coefficients(1, 3), t * t * (24 * a - 12 * b + g) / (12 * g), kSteady);
    check(analysis.error_coefficients(2, 3), t * (4 * b - g) / (2 * g), kSteady);
  }
}

TEST(Analysis, SteadyErrorsAgreeWithSimulation) {
  // x = t^(v+1)/(v+1)!: the error is eps_v t + eps_(v+1) after the transient, in every row.
  constexpr std::uint64_t kSeed = 79;
  RandomStream random(kSeed);
  for (int order = 1; order <= 4; ++order) {
    const double t = 0.5;
    const FilterDesign design = design_of(order, t, fading_memory(order, 0.3 + 0.3 * random.uniform()));
    const FilterAnalysis analysis = analyse(design);
    DesignRunner runner(design);
    constexpr int kCount = 120;
    for (int n = 0; n <= kCount; ++n) {
      runner.step(std::pow(n * t - 50.0, order + 1) / factorial(order + 1));
    }
    const double now = kCount * t - 50.0;
    for (int row = 0; row < order; ++row) {
      const double error =
          std::pow(now, order + 1 - row) / factorial(order + 1 - row) - runner.estimate()[row];
      const double expected =
          analysis.error_coefficients(row, order) * now + analysis.error_coefficients(row, order + 1);
      EXPECT_NEAR(error, expected, 1e-8 * std::max(1.0, std::abs(expected)))
          << "seed " << kSeed << " order " << order << " row " << row;
    }
  }
}

}  // namespace
