// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of observed.hpp.
#pragma once

#include <algorithm>
#include <cmath>

#include "trammel/estimate/observed.hpp"
#include "trammel/problem/noise.hpp"
#include "trammel/sensor/any_sensor.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

TRAMMEL_INLINE PathTable path_on_grid(const TrajectoryProblem& problem, const Eigen::VectorXd& z,
                                      const std::vector<double>& times_s) {
  const trajectory::QuadraticSpline<double> deviation = problem.coordinates.spline(z);
  const auto count = static_cast<Eigen::Index>(times_s.size());
  PathTable table{
      .times_s = times_s, .position_m = Eigen::MatrixXd(count, 3), .velocity_mps = Eigen::MatrixXd(count, 3)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const double t = times_s[static_cast<std::size_t>(i)];
    table.position_m.row(i) = (problem.nominal.position(t) + deviation.position(t)).transpose();
    table.velocity_mps.row(i) = (problem.nominal.velocity(t) + deviation.velocity(t)).transpose();
  }
  return table;
}

namespace detail {

/// Largest second-order remainder of one measurement over its sigma.
inline double remainder_ratio(SensorKind kind, const sensor::Padded& computed,
                              const sensor::Linearised& model, const Eigen::Vector3d& position,
                              const Eigen::Vector3d& velocity, const Eigen::Matrix3d& noise) {
  const sensor::Padded linear = model.J_value_position * position + model.J_value_velocity * velocity;
  const sensor::Padded remainder = sensor::difference(kind, computed, sensor::Padded(model.value + linear));
  double ratio = 0.0;
  for (Eigen::Index i = 0; i < components(kind); ++i) {
    ratio = std::max(ratio, std::abs(remainder(i)) / noise.row(i).norm());  // row norm of L = sigma
  }
  return ratio;
}

}  // namespace detail

TRAMMEL_INLINE ObservationResult compare_with_observations(
    const Scenario& scenario, const TrajectoryProblem& problem, const Eigen::VectorXd& z,
    const std::optional<GaussMarkov>& unbounded_estimate, const std::vector<double>& times_s) {
  ObservationResult result;
  result.theta = problem.coordinates.motion(z);
  const PathTable knots = path_on_grid(problem, z, scenario.knots_s);
  result.knot_position_m = knots.position_m;
  result.knot_velocity_mps = knots.velocity_mps;
  result.path = path_on_grid(problem, z, times_s);
  if (unbounded_estimate) {
    result.gauss_markov_path = path_on_grid(problem, unbounded_estimate->z, times_s);
  }
  const trajectory::QuadraticSpline<double> deviation = problem.coordinates.spline(z);
  std::vector<Eigen::Matrix3d> noise;
  for (const Station& station : scenario.stations) {
    noise.push_back(noise_factor(station.covariance, components(station.kind), station.name));
  }
  result.chi2 = 0.0;
  double ratio = 0.0;
  result.residuals.reserve(scenario.observations.size());
  for (const Measurement& m : scenario.observations) {
    const Station& station = scenario.stations[m.station];
    const Eigen::Index size = components(station.kind);
    const Eigen::Matrix3d lower =
        m.covariance ? noise_factor(*m.covariance, size, station.name) : noise[m.station];
    const Eigen::Vector3d reference = problem.nominal.position(m.t_s) - station.position_m;
    const Eigen::Vector3d reference_velocity = problem.nominal.velocity(m.t_s);
    const Eigen::Vector3d position = deviation.position(m.t_s);
    const Eigen::Vector3d velocity = deviation.velocity(m.t_s);
    const sensor::Padded computed =
        sensor::measure(station.kind, reference + position, reference_velocity + velocity);
    const Eigen::Vector3d about =
        problem.linearised_about ? problem.linearised_about->position(m.t_s) : Eigen::Vector3d::Zero();
    const Eigen::Vector3d about_velocity =
        problem.linearised_about ? problem.linearised_about->velocity(m.t_s) : Eigen::Vector3d::Zero();
    const sensor::Padded residual = sensor::difference(station.kind, sensor::padded(m.value), computed);
    const sensor::Padded whitened = lower.triangularView<Eigen::Lower>().solve(residual);
    result.chi2 += whitened.squaredNorm();
    result.residuals.push_back({.t_s = m.t_s,
                                .station = m.station,
                                .value = sensor::unpadded(residual, size),
                                .whitened = sensor::unpadded(whitened, size)});
    const sensor::Linearised model =
        sensor::linearise(station.kind, reference + about, reference_velocity + about_velocity);
    ratio = std::max(ratio, detail::remainder_ratio(station.kind, computed, model, position - about,
                                                    velocity - about_velocity, lower));
  }
  result.linearisation = {.ratio = ratio,
                          .iterations = problem.linearised_about ? 1 : 0,
                          .converged = problem.linearised_about.has_value()};
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::estimate
