// SPDX-License-Identifier: Apache-2.0
// The published claim of an exact level (Amelin 2013, theorem 1) is wrong: exact counterexamples.
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "example_data.hpp"
#include "trammel/region/lscr.hpp"

namespace {

using namespace trammel::region;

/// All non-empty subsets of {0, ..., length - 1}.
BinaryStrings all_subsets(int length) {
  BinaryStrings strings;
  strings.resize((1 << length) - 1, length);
  for (int j = 0; j < strings.count(); ++j) {
    strings.row(j)[0] = static_cast<std::uint64_t>(j) + 1;
  }
  return strings;
}

/// Plant y_t = a0 y_{t-1} + u_{t-1} + v_t, one probe per sample, no feedback, everything in units of 10^-6:
/// integers, so that signs of sums are exact.
struct RationalCase {
  std::int64_t a0_tenths = 0;
  std::vector<std::int64_t> noise_hundredths;
};

/// Number of sign vectors, of 2^N, for which at least q subset sums are positive and q negative.
struct ExactCounts {
  std::vector<int> published;  ///< per q, from 1
  std::vector<int> full;
};

ExactCounts enumerate_exactly(const RationalCase& item) {
  const auto length = static_cast<int>(item.noise_hundredths.size());
  const int subsets = 1 << length;
  ExactCounts result{std::vector<int>(static_cast<std::size_t>(subsets / 2)),
                     std::vector<int>(static_cast<std::size_t>(subsets / 2))};
  for (int signs = 0; signs < subsets; ++signs) {
    std::vector<std::int64_t> published;
    std::vector<std::int64_t> full;
    std::int64_t y = 0;
    for (int t = 0; t < length; ++t) {
      const std::int64_t sign = (signs >> t & 1) != 0 ? 1 : -1;
      const std::int64_t v = item.noise_hundredths[static_cast<std::size_t>(t)] * 10000;
      const std::int64_t memory = item.a0_tenths * y;
      EXPECT_EQ(memory % 10, 0) << "the unit is too coarse for exact arithmetic";
      // The residual of the published form contains a0 y_{t-1}, that of the plant equation does not.
      published.push_back(sign * (v + memory / 10));
      full.push_back(sign * v);
      y = memory / 10 + sign * 1000000 + v;
    }
    const auto count = [&](const std::vector<std::int64_t>& terms, std::vector<int>& hits) {
      int positive = 0;
      int negative = 0;
      for (int subset = 1; subset < subsets; ++subset) {
        std::int64_t sum = 0;
        for (int t = 0; t < length; ++t) {
          sum += (subset >> t & 1) != 0 ? terms[static_cast<std::size_t>(t)] : 0;
        }
        EXPECT_NE(sum, 0) << "a tie";
        positive += sum > 0 ? 1 : 0;
        negative += sum < 0 ? 1 : 0;
      }
      for (int q = 1; q <= subsets / 2; ++q) {
        hits[static_cast<std::size_t>(q - 1)] += positive >= q && negative >= q ? 1 : 0;
      }
    };
    count(published, result.published);
    count(full, result.full);
  }
  return result;
}

/// The same counts through the library.
ExactCounts enumerate_by_library(const RationalCase& item) {
  const auto length = static_cast<int>(item.noise_hundredths.size());
  const BinaryStrings strings = all_subsets(length);
  const std::vector<char> ties(static_cast<std::size_t>(strings.count()), 0);
  const double a0 = static_cast<double>(item.a0_tenths) / 10.0;
  const Plant plant{
      .a = Eigen::VectorXd::Constant(1, -a0), .b = Eigen::VectorXd::Constant(1, 1.0), .delay = 1};
  const PlantModel model{.a = {std::nullopt}, .b = {std::nullopt}, .delay = 1};
  ExactCounts result{std::vector<int>(static_cast<std::size_t>(strings.count() + 1) / 2),
                     std::vector<int>(static_cast<std::size_t>(strings.count() + 1) / 2)};
  ProbedRecord record;
  record.period = 1;
  record.probe.resize(length);
  ProbedResiduals residuals;
  LscrRegion region;
  for (int signs = 0; signs <= strings.count(); ++signs) {
    for (int t = 0; t < length; ++t) {
      record.probe(t) = (signs >> t & 1) != 0 ? 1.0 : -1.0;
    }
    simulate_loop(
        plant, [](const LoopView&) { return 0.0; },
        [&](const LoopView& view) {
          return static_cast<double>(item.noise_hundredths[static_cast<std::size_t>(view.time)]) / 100.0;
        },
        record);
    for (int q = 1; 2 * q <= strings.count() + 1; ++q) {
      prediction_residuals(model, record, KnownTerms::kOnce, residuals);
      region.assign(residuals, strings, ties, q, ResidualForm::kPrediction);
      result.published[static_cast<std::size_t>(q - 1)] +=
          region.contains(Eigen::VectorXd::Constant(1, 1.0)) ? 1 : 0;
      plant_residuals(model, record, 0, {}, residuals);
      region.assign(residuals, strings, ties, q, ResidualForm::kPlant);
      result.full[static_cast<std::size_t>(q - 1)] += region.contains(Eigen::Vector2d(-a0, 1.0)) ? 1 : 0;
    }
  }
  return result;
}

void check_case(const RationalCase& item, const std::vector<int>& published) {
  const ExactCounts exact = enumerate_exactly(item);
  EXPECT_EQ(exact.published, published);
  const int members = 1 << item.noise_hundredths.size();
  for (int q = 1; 2 * q <= members; ++q) {
    EXPECT_EQ(exact.full[static_cast<std::size_t>(q - 1)], members - 2 * q) << "level 1 - 2q/M";
  }
  const ExactCounts library = enumerate_by_library(item);
  EXPECT_EQ(library.published, exact.published);
  EXPECT_EQ(library.full, exact.full);
}

/// Of the 2^N sign vectors, for q = 1, 2, ...: how many have the truth in the region.
TEST(RegionTheorem, RationalCounterexample) {
  RationalCase item;
  item.noise_hundredths = {100, 110, 123};
  item.a0_tenths = -9;
  check_case(item, {6, 5, 4, 0});  // q = 2: 5/8 instead of the claimed 1/2
  item.a0_tenths = 9;
  check_case(item, {6, 4, 2, 0});
  item.noise_hundredths.push_back(131);
  check_case(item, {14, 12, 10, 8, 6, 4, 1, 0});  // q = 7: 1/16 instead of 1/8
  item.a0_tenths = -9;
  check_case(item, {14, 14, 12, 11, 7, 3, 2, 0});  // q = 6: 3/16 instead of 1/4
}

double binomial_log(int n, int k) {
  return std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0);
}

/// Probability that of `drawn` different strings from `total`, `positive` of which have positive sums, at
/// least q are positive and at least q are not.
double draw_probability(int total, int positive, int drawn, int q) {
  double sum = 0.0;
  for (int k = q; k <= drawn - q; ++k) {
    if (k <= positive && drawn - k <= total - positive) {
      sum += std::exp(binomial_log(positive, k) + binomial_log(total - positive, drawn - k) -
                      binomial_log(total, drawn));
    }
  }
  return sum;
}

/// Exact coverage of the second-order example with eight probes, by all 256 sign vectors and all draws of
/// strings.
TEST(RegionTheorem, EnumerationOnTheExamplePlant) {
  constexpr int kProbes = 8;
  const BinaryStrings strings = all_subsets(kProbes);
  const std::vector<char> ties(static_cast<std::size_t>(strings.count()), 0);
  LinearFeedback none;
  LinearFeedback dead_beat;
  LinearFeedback placed;
  PolePlacement placement;
  ASSERT_TRUE(placement.place(trammel::test::example_plant(), {}, dead_beat));
  ASSERT_TRUE(placement.place(trammel::test::example_plant(), repeated_pole(0.5, 3), placed));
  const struct {
    const LinearFeedback& feedback;
    int members;
    int q;
    double published[2];
  } cases[] = {{none, 16, 1, {0.8746574246611805, 0.8726343169695024}},
               {none, 8, 2, {0.49744561034442075, 0.49554150832400723}},
               {dead_beat, 16, 1, {0.8650508540981583, 0.870935254938233}},
               {dead_beat, 16, 4, {0.48894249293977093, 0.4911231385632182}},
               {placed, 16, 1, {0.8621954764487836, 0.8575971893263684}},
               {placed, 4, 1, {0.48271407480314965, 0.48319679249652614}}};
  for (const auto& item : cases) {
    double published[2] = {0.0, 0.0};
    double full[2] = {0.0, 0.0};
    for (int signs = 0; signs < 256; ++signs) {
      ProbedRecord record;
      record.period = 2;
      record.probe.resize(kProbes);
      for (int n = 0; n < kProbes; ++n) {
        record.probe(n) = ((signs >> n & 1) != 0 ? 1.0 : -1.0) * (1.0 + 0.01 * std::sqrt(n + 1.0));
      }
      simulate_loop(
          trammel::test::example_plant(), item.feedback,
          [](const LoopView& view) { return 1.0 + 0.013 * std::sqrt(view.time + 1.0); }, record);
      ProbedResiduals residuals;
      LscrRegion region;
      for (int channel = 0; channel < 2; ++channel) {
        prediction_residuals(trammel::test::example_model(), record, KnownTerms::kOnce, residuals);
        region.assign(residuals, strings, ties, 1, ResidualForm::kPrediction);
        published[channel] +=
            draw_probability(255, region.counts(channel, Eigen::Vector2d(1.0, 3.6)).positive,
                             item.members - 1, item.q) /
            256.0;
        plant_residuals(trammel::test::example_model(), record, 0, {}, residuals);
        region.assign(residuals, strings, ties, 1, ResidualForm::kPlant);
        full[channel] += draw_probability(255, region.counts(channel, Eigen::Vector2d(-2.0, 1.0)).positive,
                                          item.members - 1, item.q) /
                         256.0;
      }
    }
    for (int channel = 0; channel < 2; ++channel) {
      EXPECT_NEAR(published[channel], item.published[channel], 1e-11);
      EXPECT_NEAR(full[channel], 1.0 - 2.0 * item.q / item.members, 1e-11);
    }
  }
}

}  // namespace
