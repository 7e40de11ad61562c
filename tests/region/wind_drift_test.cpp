// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/region/wind_drift.hpp"

namespace {

using namespace trammel::region;
using trammel::RandomStream;
using trammel::SplitMix64;

constexpr WindCorrection kCorrections[] = {WindCorrection::kNone, WindCorrection::kRandomised,
                                           WindCorrection::kKalman, WindCorrection::kLms};
constexpr WindNoise kNoises[] = {WindNoise::kUniform, WindNoise::kSwitching, WindNoise::kConstant};

/// One flight of the reference: mean deviation, steps, last estimate; rows by noise, columns by correction.
struct Flight {
  double deviation;
  int steps;
  double estimate;
};

WindResult fly_reference(double wind_step, int max_steps, WindNoise noise, WindCorrection correction,
                         bool dwell) {
  WindFlight flight;
  flight.wind_step_rad = wind_step;
  flight.max_steps = max_steps;
  SplitMix64 random(2013);
  WindDraws draws;
  draw_wind(random, flight, noise, draws);
  if (dwell) {
    DwellCorrection settings;
    settings.kind = correction;
    return fly_with_dwell(flight, settings, draws);
  }
  PrintedCorrection settings;
  settings.kind = correction;
  return fly_as_printed(flight, settings, draws);
}

void check(const Flight (&expected)[3][4], double wind_step, int max_steps, bool dwell) {
  for (int n = 0; n < 3; ++n) {
    for (int c = 0; c < 4; ++c) {
      const WindResult found = fly_reference(wind_step, max_steps, kNoises[n], kCorrections[c], dwell);
      const Flight& reference = expected[n][c];
      EXPECT_NEAR(found.mean_deviation_m, reference.deviation, 1e-12 * reference.deviation) << n << " " << c;
      EXPECT_EQ(found.steps, reference.steps);
      EXPECT_NEAR(found.estimate, reference.estimate, 1e-12 * std::max(1.0, std::abs(reference.estimate)));
      EXPECT_TRUE(found.arrived);
    }
  }
}

TEST(RegionWind, FlightsAsPrintedInRadians) {
  const Flight expected[3][4] = {{{34.92439374403062, 176, 0.0},
                                  {32.47178844399261, 176, -0.103116587719432},
                                  {61.89610841840724, 181, 0.6025630752511332},
                                  {60.39253973043867, 179, -0.3720862701379597}},
                                 {{34.92439374403062, 176, 0.0},
                                  {62.4473466397564, 176, -0.07785096032305784},
                                  {82.62666109913886, 182, -4.7592588695527},
                                  {140.4416884759004, 183, 6.816576984060907}},
                                 {{34.92439374403062, 176, 0.0},
                                  {95.29795466999109, 177, -0.3375896911841716},
                                  {156.65038635236638, 182, -194.99368601442995},
                                  {239.3148546941929, 183, -126.22722101047391}}};
  check(expected, 8.0, 250, false);
}

TEST(RegionWind, FlightsAsPrintedInDegrees) {
  const Flight expected[3][4] = {{{245.2840223055653, 176, 0.0},
                                  {261.4575254350466, 176, -0.161023577920802},
                                  {67.48189331356154, 180, 9.335614081172471},
                                  {65.19655970252515, 179, 2.7285083338828433}},
                                 {{245.2840223055653, 176, 0.0},
                                  {267.1209207970454, 176, 0.05279188243465476},
                                  {454.3007208277015, 182, 117.03260730962808},
                                  {467.18586298784464, 183, 85.84351802079372}},
                                 {{245.2840223055653, 176, 0.0},
                                  {298.83452630751344, 176, -0.19767962978219125},
                                  {688.4522896908122, 184, -38.14441293096968},
                                  {674.5790522243449, 184, -25.578624315745564}}};
  check(expected, 8.0 * std::numbers::pi / 180.0, 250, false);
}

TEST(RegionWind, FlightsWithDwell) {
  const Flight expected[3][4] = {{{245.2840223055653, 176, 0.0},
                                  {106.17796928030228, 185, 5.418113035307972},
                                  {76.11929842023075, 179, 5.932600245634099},
                                  {94.12482158094788, 178, 6.114626727255413}},
                                 {{245.2840223055653, 176, 0.0},
                                  {153.22780664550186, 163, 5.004114735205726},
                                  {357.0406883451239, 185, 16.421977729721096},
                                  {351.29649713554716, 184, 15.12232821345997}},
                                 {{245.2840223055653, 176, 0.0},
                                  {265.29622480264794, 161, 1.4428597989803886},
                                  {794.895750723814, 185, -3.0498495762031412},
                                  {798.5203613985682, 186, -3.2786289965319062}}};
  check(expected, 8.0 * std::numbers::pi / 180.0, 260, true);
}

/// Every state of the first steps of one flight.
TEST(RegionWind, FirstSteps) {
  WindFlight flight;
  flight.wind_step_rad = 8.0;
  SplitMix64 random(2013);
  WindDraws draws;
  draw_wind(random, flight, WindNoise::kUniform, draws);
  PrintedCorrection settings;
  settings.kind = WindCorrection::kKalman;
  std::vector<WindStep> path;
  (void)fly_as_printed(flight, settings, draws, &path);
  const double expected[3][5] = {
      {0.0, -1.718477424233777, 0.0, 28.802370781291653, 27.76617171363215},
      {0.0, 8.498971365363285, -1.1766190270960295, 47.324412054685446, 65.81063882195369},
      {-0.3231594918235884, -9.200805297493831, 0.09834469570331317, 88.14006807439964, 78.58301627024066}};
  for (std::size_t t = 0; t < 3; ++t) {
    EXPECT_NEAR(path[t].course_rad, expected[t][0], 1e-12);
    EXPECT_NEAR(path[t].residual, expected[t][1], 1e-12);
    EXPECT_NEAR(path[t].estimate, expected[t][2], 1e-12);
    EXPECT_NEAR(path[t].x_m, expected[t][3], 1e-10);
    EXPECT_NEAR(path[t].y_m, expected[t][4], 1e-10);
  }
}

/// Mean and standard deviation of the published statistic, from 20000 (dwell: 8000) flights elsewhere.
struct Target {
  double mean;
  double sd;
};

void check_means(const Target (&targets)[3][4], double wind_step, int max_steps, bool dwell,
                 double reference_flights, double (&means)[3][4]) {
  constexpr int kFlights = 800;
  WindFlight flight;
  flight.wind_step_rad = wind_step;
  flight.max_steps = max_steps;
  WindDraws draws;
  for (int n = 0; n < 3; ++n) {
    for (int c = 0; c < 4; ++c) {
      double sum = 0.0;
      for (int k = 0; k < kFlights; ++k) {
        RandomStream random(4711, static_cast<std::uint64_t>(k));
        draw_wind(random, flight, kNoises[n], draws);
        PrintedCorrection printed;
        printed.kind = kCorrections[c];
        DwellCorrection with_dwell;
        with_dwell.kind = kCorrections[c];
        sum += (dwell ? fly_with_dwell(flight, with_dwell, draws) : fly_as_printed(flight, printed, draws))
                   .mean_deviation_m;
      }
      means[n][c] = sum / kFlights;
      const Target& target = targets[n][c];
      EXPECT_NEAR(means[n][c], target.mean,
                  4.0 * target.sd / std::sqrt(kFlights) + target.sd / std::sqrt(reference_flights))
          << "seed 4711, noise " << n << ", correction " << c;
    }
  }
}

TEST(RegionWind, MeansAsPrintedInRadians) {
  const Target targets[3][4] = {{{46.57, 19.98}, {51.08, 23.11}, {25.72, 10.0}, {25.81, 9.92}},
                                {{46.57, 19.98}, {58.9, 28.68}, {99.17, 36.76}, {111.71, 39.07}},
                                {{46.57, 19.98}, {59.75, 29.04}, {197.83, 61.79}, {231.17, 62.94}}};
  double means[3][4];
  check_means(targets, 8.0, 250, false, 20000.0, means);
  EXPECT_GT(means[2][2] / means[0][2], 5.0);
  EXPECT_GT(means[2][3] / means[0][3], 6.0);
  EXPECT_GT(means[1][2] / means[0][2], 2.5);
  EXPECT_GT(means[1][3] / means[0][3], 3.0);
  for (int n = 0; n < 3; ++n) {
    EXPECT_GE(means[n][1] / means[0][1], 0.9);
    EXPECT_LE(means[n][1] / means[0][1], 1.35);
    EXPECT_NEAR(means[n][1] / means[n][0], 1.0, 0.35);  // (14) carries no information
  }
}

TEST(RegionWind, MeansAsPrintedInDegrees) {
  const Target targets[3][4] = {{{209.9, 114.39}, {210.91, 115.4}, {40.27, 30.1}, {36.09, 25.21}},
                                {{209.9, 114.39}, {211.77, 116.65}, {331.24, 148.59}, {326.91, 146.22}},
                                {{209.9, 114.39}, {212.32, 116.73}, {377.51, 221.36}, {383.42, 225.42}}};
  double means[3][4];
  check_means(targets, 8.0 * std::numbers::pi / 180.0, 250, false, 20000.0, means);
}

TEST(RegionWind, MeansWithDwell) {
  const Target targets[3][4] = {{{211.55, 115.58}, {110.81, 53.32}, {30.53, 13.62}, {45.49, 18.81}},
                                {{211.55, 115.58}, {136.73, 75.8}, {267.64, 90.2}, {260.85, 90.35}},
                                {{211.55, 115.58}, {136.43, 76.9}, {580.16, 186.71}, {581.22, 188.46}}};
  double means[3][4];
  check_means(targets, 8.0 * std::numbers::pi / 180.0, 260, true, 8000.0, means);
}

/// E[Delta epsilon | wind, noise] of (14) is a beta cos(ubar) sin(beta), whatever wind and noise are.
TEST(RegionWind, PrintedCorrectionIsBlind) {
  constexpr double kBeta = 0.01;
  for (const double wind : {-1.5, 0.0, 1.5}) {
    for (const double noise : {-10.0, 0.0, 10.0}) {
      double change = 0.0;
      for (const double sign : {-1.0, 1.0}) {
        WindFlight flight;
        flight.max_steps = 1;
        const WindDraws draws{Eigen::VectorXd::Constant(2, wind), Eigen::VectorXd::Constant(1, noise),
                              Eigen::VectorXd::Constant(1, sign)};
        change += fly_as_printed(flight, PrintedCorrection{}, draws).estimate / 2.0;
      }
      EXPECT_NEAR(change, -0.1 * 20.0 * kBeta * std::sin(kBeta), 1e-15);
    }
  }
}

TEST(RegionWind, WrongUseNamesTheMember) {
  WindFlight flight;
  flight.wind_speed_mps = 30.0;
  EXPECT_THROW(validate(flight), trammel::Error);
  flight = {};
  flight.interval_s = std::nan("");
  EXPECT_THROW(validate(flight), trammel::Error);
  EXPECT_THROW((void)fly_as_printed(WindFlight{}, {}, WindDraws{}), trammel::Error);
}

}  // namespace
