// SPDX-License-Identifier: Apache-2.0
// Stated values beside actual errors over draws of the noise (the full study is bench/localise_study.cpp).
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "localise/reference_cases.hpp"
#include "trammel/estimate/simulate_measurements.hpp"
#include "trammel/localise/locate.hpp"

namespace {

using namespace trammel;

/// A path given by its position alone, for sensors that do not measure velocity.
struct Path {
  Eigen::Vector3d (*place)(double);

  [[nodiscard]] Eigen::Vector3d position(double t) const { return place(t); }
  [[nodiscard]] static Eigen::Vector3d velocity(double /*t*/) { return Eigen::Vector3d::Zero(); }
  [[nodiscard]] static bool covers(double /*t*/) { return true; }
};

/// What a number of draws showed.
struct Draws {
  std::vector<double> stated, looseness;
  double squares = 0.0;  ///< of actual errors, m^2
  double ratios = 0.0;   ///< of squares of actual over stated
  int flagged = 0;
  int gross_unflagged = 0;

  [[nodiscard]] double count() const { return static_cast<double>(stated.size()); }
  [[nodiscard]] double Q() const { return std::sqrt(ratios / count()); }
  [[nodiscard]] double rms() const { return std::sqrt(squares / count()); }
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Draws draw(Scenario scenario, const Path& truth, const localise::LocateSettings& settings, int count,
           std::uint64_t first_seed) {
  constexpr double kGross_m = 800.0;
  constexpr int kTimes = 350;
  const double begin = scenario.knots_s.front();
  const double length = scenario.knots_s.back() - begin;
  Draws result;
  for (int k = 0; k < count; ++k) {
    scenario.observations.clear();
    scenario.observations =
        estimate::simulate_measurements(scenario, truth, first_seed + static_cast<std::uint64_t>(k));
    const localise::Location found = localise::locate(scenario, settings);
    const localise::StatedValue& stated = found.branches.at(0).stated.value();
    const auto deviation = stated.problem.coordinates.spline(stated.z);
    double square = 0.0;
    for (int i = 0; i <= kTimes; ++i) {
      const double t = begin + length * i / kTimes;
      square +=
          (stated.problem.nominal.position(t) + deviation.position(t) - truth.position(t)).squaredNorm() /
          (kTimes + 1);
    }
    const bool flagged = found.status == localise::LocateStatus::kAmbiguous;
    result.squares += square;
    result.ratios += square / (stated.stated_rms_m * stated.stated_rms_m);
    result.stated.push_back(stated.stated_rms_m);
    result.looseness.push_back(stated.stated_rms_m / std::sqrt(square));
    result.flagged += flagged ? 1 : 0;
    result.gross_unflagged += !flagged && square > kGross_m * kGross_m ? 1 : 0;
  }
  return result;
}

localise::LocateSettings above(std::optional<double> floor_m) {
  localise::LocateSettings settings;
  settings.minimum_height_m = floor_m;
  return settings;
}

TEST(Honesty, CoversTheDescentAboveAFloor) {
  const Draws draws = draw(zoo::manoeuvre_scenario(7, 1.0), {test::descent}, above(0.0), 40, 5000);
  EXPECT_LE(draws.Q(), 0.75);
  EXPECT_GE(draws.Q(), 0.3);  // a value that covers because it is far too large is no success
  EXPECT_LE(median(draws.stated) / draws.rms(), 2.2);
  EXPECT_EQ(draws.gross_unflagged, 0);
}

TEST(Honesty, FlagsDescentsWithoutAFloor) {
  const Draws draws = draw(zoo::manoeuvre_scenario(7, 1.0), {test::descent}, above(std::nullopt), 12, 52);
  EXPECT_EQ(draws.gross_unflagged, 0);
  EXPECT_GE(draws.flagged, 8);
}

TEST(Honesty, IsTightWhereAnglesAreMeasured) {
  Scenario scenario = test::turn_by_radar();
  const Draws draws = draw(scenario, {test::turn}, above(std::nullopt), 15, 1);
  EXPECT_EQ(draws.flagged, 0);
  EXPECT_LE(draws.Q(), 1.0);
  EXPECT_LE(median(draws.looseness), 3.5);
}

TEST(Honesty, CoversATurnSeenByRanges) {
  constexpr double kJerk_mps3 = 2000.0 * 0.06 * 0.06 * 0.06;  // of the circle
  localise::LocateSettings settings = above(0.0);
  settings.model_error = localise::model_error_from_jerk(kJerk_mps3, 5.0);
  const Draws draws = draw(test::turn_by_ranges(), {test::turn}, settings, 15, 100);
  EXPECT_EQ(draws.flagged, 0);
  EXPECT_LE(draws.Q(), 1.0);
}

}  // namespace
