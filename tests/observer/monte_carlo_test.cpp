// SPDX-License-Identifier: Apache-2.0
#include "trammel/observer/monte_carlo.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "cases.hpp"
#include "trammel/core/error.hpp"

namespace {

using trammel::observer::BearingKind;
using trammel::observer::FilterKind;
using trammel::observer::FlightLoop;
using trammel::observer::FlightSettings;
using trammel::observer::MonteCarloResult;
using trammel::observer::MonteCarloSettings;
using trammel::observer::simulate;

FlightLoop paper_loop(double beta, FlightSettings settings = {}) {
  return {trammel::test::paper_problem({-10000, 50, -100}, trammel::test::kPaperCovariance, 80, {beta, 0, 0}),
          settings};
}

MonteCarloSettings paper_runs(std::int64_t runs) {
  return {.runs = runs, .seed = 2026, .max_start_x_m = -8000.0};
}

struct Band {
  double mean;
  double deviation;  // of the result of 5000 runs, from 24 independent ones
};

struct PaperRow {
  double beta;
  Band error, error_sd, rms, miss, miss_sd, effort, effort_sd;
  std::array<double, 7> spread;  // S_x at 10, 20, ..., 70 s from 20000 runs
};

const std::vector<PaperRow> kRows{{1e-6,
                                   {3.458, 1.9754},
                                   {150.2325, 2.3623},
                                   {145.1535, .7707},
                                   {.9478, .0118},
                                   {.6535, .0096},
                                   {149.9322, .4932},
                                   {28.0457, .2459},
                                   {727, 727, 723, 693, 616, 479, 302}},
                                  {0.1,
                                   {3.3466, .8153},
                                   {62.8976, .8218},
                                   {60.9869, .2139},
                                   {.6679, .0085},
                                   {.4091, .0072},
                                   {180.7992, .4084},
                                   {23.3269, .2274},
                                   {716, 689, 628, 558, 516, 428, 161}},
                                  {10,
                                   {1.0565, .285},
                                   {21.1025, .2961},
                                   {20.879, .0701},
                                   {.5871, .006},
                                   {.3395, .0044},
                                   {540.7831, 1.8545},
                                   {147.8852, 1.4781},
                                   {653, 447, 274, 183, 141, 106, 48.7}}};

void expect_in_band(double value, const Band& band, const char* what) {
  EXPECT_NEAR(value, band.mean, 3.0 * band.deviation) << what;
}

class PaperTable : public testing::TestWithParam<PaperRow> {};

TEST_P(PaperTable, StatisticsAreInsideTheirBands) {
  const PaperRow& row = GetParam();
  const MonteCarloResult result = simulate(paper_loop(row.beta), paper_runs(5000));
  expect_in_band(result.error.mean, row.error, "mean error");
  expect_in_band(result.error.deviation, row.error_sd, "sd error");
  expect_in_band(result.rms_predicted_m, row.rms, "rms predicted");
  expect_in_band(result.miss.mean, row.miss, "miss");
  expect_in_band(result.miss.deviation, row.miss_sd, "sd miss");
  expect_in_band(result.effort.mean, row.effort, "effort");
  expect_in_band(result.effort.deviation, row.effort_sd, "sd effort");
  EXPECT_NEAR(result.median_nees, 2.42, 0.16);
  for (std::size_t i = 0; i < row.spread.size(); ++i) {
    const double time = 10.0 * static_cast<double>(i + 1);
    const auto nearest = std::min_element(
        result.spread.begin(), result.spread.end(),
        [&](const auto& a, const auto& b) { return std::abs(a.time_s - time) < std::abs(b.time_s - time); });
    EXPECT_NEAR(nearest->sd_error_x_m, row.spread[i], 0.08 * row.spread[i]) << time;
  }
  EXPECT_EQ(result.spread.front().time_s, 0.0);
  EXPECT_EQ(result.spread.back().time_s, 80.0);
  EXPECT_NEAR(result.spread.back().sd_error_x_m, result.error.deviation, 1e-6 * result.error.deviation);
}

INSTANTIATE_TEST_SUITE_P(Rows, PaperTable, testing::ValuesIn(kRows));

TEST(MonteCarlo, SameBitsForAnyNumberOfThreads) {
  const FlightLoop loop = paper_loop(0.1);
  MonteCarloSettings settings = paper_runs(300);
  settings.threads = 1;
  const MonteCarloResult one = simulate(loop, settings);
  for (const unsigned threads : {2U, 5U}) {
    settings.threads = threads;
    const MonteCarloResult many = simulate(loop, settings);
    EXPECT_EQ(one.error_x_m, many.error_x_m);
    EXPECT_EQ(one.effort_m, many.effort_m);
    EXPECT_EQ(one.error.deviation, many.error.deviation);
    for (std::size_t i = 0; i < one.spread.size(); ++i) {
      EXPECT_EQ(one.spread[i].sd_error_x_m, many.spread[i].sd_error_x_m);
      EXPECT_EQ(one.spread[i].rms_predicted_x_m, many.spread[i].rms_predicted_x_m);
    }
  }
  settings.seed += 1;
  EXPECT_NE(one.error_x_m, simulate(loop, settings).error_x_m);
}

TEST(MonteCarlo, ARunDoesNotDependOnHowManyThereAre) {
  const FlightLoop loop = paper_loop(10.0);
  const MonteCarloResult few = simulate(loop, paper_runs(10));
  const MonteCarloResult more = simulate(loop, paper_runs(100));
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(few.error_x_m[i], more.error_x_m[i]);
  }
  ASSERT_EQ(few.paths.size(), 10U);
  EXPECT_EQ((few.paths[3].estimate_m.back() - few.paths[3].truth_m.back()).x(), few.error_x_m[3]);
}

TEST(MonteCarlo, TellsProgressInOrder) {
  double last = 0.0;
  int calls = 0;
  MonteCarloSettings settings = paper_runs(640);
  settings.threads = 1;
  (void)simulate(paper_loop(0.1), settings, [&](const trammel::Progress& progress) {
    EXPECT_GE(progress.fraction, last);
    last = progress.fraction;
    ++calls;
  });
  EXPECT_EQ(last, 1.0);
  EXPECT_EQ(calls, 10);
}

TEST(MonteCarlo, AnglesAndTheGridFilterComeClose) {
  const MonteCarloResult tangents = simulate(paper_loop(10.0), paper_runs(400));
  FlightSettings settings;
  settings.measured = BearingKind::kAngles;
  const MonteCarloResult angles = simulate(paper_loop(10.0, settings), paper_runs(400));
  EXPECT_NEAR(angles.error.deviation, tangents.error.deviation, 0.05 * tangents.error.deviation);
  settings = {};
  settings.filter = FilterKind::kRangeGrid;
  const MonteCarloResult exact = simulate(paper_loop(10.0, settings), paper_runs(400));
  EXPECT_NEAR(exact.error.deviation, tangents.error.deviation, 0.06 * tangents.error.deviation);
  EXPECT_NEAR(exact.median_nees, 2.37, 0.35);
}

TEST(MonteCarlo, RejectsWhatItCannotDraw) {
  MonteCarloSettings settings = paper_runs(10);
  settings.max_start_x_m = -20000.0;
  EXPECT_THROW((void)simulate(paper_loop(1.0), settings), trammel::Error);
  settings = paper_runs(0);
  EXPECT_THROW((void)simulate(paper_loop(1.0), settings), trammel::Error);
  settings = paper_runs(10);
  settings.max_start_x_m = std::nan("");
  EXPECT_THROW((void)simulate(paper_loop(1.0), settings), trammel::Error);
}

TEST(MonteCarlo, OneRunHasNoDeviation) {
  const MonteCarloResult result = simulate(paper_loop(1.0), paper_runs(1));
  EXPECT_TRUE(std::isfinite(result.error.mean));
  EXPECT_TRUE(std::isnan(result.error.deviation));
}

TEST(MonteCarlo, Quantiles) {
  EXPECT_EQ(trammel::observer::quantile({3.0, 1.0, 2.0}, 0.5), 2.0);
  EXPECT_EQ(trammel::observer::quantile({1.0, 2.0}, 0.25), 1.25);
  EXPECT_TRUE(std::isnan(trammel::observer::quantile({}, 0.5)));
}

}  // namespace
