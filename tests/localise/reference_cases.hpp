// SPDX-License-Identifier: Apache-2.0
/// @file
/// Deterministic scenarios with nonlinear measurements and noise, computed independently to nine digits.
#pragma once

#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "trammel/problem/noise.hpp"
#include "trammel/problem/zoo.hpp"
#include "trammel/sensor/any_sensor.hpp"

namespace trammel::test {

/// A level flight that descends along a half cosine between 30 and 50 s.
inline Eigen::Vector3d descent(double t) {
  const double share = t < 30.0 ? 0.0 : t > 50.0 ? 1.0 : (1 - std::cos(std::numbers::pi * (t - 30) / 20)) / 2;
  return {1000 + 212 * t, 1000 + 212 * t, 5000 - 3000 * share};
}

/// A climbing turn of radius 2 km.
inline Eigen::Vector3d turn(double t) {
  return {12000 + 2000 * std::sin(0.06 * t), 15000 + 2000 * std::cos(0.06 * t), 1500 + 4 * t};
}

/// Adds what the stations (of kinds without velocity) measure of `path`, with the noise L w of size `size`,
/// w_c = sqrt(2) sin((1.7 + 1.2 c) k + 0.3 + 0.8 c) for component c of measurement k.
template <class Path>
void observe(Scenario& scenario, const Path& path, double size) {
  for (std::size_t i = 0; i < scenario.stations.size(); ++i) {
    const Station& station = scenario.stations[i];
    const Eigen::Index count = components(station.kind);
    const Eigen::Matrix3d lower = noise_factor(station.covariance, count, "station");
    for (std::size_t k = 0; k < station.times_s.size(); ++k) {
      const double t = station.times_s[k];
      sensor::Padded w = sensor::Padded::Zero();
      for (int c = 0; c < count; ++c) {
        w(c) = std::numbers::sqrt2 * std::sin((1.7 + 1.2 * c) * static_cast<double>(k) + 0.3 + 0.8 * c);
      }
      const sensor::Padded value =
          sensor::measure(station.kind, path(t) - station.position_m, Eigen::Vector3d::Zero()) +
          size * lower * w;
      scenario.observations.push_back(
          {.t_s = t, .station = i, .value = sensor::unpadded(value, count), .covariance = {}});
    }
  }
}

inline Scenario descent_scenario(double covariance, double noise) {
  Scenario scenario = zoo::manoeuvre_scenario(7, covariance);
  observe(scenario, descent, noise);
  return scenario;
}

inline Scenario turn_scenario() {
  Scenario scenario;
  for (int i = 0; i <= 12; ++i) {
    scenario.knots_s.push_back(5.0 * i);
  }
  scenario.nominal.position_m = {12050, 17030, 1450};
  scenario.nominal.velocity_mps = {115, 5, 2};
  scenario.bounds = {.position_m = Eigen::Vector3d::Constant(300),
                     .velocity_mps = Eigen::Vector3d::Constant(20),
                     .acceleration_mps2 = std::vector<Eigen::Vector3d>(12, {12, 12, 3})};
  return scenario;
}

inline std::vector<double> seconds(double offset, int count) {
  std::vector<double> times;
  for (int k = 0; k < count; ++k) {
    times.push_back(offset + k);
  }
  return times;
}

inline Scenario turn_by_radar() {
  Scenario scenario = turn_scenario();
  scenario.stations.push_back({.name = "radar",
                               .kind = SensorKind::kAzimuthElevationRange,
                               .position_m = Eigen::Vector3d::Zero(),
                               .covariance = Eigen::Vector3d(2.25e-6, 2.25e-6, 225).asDiagonal(),
                               .times_s = seconds(0, 61)});
  observe(scenario, turn, 1.0);
  return scenario;
}

inline Scenario turn_by_ranges() {
  Scenario scenario = turn_scenario();
  const std::vector<Eigen::Vector3d> places{{0, 0, 0}, {30000, 5000, 0}, {8000, 33000, 0}};
  for (int i = 0; i < 3; ++i) {
    scenario.stations.push_back({.name = std::to_string(i),
                                 .kind = SensorKind::kRange,
                                 .position_m = places[static_cast<std::size_t>(i)],
                                 .covariance = Eigen::MatrixXd::Constant(1, 1, 225),
                                 .times_s = seconds(0.37 * i, i == 0 ? 61 : 60)});
  }
  observe(scenario, turn, 1.0);
  return scenario;
}

}  // namespace trammel::test
