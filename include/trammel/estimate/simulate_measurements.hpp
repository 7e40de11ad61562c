// SPDX-License-Identifier: Apache-2.0
/// @file
/// Measurements drawn along a true path.
#pragma once

#include <concepts>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/noise.hpp"
#include "trammel/problem/scenario.hpp"
#include "trammel/sensor/any_sensor.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

/// A path with position (m) and velocity (m/s) at a time, such as trajectory::NominalTrajectory.
template <class Path>
concept TruePath = requires(const Path& path, double t_s) {
  { path.position(t_s) } -> std::convertible_to<Eigen::Vector3d>;
  { path.velocity(t_s) } -> std::convertible_to<Eigen::Vector3d>;
  { path.covers(t_s) } -> std::convertible_to<bool>;
};

/// One measurement per planned time of each station (per observation time, where the scenario has
/// observations): value = h(true path) + L w, W = L L' the covariance, w standard normal; azimuth in (-pi,
/// pi]. The same seed gives the same numbers everywhere: measurement k of station i has the random stream
/// 2^32 i + k (k counts observations where there are some). Stations have no bias here.
/// Throws Error where the path does not cover a time or the aircraft is at the station.
template <TruePath Path>
[[nodiscard]] std::vector<Measurement> simulate_measurements(const Scenario& scenario, const Path& truth,
                                                             std::uint64_t seed) {
  check(scenario);
  constexpr unsigned kStationShift = 32;
  const std::vector<trajectory::NominalTrajectory> stations = station_paths(scenario);
  std::vector<Measurement> result;
  for_each_measurement(scenario, [&](const MeasurementSite& site) {
    const Station& station = scenario.stations[site.station];
    if (!truth.covers(site.t_s)) {
      throw Error({describe(scenario, site), "a time the true path does not cover",
                   "a true path over all measurement times"});
    }
    const bool own = site.observation != nullptr && site.observation->covariance.has_value();
    const Eigen::Matrix3d lower = noise_factor(own ? *site.observation->covariance : station.covariance,
                                               components(station.kind), describe(scenario, site));
    RandomStream stream(seed, (static_cast<std::uint64_t>(site.station) << kStationShift) + site.index);
    Eigen::Vector3d normal;
    for (double& w : normal) {
      w = stream.normal();
    }
    const trajectory::NominalTrajectory& from = stations[site.station];
    const Eigen::Vector3d position = truth.position(site.t_s) - from.position(site.t_s);
    const Eigen::Vector3d velocity = truth.velocity(site.t_s) - from.velocity(site.t_s);
    const sensor::Padded noise = lower * normal;
    // The difference to zero brings the azimuth back into its range.
    const sensor::Padded value = sensor::difference(
        station.kind, sensor::measure(station.kind, position, velocity) + noise, sensor::Padded::Zero());
    result.push_back({.t_s = site.t_s,
                      .station = site.station,
                      .value = sensor::unpadded(value, components(station.kind)),
                      .covariance = own ? site.observation->covariance : std::nullopt});
  });
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::estimate
