// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <optional>

#include <gtest/gtest.h>

#include "filter/filter_cases.hpp"
#include "trammel/filter/design_runner.hpp"
#include "trammel/filter/fading_memory_filter.hpp"
#include "trammel/filter/fixed_gain_filter.hpp"
#include "trammel/filter/rules.hpp"
#include "trammel/filter/tracker.hpp"
#include "trammel/linalg/qr.hpp"

namespace {

using namespace trammel::filter;
using trammel::RandomStream;
using trammel::test::design_of;
using trammel::test::error_of;
using trammel::test::expect_near;
using trammel::test::random_stable_gains;
using trammel::test::vec;

using One = Eigen::Matrix<double, 1, 1>;

TEST(FixedGainFilter, CoastsOverMissingSamples) {
  const std::array<std::optional<double>, 10> z{0.0,          1.1,          1.9, std::nullopt, 4.2,
                                                std::nullopt, std::nullopt, 6.9, 8.1,          9.0};
  FixedGainFilter<double, 2> filter(Eigen::Vector2d(0.5, 0.3), 1.0);
  filter.set_state(Eigen::Vector2d(0.0, 1.0));
  filter.correct(One(*z[0]));
  std::array<double, 2> hand{0.0, 1.0};
  for (std::size_t n = 1; n < z.size(); ++n) {
    filter.predict();
    hand[0] += hand[1];
    if (z[n]) {
      filter.correct(One(*z[n]));
      const double u = *z[n] - hand[0];
      hand[0] += 0.5 * u;
      hand[1] += 0.3 * u;
    }
    EXPECT_NEAR(filter.state()(0, 0), hand[0], 1e-14);
    EXPECT_NEAR(filter.state()(1, 0), hand[1], 1e-14);
    if (n == 2) {
      EXPECT_NEAR(hand[0], 1.99, 1e-12);
      EXPECT_NEAR(hand[1], 0.976, 1e-12);
    }
  }
}

template <int Order>
void expect_recursion_is_transfer_function(RandomStream& random) {
  const Eigen::VectorXd gains = random_stable_gains(random, Order);
  const double t_s = 0.3 + random.uniform();
  const FilterDesign design = design_of(Order, t_s, gains);
  FixedGainFilter<double, Order, 2> filter(gains, t_s);
  DesignRunner runner(design);
  Eigen::VectorXd input(40);
  Eigen::MatrixXd states(40, Order);
  Eigen::MatrixXd runner_states(40, Order);
  Eigen::VectorXd predictions(40);
  for (int n = 0; n < 40; ++n) {
    input[n] = random.normal();
    filter.update(Eigen::Vector2d(input[n], -2.0 * input[n]));
    predictions[n] = runner.step(input[n]);
    states.row(n) = filter.state().col(0).transpose();
    runner_states.row(n) = runner.estimate().transpose();
    EXPECT_NEAR(filter.state()(0, 1), -2.0 * filter.state()(0, 0), 1e-12);
  }
  for (int row = 0; row < Order; ++row) {
    const Eigen::VectorXd expected = response(design, row, input);
    expect_near(states.col(row), expected, 1e-12, "recursion");
    // Differences of the input grow with poles near -1, which the realisation works in.
    expect_near(runner_states.col(row), expected, 1e-10, "realisation");
  }
  expect_near(predictions, prediction_response(design, input), 1e-10, "prediction");
}

TEST(FixedGainFilter, EqualsItsTransferFunctions) {
  constexpr std::uint64_t kSeed = 101;
  RandomStream random(kSeed);
  for (int trial = 0; trial < 20; ++trial) {
    SCOPED_TRACE("seed 101, trial " + std::to_string(trial));
    expect_recursion_is_transfer_function<1>(random);
    expect_recursion_is_transfer_function<2>(random);
    expect_recursion_is_transfer_function<3>(random);
    expect_recursion_is_transfer_function<4>(random);
  }
}

TEST(DesignRunner, RunsPolynomialsFewerRowsAndThePublishedForm) {
  FilterSpecification polynomial;
  polynomial.sampling_s = 0.5;
  polynomial.a = {vec({1.0, 0.2}), vec({1.0, 0.1})};
  polynomial.b = {vec({0.6, -0.1}), vec({0.8, -0.05})};
  RandomStream random(7);
  for (const FilterDesign& design : {synthesise(polynomial), design_of(3, 0.5, vec({0.8, 0.2})),
                                     design_of(3, 0.5, vec({0.7, 0.5, 0.3}), FilterMode::kDifferences)}) {
    DesignRunner runner(design);
    Eigen::VectorXd input(50);
    Eigen::MatrixXd states(50, design.specification.rows);
    for (int n = 0; n < 50; ++n) {
      input[n] = random.normal();
      runner.step(input[n]);
      states.row(n) = runner.estimate().transpose();
    }
    for (int row = 0; row < design.specification.rows; ++row) {
      expect_near(states.col(row), response(design, row, input), 1e-12, "row " + std::to_string(row));
    }
    // At rest stays at rest, with measurements and without.
    runner.start_at_rest(5.0);
    EXPECT_NEAR(runner.step(5.0), 5.0, 1e-12);
    EXPECT_NEAR(runner.step(std::nullopt), 5.0, 1e-12);
    EXPECT_NEAR(runner.estimate()[0], 5.0, 1e-12);
  }
}

TEST(FadingMemoryFilter, EqualsDirectWeightedLeastSquares) {
  constexpr int kOrder = 3;
  constexpr std::uint64_t kSeed = 19;
  RandomStream random(kSeed);
  const double memory_s = 2.0;
  FadingMemoryFilter<double, kOrder> filter(memory_s, 1.0);
  std::vector<double> times;
  std::vector<double> values;
  double now = 0.0;
  for (int n = 0; n < 60; ++n) {
    const double dt = n == 0 ? 0.0 : 0.05 + 1.5 * random.uniform();
    now += dt;
    times.push_back(now);
    values.push_back(1e3 + random.normal());
    filter.predict(dt);
    filter.correct(One(values.back()));
    const auto rows = static_cast<Eigen::Index>(times.size());
    const Eigen::Index used = std::min<Eigen::Index>(rows, kOrder);
    Eigen::MatrixXd design(rows, used);
    Eigen::VectorXd right(rows);
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double age = now - times[static_cast<std::size_t>(i)];
      const double weight = std::exp(-0.5 * age / memory_s);
      for (Eigen::Index j = 0; j < used; ++j) {
        design(i, j) = weight * std::pow(-age, static_cast<double>(j)) / factorial(static_cast<int>(j));
      }
      right[i] = weight * values[static_cast<std::size_t>(i)];
    }
    Eigen::VectorXd expected = Eigen::VectorXd::Zero(kOrder);
    expected.head(used) = trammel::linalg::PivotedQr(design).solve(right);
    expect_near(filter.state().col(0), expected, 1e-9, "seed 19, sample " + std::to_string(n));
  }
}

TEST(FadingMemoryFilter, UniformSamplingGivesTheRulesGains) {
  constexpr int kOrder = 3;
  const double t_s = 0.5;
  const double theta = 0.8;
  FadingMemoryFilter<double, kOrder> fading(-t_s / std::log(theta), t_s);
  FadingMemoryFilter<double, kOrder> expanding(std::numeric_limits<double>::infinity(), t_s);
  for (int n = 1; n <= 100; ++n) {
    fading.predict(n == 1 ? 0.0 : t_s);
    expanding.predict(n == 1 ? 0.0 : t_s);
    fading.correct(One(1.0));
    expanding.correct(One(1.0));
    Eigen::VectorXd expected = finite_fading_memory(kOrder, n, theta);
    Eigen::VectorXd start = expanding_memory(kOrder, n);
    for (int i = 0; i < kOrder; ++i) {
      expected[i] /= factorial(i) * std::pow(t_s, i);
      start[i] /= factorial(i) * std::pow(t_s, i);
    }
    expect_near(fading.gain(), expected, 1e-10, "fading " + std::to_string(n));
    if (n >= kOrder) {
      expect_near(expanding.gain(), start, 1e-9, "expanding " + std::to_string(n));
    }
  }
}

TEST(FadingMemoryFilter, RepeatedTimesAddNoDegree) {
  FadingMemoryFilter<double, 2> filter(10.0, 1.0);
  filter.correct(One(1.0));
  filter.predict(0.0);
  filter.correct(One(3.0));
  EXPECT_EQ(filter.times(), 1);
  EXPECT_NEAR(filter.state()(0, 0), 2.0, 1e-14);
  EXPECT_NE(error_of([&] { filter.predict(-1.0); }).find("dt_s"), std::string::npos);
}

TEST(Rules, ExpandingMemoryForgetsItsInitialState) {
  for (int order = 1; order <= 4; ++order) {
    Eigen::VectorXd state = 1e3 * Eigen::VectorXd::Ones(order);
    for (int n = 1; n <= order; ++n) {
      const Eigen::VectorXd gains = expanding_memory(order, n);
      Eigen::VectorXd predicted = Eigen::VectorXd::Zero(order);
      for (int i = 0; i < order; ++i) {
        for (int j = i; j < order; ++j) {
          predicted[i] += state[j] / factorial(j - i);
        }
      }
      const double u = 0.0 - predicted[0];
      for (int i = 0; i < order; ++i) {
        state[i] = predicted[i] + gains[i] / factorial(i) * u;
      }
    }
    EXPECT_LE(state.cwiseAbs().maxCoeff(), 1e-9) << order;
  }
}

template <class Scalar>
class TrackerTest : public ::testing::Test {};
using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(TrackerTest, Scalars);

template <class Scalar>
Tracker<Scalar, 2, 3> make_tracker(const TrackerSettings& settings) {
  const Eigen::VectorXd gains = fading_memory(2, 0.7);
  const FilterAnalysis analysis = analyse(design_of(2, settings.sampling_s, gains));
  return Tracker<Scalar, 2, 3>(gains.cast<Scalar>(), static_cast<Scalar>(analysis.covariance(0, 0)),
                               static_cast<Scalar>(analysis.prediction_noise_gain), settings);
}

TYPED_TEST(TrackerTest, StartsUpCoastsAndRejects) {
  using Point = Eigen::Matrix<TypeParam, 3, 1>;
  TrackerSettings settings;
  settings.sampling_s = 0.5;
  settings.measurement_std = 1.0;
  settings.gate = 4.0;
  settings.max_rejections = 2;
  Tracker<TypeParam, 2, 3> tracker = make_tracker<TypeParam>(settings);
  const auto truth = [](int n) { return Point(TypeParam(100 + n), TypeParam(-2 * n), TypeParam(7)); };
  const TypeParam tolerance = std::is_same_v<TypeParam, float> ? TypeParam(2e-3) : TypeParam(1e-9);
  EXPECT_EQ(tracker.step(truth(0)), SampleUse::kStartUp);
  EXPECT_EQ(tracker.step(std::nullopt), SampleUse::kMissing);
  EXPECT_EQ(tracker.step(truth(2)), SampleUse::kStartUp);
  int n = 3;
  while (tracker.starting()) {
    tracker.step(truth(n++));
    ASSERT_LT(n, 40);
  }
  EXPECT_GT(n, 5) << "start-up lasts until it is as good as the steady filter";
  EXPECT_EQ(tracker.step(truth(n++)), SampleUse::kUsed);
  EXPECT_NEAR(tracker.state()(1, 0), 2.0, tolerance);
  EXPECT_NEAR(tracker.state()(1, 1), -4.0, tolerance);
  const Tracker<TypeParam, 2, 3> branch = tracker;
  // An outlier on one axis changes nothing but is reported.
  Point outlier = truth(n);
  outlier[1] += TypeParam(50);
  EXPECT_EQ(tracker.step(outlier), SampleUse::kRejected);
  ++n;
  EXPECT_NEAR(tracker.state()(0, 1), truth(n - 1)[1], TypeParam(10) * tolerance);
  EXPECT_EQ(tracker.step(Point(truth(n) * std::numeric_limits<TypeParam>::quiet_NaN())), SampleUse::kMissing);
  ++n;
  EXPECT_EQ(tracker.step(truth(n++)), SampleUse::kUsed);
  // A jump that stays is believed after max_rejections.
  const Point jump(TypeParam(1000), TypeParam(0), TypeParam(0));
  EXPECT_EQ(tracker.step(Point(truth(n++) + jump)), SampleUse::kRejected);
  EXPECT_EQ(tracker.step(Point(truth(n++) + jump)), SampleUse::kRejected);
  EXPECT_EQ(tracker.step(Point(truth(n) + jump)), SampleUse::kRestarted);
  EXPECT_NEAR(tracker.state()(0, 0), truth(n)[0] + TypeParam(1000), tolerance * TypeParam(100));
  EXPECT_FALSE(branch.starting()) << "copies are independent";
}

TYPED_TEST(TrackerTest, IrregularSamplingNeedsAMemory) {
  using Point = Eigen::Matrix<TypeParam, 3, 1>;
  TrackerSettings settings;
  Tracker<TypeParam, 2, 3> uniform = make_tracker<TypeParam>(settings);
  for (int n = 0; n < 30; ++n) {
    uniform.step(Point(Point::Constant(TypeParam(n))));
  }
  EXPECT_NE(error_of([&] { uniform.step(TypeParam(0.7), std::nullopt); }).find("dt_s"), std::string::npos);
  settings.memory_s = 5.0;
  Tracker<TypeParam, 2, 3> irregular(settings);
  TypeParam now{0};
  for (int n = 0; n < 30; ++n) {
    const TypeParam dt = n % 3 == 0 ? TypeParam(0.3) : TypeParam(1.1);
    now += dt;
    irregular.step(dt, Point(Point::Constant(TypeParam(2) * now)));
  }
  const TypeParam tolerance = std::is_same_v<TypeParam, float> ? TypeParam(2e-3) : TypeParam(1e-9);
  EXPECT_NEAR(irregular.state()(1, 2), 2.0, tolerance);
  settings.gate = -1.0;
  EXPECT_NE(error_of([&] { (void)make_tracker<TypeParam>(settings); }).find("gate"), std::string::npos);
}

TEST(Tracker, SettingsDescribeEveryField) {
  TrackerSettings settings;
  int count = 0;
  visit_fields(settings, [&](const trammel::FieldDoc&, auto&) { ++count; });
  // sampling_s, memory_s, measurement_std, gate, manoeuvre_margin, max_rejections
  EXPECT_EQ(count, 6);
  auto [a, b, c, d, e, f] = settings;  // one name per member: fails to compile when a field is added
  (void)a, (void)b, (void)c, (void)d, (void)e, (void)f;
}

}  // namespace
