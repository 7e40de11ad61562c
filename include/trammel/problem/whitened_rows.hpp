// SPDX-License-Identifier: Apache-2.0
/// @file
/// The measurements of a scenario as rows of a least-squares problem, one by one.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/error.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/noise.hpp"
#include "trammel/sensor/any_sensor.hpp"

namespace trammel::inline TRAMMEL_ABI {

namespace detail {

/// Name of a station in messages.
inline std::string station_label(const Scenario& scenario, std::size_t station) {
  const std::string& name = scenario.stations[station].name;
  return name.empty() ? "station " + std::to_string(station) : "station '" + name + "'";
}

}  // namespace detail

/// Calls `visit(segment, row, biases, deviation)` for every component of every measurement, linearised as
/// `problem` says and whitened: the entries of the nine spline coefficients that move `segment` (from 3
/// segment on), those of the biases, and the whitened deviation from the reference (0 where only planned).
/// Throws Error where a measurement cannot be linearised.
template <class Visit>
void for_each_whitened_row(const Scenario& scenario, const TrajectoryProblem& problem, Visit&& visit) {
  std::vector<Eigen::Matrix3d> noise;
  for (std::size_t i = 0; i < scenario.stations.size(); ++i) {
    const Station& station = scenario.stations[i];
    noise.push_back(
        noise_factor(station.covariance, components(station.kind), detail::station_label(scenario, i)));
  }
  const trajectory::SplineBasis& basis = problem.coordinates.basis();
  const std::vector<BiasParameter>& biases = problem.coordinates.bias_parameters();
  for_each_measurement(scenario, [&](const MeasurementSite& site) {
    const Station& station = scenario.stations[site.station];
    const double offset_s = problem.time_offsets_s[site.station];
    const RelativeMotion motion = linearised_motion(problem, site.station, site.t_s);
    sensor::Linearised model;
    try {
      model = sensor::linearise(station.kind, motion.position_m, motion.velocity_mps);
    } catch (const Error& error) {
      throw Error({describe(scenario, site) + ", " + error.detail().where, error.detail().found,
                   error.detail().expected});
    }
    const sensor::Padded rate = time_rate(model, motion);
    Eigen::Matrix3d own;
    const Eigen::Matrix3d* lower = &noise[site.station];
    sensor::Padded deviation = sensor::Padded::Zero();
    if (site.observation != nullptr) {
      if (site.observation->covariance) {
        own = noise_factor(*site.observation->covariance, components(station.kind), describe(scenario, site));
        lower = &own;
      }
      deviation = sensor::difference(station.kind, sensor::padded(site.observation->value), model.value) +
                  rate * offset_s;
      if (problem.linearised_about) {
        deviation += model.J_value_position * problem.linearised_about->position(site.t_s + offset_s) +
                     model.J_value_velocity * problem.linearised_about->velocity(site.t_s + offset_s);
      }
    }
    Eigen::Matrix<double, 3, Eigen::Dynamic> J_bias = bias_columns(biases, site.station, rate);
    const auto whiten = lower->triangularView<Eigen::Lower>();
    whiten.solveInPlace(model.J_value_position);
    whiten.solveInPlace(model.J_value_velocity);
    whiten.solveInPlace(J_bias);
    whiten.solveInPlace(deviation);
    const trajectory::LocalBasis<double> local = basis.at(site.t_s + offset_s);
    for (Eigen::Index i = 0; i < components(station.kind); ++i) {
      Eigen::Matrix<double, 1, 9> row;
      for (Eigen::Index k = 0; k < 3; ++k) {
        row.segment<3>(3 * k) =
            local.value(k) * model.J_value_position.row(i) + local.rate(k) * model.J_value_velocity.row(i);
      }
      if (!row.allFinite() || !J_bias.allFinite()) {
        throw Error(
            {describe(scenario, site), "a derivative that is not finite", "a path away from the station"});
      }
      visit(local.first, row, Eigen::RowVectorXd(J_bias.row(i)), deviation(i));
    }
  });
}

}  // namespace trammel::inline TRAMMEL_ABI
