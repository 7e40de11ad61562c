// SPDX-License-Identifier: Apache-2.0
// Measurements at odds with every motion within the bounds: found also when many hide one another; sound
// ones are kept; the worst case is the one that the formulas promise.
#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "localise/reference_cases.hpp"
#include "trammel/core/random.hpp"
#include "trammel/localise/outliers.hpp"

namespace {

using namespace trammel;

constexpr std::uint64_t kSeed = 909;

/// Replaces the reference cases' deterministic noise by normal one.
Scenario with_normal_noise(Scenario scenario, RandomStream& stream) {
  for (Measurement& m : scenario.observations) {
    const Station& station = scenario.stations[m.station];
    const sensor::Padded exact =
        sensor::measure(station.kind, test::turn(m.t_s) - station.position_m, Eigen::Vector3d::Zero());
    const Eigen::Matrix3d lower = noise_factor(station.covariance, components(station.kind), "station");
    const Eigen::Vector3d w(stream.normal(), stream.normal(), stream.normal());
    m.value = sensor::unpadded(sensor::difference(station.kind, exact + lower * w, sensor::Padded::Zero()),
                               components(station.kind));
  }
  return scenario;
}

std::set<std::size_t> indices(const localise::OutlierSearch& search) {
  std::set<std::size_t> result;
  for (const localise::RejectedMeasurement& rejected : search.rejected) {
    result.insert(rejected.observation);
  }
  return result;
}

TEST(Outliers, SoundMeasurementsAreKept) {
  RandomStream stream(kSeed);
  for (int run = 0; run < 5; ++run) {
    for (const Scenario& clean : {test::turn_by_radar(), test::turn_by_ranges()}) {
      const localise::OutlierSearch search = localise::find_outliers(with_normal_noise(clean, stream));
      EXPECT_TRUE(search.rejected.empty()) << "run " << run;
      EXPECT_EQ(search.tested, clean.observations.size());
      EXPECT_TRUE(search.settled);
    }
  }
}

TEST(Outliers, SeveralAtOnceDoNotHideOneAnother) {
  RandomStream stream(kSeed + 1);
  for (int run = 0; run < 4; ++run) {
    const bool radar = run % 2 == 0;
    Scenario scenario = with_normal_noise(radar ? test::turn_by_radar() : test::turn_by_ranges(), stream);
    std::set<std::size_t> wrong;
    // A stretch that is off together, as when a tracker follows something else, and single ones.
    for (std::size_t k = 20; k < 28; ++k) {
      scenario.observations[k].value(radar ? 2 : 0) += 900.0;
      wrong.insert(k);
    }
    for (const std::size_t k : {3U, 11U, 40U, 41U, 50U}) {
      scenario.observations[k].value(0) += (radar ? 0.3 : 4000.0) * (k % 2 == 0 ? 1.0 : -1.0);
      wrong.insert(k);
    }
    const localise::OutlierSearch search = localise::find_outliers(scenario);
    EXPECT_EQ(indices(search), wrong) << "run " << run;
    EXPECT_TRUE(search.settled);
    for (const localise::RejectedMeasurement& rejected : search.rejected) {
      const bool exceeds = (rejected.residual.cwiseAbs() - rejected.allowed).maxCoeff() > 0.0;
      EXPECT_TRUE(exceeds) << rejected.observation;
    }
    const Scenario rest = localise::without(scenario, search);
    EXPECT_EQ(rest.observations.size(), scenario.observations.size() - wrong.size());
    EXPECT_TRUE(localise::find_outliers(rest).rejected.empty());
  }
}

TEST(Outliers, AThirdOfTheMeasurementsMayBeWrong) {
  RandomStream stream(kSeed + 2);
  Scenario scenario = with_normal_noise(test::turn_by_radar(), stream);
  std::set<std::size_t> wrong;
  for (std::size_t k = 1; k < scenario.observations.size(); k += 3) {
    scenario.observations[k].value(2) += 3000.0 * (0.5 + stream.uniform());
    wrong.insert(k);
  }
  EXPECT_EQ(indices(localise::find_outliers(scenario)), wrong);
}

/// A linear sensor, so that predictions are linear in motion and noise.
class WorstCase : public testing::Test {
 protected:
  static constexpr std::size_t kTested = 4;
  static constexpr double kFar = 1e5;

  static Scenario scenario() {
    Scenario scenario;
    scenario.knots_s = {0.0, 8.0, 20.0};
    scenario.nominal.velocity_mps = {40.0, 10.0, -2.0};
    scenario.bounds = {.position_m = {90.0, 60.0, 30.0},
                       .velocity_mps = Eigen::Vector3d::Constant(5.0),
                       .acceleration_mps2 = {{2.0, 1.0, 0.5}, {1.0, 2.0, 0.5}}};
    scenario.stations.push_back({.name = "receiver",
                                 .kind = SensorKind::kPosition,
                                 .position_m = Eigen::Vector3d::Zero(),
                                 .covariance = Eigen::Matrix3d{{400, 90, 0}, {90, 200, 0}, {0, 0, 900}}});
    return scenario;
  }

  /// Prediction of the tested measurement from exact measurements of theta, one value changed by `noise`.
  static localise::RejectedMeasurement prediction(const Eigen::VectorXd& theta, Eigen::Index changed = -1,
                                                  double noise = 0.0) {
    Scenario observed = scenario();
    const MotionCoordinates coordinates(trajectory::SplineBasis(observed.knots_s), observed.bounds);
    const auto deviation = coordinates.spline(coordinates.from_motion(theta));
    const auto nominal = make_nominal(observed);
    for (std::size_t k = 0; k < 8; ++k) {
      const double t = 2.5 * static_cast<double>(k);
      const Eigen::Vector3d x = nominal.position(t) + deviation.position(t);
      observed.observations.push_back(
          {.t_s = t, .station = 0, .value = Eigen::VectorXd{{x.x(), x.y(), x.z()}}, .covariance = {}});
    }
    if (changed >= 0) {
      observed.observations[static_cast<std::size_t>(changed / 3)].value(changed % 3) += noise;
    }
    observed.observations[kTested].value.array() += kFar;
    const localise::OutlierSearch search = localise::find_outliers(observed);
    EXPECT_EQ(indices(search), std::set<std::size_t>{kTested});
    return search.rejected.empty() ? localise::RejectedMeasurement{} : search.rejected.front();
  }
};

TEST_F(WorstCase, IsThatOfTheBoundsAndTheNoise) {
  const localise::RejectedMeasurement at_rest = prediction(Eigen::VectorXd::Zero(12));
  ASSERT_EQ(at_rest.residual.size(), 3);
  EXPECT_LT((at_rest.residual.array() - kFar).abs().maxCoeff(), 1e-4);
  // Column by column what motions and noise do to the residual.
  const MotionBounds bounds = scenario().bounds;
  Eigen::Vector3d worst = Eigen::Vector3d::Zero();
  for (Eigen::Index l = 0; l < 4; ++l) {
    Eigen::Matrix3d by_axis;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double size = 0.5 * semi_axes(bounds, l)(axis);
      const Eigen::VectorXd theta = size * Eigen::VectorXd::Unit(12, 3 * l + axis);
      by_axis.col(axis) = 2 * (prediction(theta).residual - at_rest.residual);
    }
    worst += by_axis.rowwise().norm();
  }
  const Eigen::Matrix3d W = scenario().stations[0].covariance;
  Eigen::Matrix3d noise = W;
  for (Eigen::Index k = 0; k < 8; ++k) {
    if (k == static_cast<Eigen::Index>(kTested)) {
      continue;
    }
    Eigen::Matrix3d by_value;
    for (Eigen::Index c = 0; c < 3; ++c) {
      by_value.col(c) = prediction(Eigen::VectorXd::Zero(12), 3 * k + c, 1.0).residual - at_rest.residual;
    }
    noise += by_value * W * by_value.transpose();
  }
  // 2 Q(q) = 1e-3/24.
  const double q = 4.098038;
  EXPECT_NEAR(std::erfc(q / std::sqrt(2.0)), 1e-3 / 24, 1e-9);
  const Eigen::Vector3d expected = worst + q * noise.diagonal().cwiseSqrt();
  for (Eigen::Index c = 0; c < 3; ++c) {
    EXPECT_NEAR(at_rest.allowed(c), expected(c), 1e-3 * expected(c)) << c;
  }
}

TEST(Outliers, SettingsOutOfRangeAreErrors) {
  const Scenario scenario = test::turn_by_radar();
  EXPECT_THROW((void)localise::find_outliers(scenario, {.false_alarm = 0.0}), Error);
  EXPECT_THROW((void)localise::find_outliers(scenario, {.max_rounds = 0}), Error);
  EXPECT_THROW((void)localise::find_outliers(scenario, {.minimum_height_m = 1e5}), Error);
}

}  // namespace
