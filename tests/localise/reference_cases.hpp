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

/// The descent seen from a station that moves and errs, in direction cosines and range and in range rate.
inline Scenario errant_scenario() {
  Scenario scenario = descent_scenario(1, 1);
  Station& station = scenario.stations[0];
  station.track = {.times_s = {0.0, 40.0, 70.0}, .positions_m = {{0, 0, 0}, {90, 30, 0}, {90, 150, 40}}};
  station.bias = {.components = Eigen::VectorXd{{0.004, 0.0, 80.0}}, .time_s = 0.3};
  scenario.stations.push_back({.name = "doppler",
                               .kind = SensorKind::kRangeRate,
                               .position_m = {3000, -2000, 10},
                               .covariance = Eigen::MatrixXd::Constant(1, 1, 0.5),
                               .times_s = {},
                               .bias = {.components = Eigen::VectorXd::Ones(1), .time_s = 0.2}});
  for (const double t : {5.5, 33.3, 61.1}) {
    scenario.observations.push_back(
        {.t_s = t, .station = 1, .value = Eigen::VectorXd::Constant(1, 250.0), .covariance = {}});
  }
  return scenario;
}

/// Once around in 251 s, 5 m/s^2.
inline Eigen::Vector3d circle(double t) {
  constexpr double kSpeed_mps = 200.0;
  constexpr double kRadius_m = 8000.0;
  const double angle = t * (kSpeed_mps / kRadius_m);
  return {20000.0 + kRadius_m * std::sin(angle), 15000.0 + kRadius_m * (1.0 - std::cos(angle)), 9000.0};
}

/// The circle seen with 3 m and 0.2 mrad, hardly less bent than the bounds allow and at its end 48 km from
/// the straight nominal path.
inline Scenario circle_by_radars() {
  constexpr int kSegments = 60;
  Scenario scenario;
  for (int i = 0; i <= kSegments; ++i) {
    scenario.knots_s.push_back(4.0 * i);
  }
  scenario.nominal.position_m = {20030, 14980, 9010};
  scenario.nominal.velocity_mps = {198, 3, 1};
  scenario.bounds = {.position_m = Eigen::Vector3d::Constant(100),
                     .velocity_mps = Eigen::Vector3d::Constant(10),
                     .acceleration_mps2 = std::vector<Eigen::Vector3d>(kSegments, {5.1, 5.1, 0.3})};
  for (const double x_m : {0.0, 30000.0}) {
    scenario.stations.push_back({.name = x_m > 0.0 ? "east" : "west",
                                 .kind = SensorKind::kAzimuthElevationRange,
                                 .position_m = {x_m, 0, 0},
                                 .covariance = Eigen::Vector3d(4e-8, 4e-8, 9).asDiagonal(),
                                 .times_s = seconds(0, 240)});
  }
  observe(scenario, circle, 0.0);
  return scenario;
}

}  // namespace trammel::test
