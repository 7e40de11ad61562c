// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of zoo.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/problem/zoo.hpp"

namespace trammel::inline TRAMMEL_ABI::zoo {

namespace detail {

/// count + 1 numbers from 0 to end, equally spaced.
inline std::vector<double> equally_spaced(int count, double end) {
  std::vector<double> result;
  for (int i = 0; i <= count; ++i) {
    result.push_back(i * end / count);
  }
  return result;
}

inline MotionBounds balls(double position_m, double velocity_mps, double acceleration_mps2, int segments) {
  return {.position_m = Eigen::Vector3d::Constant(position_m),
          .velocity_mps = Eigen::Vector3d::Constant(velocity_mps),
          .acceleration_mps2 = std::vector<Eigen::Vector3d>(static_cast<std::size_t>(segments),
                                                            Eigen::Vector3d::Constant(acceleration_mps2))};
}

/// The circling flight: radius 15 km at 220 m/s, height 6000 m +- 1500 m.
inline Eigen::Vector3d circling_position(double t_s) {
  const double angle = t_s * 220.0 / 15000.0;
  return {10000.0 + 15000.0 * std::cos(angle), 8000.0 + 15000.0 * std::sin(angle),
          6000.0 + 1500.0 * std::sin(t_s / 97.0)};
}

inline constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;

}  // namespace detail

TRAMMEL_INLINE Scenario manoeuvre_scenario(int segments, double noise) {
  constexpr double kDuration = 70.0;
  Eigen::Matrix3d covariance;
  covariance << 6.04e-05, 8.88e-06, -0.004168,  //
      8.88e-06, 8.28e-05, 0.006126,             //
      -0.004168, 0.006126, 80.63;
  Scenario scenario;
  scenario.title = "manoeuvre, " + std::to_string(segments) + " segments";
  scenario.knots_s = detail::equally_spaced(segments, kDuration);
  scenario.nominal.position_m = {1000.0, 1000.0, 5000.0};
  scenario.nominal.velocity_mps = {212.0, 212.0, 0.0};
  scenario.bounds = detail::balls(100.0, 10.0, 37.0, segments);
  scenario.stations.push_back({.name = "station1",
                               .kind = SensorKind::kDirectionCosinesRange,
                               .covariance = noise * covariance,
                               .times_s = detail::equally_spaced(70, kDuration)});
  return scenario;
}

TRAMMEL_INLINE Instance manoeuvre() {
  return {"manoeuvre", manoeuvre_scenario(7, 1.0),
          KnownOptimum{148.78913466255815, 148.789134671254, 153.00057487114242, std::nullopt}};
}

TRAMMEL_INLINE Instance manoeuvre_noisy() {
  return {"manoeuvre_noisy", manoeuvre_scenario(7, detail::kDegreesPerRadian),
          KnownOptimum{940.477127075609, 940.4771271188043, 1158.1221790350648, std::nullopt}};
}

TRAMMEL_INLINE Instance r20() {
  return {"r20", manoeuvre_scenario(20, 1.0),
          KnownOptimum{175.85454262388558, 175.85454263238245, 247.93548075152876, std::nullopt}};
}

TRAMMEL_INLINE Instance r40_noisy() {
  return {"r40_noisy", manoeuvre_scenario(40, detail::kDegreesPerRadian),
          KnownOptimum{966.3171037774226, 966.3171038562938, 2659.4187429659323, std::nullopt}};
}

TRAMMEL_INLINE Instance paper004() {
  constexpr double kDuration = 10.0;
  Eigen::Matrix3d covariance;
  covariance << 0.000302, 4.44e-05, -0.02084,  //
      4.44e-05, 0.000414, 0.03063,             //
      -0.02084, 0.03063, 403.17;
  Scenario scenario;
  scenario.title = "uniform motion, bounds on start and velocity";
  scenario.knots_s = {0.0, kDuration};
  scenario.nominal.position_m = {-1000.0, 25000.0, 9500.0};
  scenario.nominal.velocity_mps = {70.0, 90.0, 5.0};
  scenario.bounds = detail::balls(250.0, 25.0, 0.0, 1);
  scenario.criterion = {.kind = CriterionKind::kTimes, .times_s = detail::equally_spaced(39, kDuration)};
  scenario.stations.push_back({.name = "station1",
                               .kind = SensorKind::kDirectionCosinesRange,
                               .covariance = covariance,
                               .times_s = detail::equally_spaced(39, kDuration)});
  return {"paper004", std::move(scenario),
          KnownOptimum{215.70324664, 215.70324665, 363.39193713820873, 382.23085618214645}};
}

TRAMMEL_INLINE Instance long_flight(int segments) {
  constexpr double kSegmentLength = 10.0;
  require(segments >= 1, "segments", std::to_string(segments), "at least 1");
  const double duration = segments * kSegmentLength;
  const int seconds = segments * 10;
  Scenario scenario;
  scenario.title = "circling flight, " + std::to_string(segments) + " segments";
  scenario.knots_s = detail::equally_spaced(segments, duration);
  scenario.nominal.sample_times_s = detail::equally_spaced(seconds, duration);
  for (const double t : scenario.nominal.sample_times_s) {
    scenario.nominal.sample_positions_m.push_back(detail::circling_position(t));
  }
  scenario.bounds = detail::balls(100.0, 10.0, 8.0, segments);
  const Eigen::Matrix3d covariance = Eigen::Vector3d(1e-6, 1e-6, 225.0).asDiagonal();
  scenario.stations.push_back({.name = "west",
                               .kind = SensorKind::kAzimuthElevationRange,
                               .position_m = {0.0, 0.0, 0.0},
                               .covariance = covariance,
                               .times_s = scenario.nominal.sample_times_s});
  scenario.stations.push_back({.name = "east",
                               .kind = SensorKind::kAzimuthElevationRange,
                               .position_m = {32000.0, -6000.0, 200.0},
                               .covariance = covariance,
                               .times_s = scenario.nominal.sample_times_s});
  std::optional<KnownOptimum> optimum;
  if (segments == 40) {
    optimum = KnownOptimum{7.246193757, 7.246193771, 7.26839077652461, std::nullopt};
  } else if (segments == 98) {
    optimum = KnownOptimum{7.359563036, 7.359563041, 7.372252834704247, std::nullopt};
  }
  return {"long_flight", std::move(scenario), optimum};
}

TRAMMEL_INLINE GuaranteedProblem truncated_powers(Eigen::Index segments, Eigen::Index outputs) {
  constexpr double kSegment_s = 10.0;
  constexpr Eigen::Index kTimes = 71;
  constexpr double kNoise_m = 20.0;
  const Eigen::Index p = 3 * (segments + 2);
  const double duration = kSegment_s * static_cast<double>(segments);
  const auto position = [&](Eigen::Index k, Eigen::Index count) {
    const double t = duration * static_cast<double>(k) / static_cast<double>(count - 1);
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3, p);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      rows(axis, axis) = 1.0;
      rows(axis, 3 + axis) = t;
      for (Eigen::Index i = 0; i < segments; ++i) {
        const double since = t - kSegment_s * static_cast<double>(i);
        const double inside = std::clamp(since, 0.0, kSegment_s);
        rows(axis, 3 * (i + 2) + axis) = inside * (std::max(since, 0.0) - inside / 2.0);
      }
    }
    return rows;
  };
  RandomStream random(1);
  GuaranteedProblem problem;
  problem.information_factor.resize(3 * kTimes, p);
  for (Eigen::Index k = 0; k < kTimes; ++k) {
    Eigen::Matrix3d mixing;
    for (double& entry : mixing.reshaped()) {
      entry = random.normal() / kNoise_m;
    }
    problem.information_factor.middleRows(3 * k, 3) = mixing * position(k, kTimes);
  }
  problem.criterion_factor.resize(outputs, p);
  for (Eigen::Index k = 0; k < outputs / 3; ++k) {
    problem.criterion_factor.middleRows(3 * k, 3) =
        position(k, outputs / 3) / std::sqrt(static_cast<double>(outputs) / 3.0);
  }
  for (Eigen::Index l = 0; l < segments + 2; ++l) {
    Eigen::MatrixXd bound = Eigen::MatrixXd::Zero(3, p);
    bound.middleCols(3 * l, 3).diagonal().setConstant(1.0 / (l == 0 ? 100.0 : l == 1 ? 10.0 : 3.0));
    problem.ellipsoids.push_back(bound);
  }
  return problem;
}

TRAMMEL_INLINE std::vector<Instance> all_instances() {
  std::vector<Instance> result;
  result.push_back(manoeuvre());
  result.push_back(manoeuvre_noisy());
  result.push_back(r20());
  result.push_back(r40_noisy());
  result.push_back(paper004());
  result.push_back(long_flight(40));
  result.push_back(long_flight(98));
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::zoo
