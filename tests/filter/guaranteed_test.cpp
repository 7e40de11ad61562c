// SPDX-License-Identifier: Apache-2.0
#include "trammel/filter/guaranteed_rule.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "filter/filter_cases.hpp"
#include "trammel/filter/batch_bound.hpp"
#include "trammel/filter/design_runner.hpp"
#include "trammel/filter/rules.hpp"
#include "trammel/filter/worst_case.hpp"

namespace {

using namespace trammel::filter;
using trammel::RandomStream;
using trammel::test::design_of;
using trammel::test::error_of;
using trammel::test::expect_near;
using trammel::test::random_stable_gains;
using trammel::test::vec;

TEST(WorstCase, KnownBiasesOfAlphaBeta) {
  const FilterDesign design = design_of(2, 1.0, vec({0.5, 0.3}));
  const WorstCaseBias filtered = worst_case_bias(design, {.row = 0, .predicted = false});
  EXPECT_NEAR(filtered.constant, 5.0 / 3.0, 1e-12);
  EXPECT_NEAR(filtered.piecewise_constant, 2.207650933525145, 1e-12);
  EXPECT_NEAR(filtered.arbitrary, 2.219142196254061, 1e-12);
  const WorstCaseBias predicted = worst_case_bias(design, {.row = 0, .predicted = true});
  EXPECT_NEAR(predicted.arbitrary, 4.438284392508122, 1e-12);
  const WorstCaseBias velocity = worst_case_bias(design, {.row = 1, .predicted = false});
  EXPECT_NEAR(velocity.constant, 7.0 / 6.0, 1e-12);
  EXPECT_NEAR(velocity.piecewise_constant, 2.107635953635491, 1e-12);
  EXPECT_NEAR(velocity.arbitrary, 2.1295414393993664, 1e-12);
}

TEST(WorstCase, RowsThatAreNotInvariantHaveNoBound) {
  const FilterDesign literal = design_of(2, 1.0, vec({0.5, 0.3}), FilterMode::kDifferences);
  EXPECT_TRUE(std::isinf(worst_case_bias(literal, {.row = 1, .predicted = false}).arbitrary));
  EXPECT_TRUE(std::isfinite(worst_case_bias(literal, {.row = 0, .predicted = false}).arbitrary));
  EXPECT_TRUE(std::isinf(worst_case_bias(design_of(2, 1.0, vec({0.5, 3.5})), {}).arbitrary));
}

/// x^(i)(t) of the trajectory with x^(v) = sign(s) switching at given times, from rest at -length: a sum of
/// (t - t_j)_+^(v-i)/(v-i)! with weights 2 or 1.
double trajectory(const WorstManoeuvre& worst, int order, int row, double before, double t_s) {
  const auto term = [&](double start) {
    const double elapsed = start - before;  // times count backwards from the sample, in intervals
    return elapsed > 0.0 ? std::pow(elapsed * t_s, order - row) / factorial(order - row) : 0.0;
  };
  const std::size_t count = worst.switches.size();
  double sign = count % 2 == 0 ? worst.first_sign : -worst.first_sign;
  double value = sign * term(worst.length);
  for (std::size_t i = count; i-- > 0;) {
    sign = -sign;
    value += 2.0 * sign * term(worst.switches[i]);
  }
  return value;
}

/// Runs the worst manoeuvre through the filter; returns its error at the last sample.
double simulated_error(const FilterDesign& design, FilterOutput output, const WorstManoeuvre& worst) {
  const double t_s = design.specification.sampling_s;
  const int order = design.specification.order;
  DesignRunner runner(design);
  double predicted = 0.0;
  for (int before = static_cast<int>(worst.length); before >= 0; --before) {
    predicted = runner.step(trajectory(worst, order, 0, before, t_s));
  }
  const double truth = trajectory(worst, order, output.predicted ? 0 : output.row, 0.0, t_s);
  return truth - (output.predicted ? predicted : runner.estimate()[output.row]);
}

TEST(WorstCase, IsAttainedByTheWorstManoeuvre) {
  constexpr std::uint64_t kSeed = 31;
  RandomStream random(kSeed);
  for (int trial = 0; trial < 30; ++trial) {
    const int order = 1 + trial % 3;
    const double t_s = 0.2 + random.uniform();
    // Poles of moderate memory: the trajectory grows as length^order, and with it rounding errors.
    Eigen::VectorXcd poles(order);
    for (int i = 0; i < order; ++i) {
      poles[i] = 0.7 * random.uniform();
    }
    if (order >= 2) {
      poles[0] = std::complex<double>(0.5 * random.uniform(), 0.5 * random.uniform());
      poles[1] = std::conj(poles[0]);
    }
    const FilterDesign design = design_of(order, t_s, pole_placement(poles));
    for (int output = 0; output <= order; ++output) {
      const FilterOutput what{output == order ? 0 : output, output == order};
      const double bound = worst_case_bias(design, what).arbitrary;
      const double error = simulated_error(design, what, worst_manoeuvre(design, what));
      EXPECT_NEAR(error / bound, 1.0, 1e-6) << "seed " << kSeed << " trial " << trial << " output " << output;
    }
  }
}

TEST(WorstCase, CoversFewerRowsAndPolynomials) {
  FilterSpecification specification;
  specification.a = {vec({1.0, 0.2}), vec({1.0, 0.1})};
  specification.b = {vec({0.6, -0.1}), vec({0.8, -0.05})};
  for (const FilterDesign& design : {synthesise(specification), design_of(3, 0.5, vec({0.8, 0.2}))}) {
    for (int output = 0; output <= 2; ++output) {
      const FilterOutput what{output == 2 ? 0 : output, output == 2};
      const double bound = worst_case_bias(design, what).arbitrary;
      EXPECT_NEAR(simulated_error(design, what, worst_manoeuvre(design, what)) / bound, 1.0, 1e-6) << output;
    }
  }
}

struct TableRow {
  double index;
  double alpha;
  double beta;
  double error;
  double ratio;  ///< to the best linear filter
  int samples;   ///< window in which that one fits
};

constexpr std::array<TableRow, 7> kFiltered{
    {{0.01, .253315185707, .040476459096, .246797362439, 1.0212211, 39},
     {0.03, .363800905182, .089971350683, .355864614925, 1.0193054, 27},
     {0.1, .518262, .204603, .509343, 1.0165598, 19},
     {0.3, .677425, .399434, .668659, 1.0131544, 14},
     {1.0, .838231, .741640, .832358, 1.0073283, 11},
     {3.0, .939905, 1.046030, .937745, 1.0032822, 10},
     {10.0, .990807, 1.009012, .990728, 1.0000863, 10}}};
constexpr std::array<TableRow, 7> kPredicted{
    {{0.01, .256697486544, .040499084816, .327510407526, 1.0278182, 39},
     {0.03, .371129539855, .089874881048, .552004770778, 1.0294390, 27},
     {0.1, .534847985289, .203584102156, 1.036008992686, 1.0321906, 18},
     {0.3, .707504158630, .401576437097, 2.008107855619, 1.0324693, 14},
     {1.0, .899130373814, .742501339459, 4.870439531976, 1.0244898, 11},
     {3.0, 1.0, 1.0, 14.0, 1.0, 10},
     {10.0, 1.0, 1.0, 105.0, 1.0, 9}}};

TEST(GuaranteedRule, TableOfAlphaBeta) {
  for (const bool predicted : {false, true}) {
    for (const TableRow& row : predicted ? kPredicted : kFiltered) {
      GuaranteedGoal goal;
      goal.index = row.index;
      goal.output.predicted = predicted;
      const GuaranteedGains best = guaranteed_gains(goal);
      // Table entries printed with six digits, those with more checked to 1e-9.
      EXPECT_NEAR(best.mean_square_error / row.error, 1.0, 2e-6) << row.index << predicted;
      expect_near(best.gains, vec({row.alpha, row.beta}), 2e-6, "gains");
    }
  }
}

TEST(GuaranteedRule, WithinTheRatioOfTheBestLinearFilter) {
  // Piecewise constant manoeuvres: there the batch estimate with an unbounded state is the best linear
  // filter.
  for (const bool predicted : {false, true}) {
    for (const TableRow& row : predicted ? kPredicted : kFiltered) {
      GuaranteedGoal goal;
      goal.index = row.index;
      goal.output.predicted = predicted;
      goal.manoeuvre = Manoeuvre::kPiecewiseConstant;
      const double error = guaranteed_gains(goal).mean_square_error;
      const auto solution =
          batch_bound({.order = 2, .samples = row.samples, .index = row.index, .output = goal.output});
      EXPECT_GE(error, solution.lower * (1.0 - 1e-9));
      EXPECT_NEAR(error / solution.lower, row.ratio, 1e-6) << row.index << " predicted " << predicted;
      goal.manoeuvre = Manoeuvre::kArbitrary;
      EXPECT_GE(guaranteed_gains(goal).mean_square_error, solution.lower);
    }
  }
}

TEST(BatchBound, SufficientSamplesAreEnough) {
  for (const int order : {1, 2, 3}) {
    for (const double index : {0.3, 1.0, 10.0}) {
      const int samples = sufficient_samples(order, index);
      const auto lower = [&](int count) {
        return batch_bound({.order = order, .samples = count, .index = index, .output = {}}).lower;
      };
      EXPECT_NEAR(lower(samples) / lower(samples + 8), 1.0, 1e-6) << order << " " << index;
    }
  }
  EXPECT_LE(sufficient_samples(2, 1e-300), 1000000000);
  EXPECT_NE(error_of([] { (void)sufficient_samples(2, 0.0); }).find("index"), std::string::npos);
}

TEST(GuaranteedRule, OrdersOneAndThreeAgainstTheBatchEstimate) {
  for (const int order : {1, 3}) {
    for (const double index : {0.1, 1.0}) {
      GuaranteedGoal goal;
      goal.order = order;
      goal.index = index;
      const GuaranteedGains best = guaranteed_gains(goal);
      const double lower =
          batch_bound({.order = order, .samples = 30, .index = index, .output = goal.output}).lower;
      EXPECT_GE(best.mean_square_error, lower);
      // One gain is further from the best linear filter than two or three.
      EXPECT_LE(best.mean_square_error, (order == 1 ? 1.09 : 1.02) * lower) << order << " " << index;
      // No neighbour is better, and no member of the restricted families.
      for (int i = 0; i < order; ++i) {
        for (const double factor : {0.97, 1.03}) {
          Eigen::VectorXd gains = best.gains;
          gains[i] *= factor;
          EXPECT_GE(guaranteed_error(goal, gains).mean_square_error, best.mean_square_error);
        }
      }
      goal.family = GainFamily::kCriticallyDamped;
      EXPECT_GE(guaranteed_gains(goal).mean_square_error, best.mean_square_error * (1.0 - 1e-12));
    }
  }
}

TEST(GuaranteedRule, ClosedFormsForConstantManoeuvres) {
  GuaranteedGoal goal;
  goal.manoeuvre = Manoeuvre::kConstant;
  GuaranteedGains best = guaranteed_gains(goal);
  expect_near(best.gains, vec({0.8, 0.8}), 1e-12, "index 1");
  EXPECT_NEAR(best.mean_square_error, 13.0 / 16.0, 1e-12);
  // Prediction of any order: Lambda^2 = 2^(v-1) b^(2v+1)/(2-b)^(v+1).
  for (int order = 1; order <= 3; ++order) {
    const double b = 0.7;
    goal = {.order = order,
            .index =
                std::sqrt(std::pow(2.0, order - 1) * std::pow(b, 2 * order + 1) / std::pow(2 - b, order + 1)),
            .output = {.row = 0, .predicted = true},
            .manoeuvre = Manoeuvre::kConstant,
            .family = GainFamily::kFree};
    best = guaranteed_gains(goal);
    expect_near(best.gains, minimum_noise_prediction(order, b), 1e-10, "prediction");
    const double expected =
        goal.index * goal.index / std::pow(b, 2 * order) + std::pow(1 - b / 2, -order) - 1;
    EXPECT_NEAR(best.mean_square_error, expected, 1e-10 * expected);
  }
  // Order 1: Lambda^2 = alpha^3/((1-alpha)(2-alpha)^2), prediction alpha = 1 from Lambda = 1 on.
  const double alpha = 0.4;
  goal = {};
  goal.order = 1;
  goal.index = std::sqrt(alpha * alpha * alpha / ((1 - alpha) * (2 - alpha) * (2 - alpha)));
  EXPECT_NEAR(guaranteed_gains(goal).gains[0], alpha, 1e-12);
  goal.output.predicted = true;
  goal.index = 10.0;
  EXPECT_NEAR(guaranteed_gains(goal).mean_square_error, 101.0, 1e-9);
}

TEST(GuaranteedRule, RestrictedFamilies) {
  // Critically damped kernels keep their sign: Lambda^2 = (1-theta)^5 (1+4 theta)/(theta^2 (1+theta)^4).
  const double theta = 0.6;
  GuaranteedGoal goal;
  goal.index = std::sqrt(std::pow(1 - theta, 5) * (1 + 4 * theta) / (theta * theta * std::pow(1 + theta, 4)));
  goal.family = GainFamily::kCriticallyDamped;
  expect_near(guaranteed_gains(goal).gains, fading_memory(2, theta), 1e-7, "critically damped");
  // Kalata's curve, constant manoeuvre: Lambda^2 = 2 (1-s)^5 (2+s)/(s^2 (1+s)^2).
  const double s = 0.7;
  goal.family = GainFamily::kKalata;
  goal.manoeuvre = Manoeuvre::kConstant;
  goal.index = std::sqrt(2 * std::pow(1 - s, 5) * (2 + s) / (s * s * (1 + s) * (1 + s)));
  expect_near(guaranteed_gains(goal).gains, vec({1 - s * s, 2 * (1 - s) * (1 - s)}), 1e-7, "Kalata's curve");
}

TEST(GuaranteedRule, RejectsWhatItIsNotMadeFor) {
  GuaranteedGoal goal;
  goal.order = 4;
  EXPECT_NE(error_of([&] { (void)guaranteed_gains(goal); }).find("order"), std::string::npos);
  goal.order = 2;
  goal.index = 0.0;
  EXPECT_NE(error_of([&] { (void)guaranteed_gains(goal); }).find("index"), std::string::npos);
  EXPECT_NE(error_of([] {
              (void)batch_problem({.order = 2, .samples = 1, .index = 1.0, .output = {}});
            }).find("samples"),
            std::string::npos);
}

}  // namespace
