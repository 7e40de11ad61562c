// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of assemble.hpp.
#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/linalg/banded_triangle.hpp"
#include "trammel/linalg/qr.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/noise.hpp"
#include "trammel/sensor/any_sensor.hpp"
#include "trammel/trajectory/criterion_factor.hpp"
#include "trammel/trajectory/motion_parameters.hpp"

namespace trammel::inline TRAMMEL_ABI {

namespace detail {

inline void check_semi_axes(const Eigen::Vector3d& axes, const std::string& where) {
  for (const double axis : axes) {
    if (!(axis >= 0.0)) {
      throw Error({where, std::to_string(axis), "a radius or semi-axes from 0 (removed) to inf (unbounded)"});
    }
  }
}

inline void check_criterion(const Scenario& scenario, const trajectory::SplineBasis& basis) {
  const Criterion& criterion = scenario.criterion;
  if (criterion.kind == CriterionKind::kTimes) {
    require(!criterion.times_s.empty(), "criterion.times_s", "no times", "at least one time");
    for (std::size_t k = 0; k < criterion.times_s.size(); ++k) {
      if (!basis.covers(criterion.times_s[k])) {
        basis.require_covers(criterion.times_s[k], "criterion.times_s[" + std::to_string(k) + "]");
      }
    }
  }
  if (criterion.kind == CriterionKind::kWindow) {
    basis.require_covers(criterion.window_s(0), "criterion.window_s[0]");
    basis.require_covers(criterion.window_s(1), "criterion.window_s[1]");
    if (!(criterion.window_s(0) < criterion.window_s(1))) {
      throw Error({"criterion.window_s",
                   std::to_string(criterion.window_s(0)) + " to " + std::to_string(criterion.window_s(1)),
                   "a begin before the end"});
    }
  }
}

/// Name of a station in messages.
inline std::string station_label(const Scenario& scenario, std::size_t station) {
  const std::string& name = scenario.stations[station].name;
  return name.empty() ? "station " + std::to_string(station) : "station '" + name + "'";
}

inline void check_stations(const Scenario& scenario) {
  for (std::size_t i = 0; i < scenario.stations.size(); ++i) {
    const Station& station = scenario.stations[i];
    const std::string label = station_label(scenario, i);
    require(station.position_m.allFinite(), label + " position_m", "a value that is not finite",
            "finite values");
    (void)noise_factor(station.covariance, components(station.kind), label);
    const Eigen::VectorXd& bias = station.bias.components;
    if (bias.size() != 0 && bias.size() != components(station.kind)) {
      throw Error({label + " bias", std::to_string(bias.size()) + " semi-axes",
                   std::to_string(components(station.kind)) + ", one per component of its kind, or none"});
    }
    for (Eigen::Index c = 0; c <= bias.size(); ++c) {
      const double axis = c < bias.size() ? bias(c) : station.bias.time_s;
      if (!(axis >= 0.0)) {
        throw Error({label + " bias", std::to_string(axis), "semi-axes from 0 (none) to inf (unbounded)"});
      }
    }
  }
}

/// Throws Error unless the station's track tells where it is at the time of a measurement.
inline void check_track(const Scenario& scenario, const std::vector<trajectory::NominalTrajectory>& tracks,
                        const MeasurementSite& site) {
  const trajectory::NominalTrajectory& track = tracks[site.station];
  if (!track.covers(site.t_s)) {
    throw Error(
        {describe(scenario, site),
         "a track from " + std::to_string(track.begin_s()) + " to " + std::to_string(track.end_s()) + " s",
         "a track that covers the times of the station's measurements"});
  }
}

inline void check_measurement(const Scenario& scenario, const trajectory::SplineBasis& basis,
                              const MeasurementSite& site) {
  if (site.observation != nullptr) {
    const Measurement& m = *site.observation;
    if (m.station >= scenario.stations.size()) {
      throw Error({"observation " + std::to_string(site.index), "station index " + std::to_string(m.station),
                   "an index below the number of stations, " + std::to_string(scenario.stations.size())});
    }
    const Eigen::Index expected = components(scenario.stations[m.station].kind);
    if (m.value.size() != expected) {
      throw Error({describe(scenario, site), std::to_string(m.value.size()) + " components",
                   std::to_string(expected) + " for the station's kind"});
    }
    if (!m.value.allFinite()) {
      throw Error({describe(scenario, site), "a value that is not finite", "finite values"});
    }
  }
  if (!basis.covers(site.t_s)) {
    basis.require_covers(site.t_s, describe(scenario, site));
  }
}

/// The criterion's factor of one axis in spline coefficients.
inline Eigen::MatrixXd axis_criterion(const Scenario& scenario, const trajectory::SplineBasis& basis) {
  const Criterion& criterion = scenario.criterion;
  switch (criterion.kind) {
    case CriterionKind::kTimes:
      return trajectory::mean_factor(basis, criterion.times_s);
    case CriterionKind::kWindow:
      return trajectory::integral_factor(basis, criterion.window_s(0), criterion.window_s(1));
    case CriterionKind::kFinal:
      return trajectory::mean_factor(basis, {basis.end_s()});
    case CriterionKind::kIntegral:
      break;
  }
  return trajectory::integral_factor(basis, basis.begin_s(), basis.end_s());
}

/// Replaces more rows than columns by a triangle with the same products; reduces `rhs` along.
inline void compress(Eigen::MatrixXd& factor, Eigen::VectorXd& rhs, double& residual) {
  const Eigen::Index p = factor.cols();
  if (factor.rows() <= p) {
    return;
  }
  const linalg::Qr qr(factor);
  rhs.applyOnTheLeft(qr.householderQ().adjoint());
  residual += rhs.tail(rhs.size() - p).squaredNorm();
  rhs.conservativeResize(p);
  factor = qr.matrixQR().topRows(p).triangularView<Eigen::Upper>();
}

/// All measurements, whitened and linearised, reduced to a triangle in the spline coefficients and biases.
inline linalg::ReducedRows reduce_measurements(const Scenario& scenario, const TrajectoryProblem& problem) {
  linalg::BandedRows<9, 3> rows(problem.coordinates.basis().segments(),
                                static_cast<Eigen::Index>(problem.coordinates.bias_parameters().size()));
  for_each_whitened_row(scenario, problem, [&](const WhitenedRow& row) {
    rows.add(row.segment, row.coefficients, row.biases, row.deviation);
  });
  return rows.reduce();
}

/// Rows of the bounds that are neither zero nor infinite, and which bound they belong to.
inline void add_ellipsoids(const MotionBounds& bounds, TrajectoryProblem& result) {
  const MotionCoordinates& coordinates = result.coordinates;
  const Eigen::MatrixXd motion = coordinates.kept_motion_rows();
  const Eigen::Index count = coordinates.basis().coefficients();
  std::size_t next = 0;
  const auto add = [&result](const Eigen::MatrixXd& rows, std::vector<Eigen::Index>& place) {
    place.push_back(rows.rows() == 0 ? TrajectoryProblem::kNoEllipsoid
                                     : static_cast<Eigen::Index>(result.problem.ellipsoids.size()));
    if (rows.rows() > 0) {
      result.problem.ellipsoids.push_back(rows);
    }
  };
  for (Eigen::Index l = 0; l < count; ++l) {
    const Eigen::Vector3d& axes = semi_axes(bounds, l);
    Eigen::MatrixXd rows(3, coordinates.parameters());
    Eigen::Index used = 0;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (axes(axis) == 0.0) {
        continue;
      }
      const auto at = static_cast<Eigen::Index>(next++);
      if (std::isfinite(axes(axis))) {
        rows.row(used++) = motion.row(at) / axes(axis);
      }
    }
    add(rows.topRows(used), result.ellipsoid_of_bound);
  }
  const std::vector<BiasParameter>& biases = coordinates.bias_parameters();
  for (std::size_t station = 0; station < result.stations.size(); ++station) {
    Eigen::MatrixXd rows(0, coordinates.parameters());
    for (std::size_t k = 0; k < biases.size(); ++k) {
      if (biases[k].station == station && std::isfinite(biases[k].semi_axis)) {
        rows.conservativeResize(rows.rows() + 1, Eigen::NoChange);
        rows.bottomRows<1>() =
            motion.row(coordinates.motion_parameters() + static_cast<Eigen::Index>(k)) / biases[k].semi_axis;
      }
    }
    add(rows, result.ellipsoid_of_station);
  }
}

/// Columns of unit length: of the information together with the bounds, else of the criterion.
inline Eigen::VectorXd column_scale(const GuaranteedProblem& problem) {
  Eigen::VectorXd square = problem.information_factor.colwise().squaredNorm().transpose();
  for (const Eigen::MatrixXd& rows : problem.ellipsoids) {
    square += rows.colwise().squaredNorm().transpose();
  }
  const Eigen::VectorXd fallback = problem.criterion_factor.colwise().squaredNorm().transpose();
  for (Eigen::Index j = 0; j < square.size(); ++j) {
    const double size = square(j) > 0.0 ? square(j) : fallback(j);
    square(j) = size > 0.0 ? 1.0 / std::sqrt(size) : 1.0;
  }
  return square;
}

}  // namespace detail

TRAMMEL_INLINE void for_each_measurement(const Scenario& scenario,
                                         const std::function<void(const MeasurementSite&)>& visit) {
  if (!scenario.observations.empty()) {
    for (std::size_t k = 0; k < scenario.observations.size(); ++k) {
      const Measurement& m = scenario.observations[k];
      visit({.station = m.station, .t_s = m.t_s, .index = k, .observation = &m});
    }
    return;
  }
  for (std::size_t i = 0; i < scenario.stations.size(); ++i) {
    const std::vector<double>& times = scenario.stations[i].times_s;
    for (std::size_t k = 0; k < times.size(); ++k) {
      visit({.station = i, .t_s = times[k], .index = k, .observation = nullptr});
    }
  }
}

TRAMMEL_INLINE void for_each_whitened_row(const Scenario& scenario, const TrajectoryProblem& problem,
                                          const std::function<void(const WhitenedRow&)>& visit) {
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
    if (J_bias.cols() > 0) {
      whiten.solveInPlace(J_bias);
    }
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
      visit(
          {.segment = local.first, .coefficients = row, .biases = J_bias.row(i), .deviation = deviation(i)});
    }
  });
}

TRAMMEL_INLINE std::string describe(const Scenario& scenario, const MeasurementSite& site) {
  return detail::station_label(scenario, site.station) + ", " +
         (site.observation != nullptr ? "observation " : "planned measurement ") +
         std::to_string(site.index) + " at " + shortest(site.t_s) + " s";
}

TRAMMEL_INLINE void check(const Scenario& scenario) {
  const trajectory::SplineBasis basis(scenario.knots_s);
  const std::size_t segments = scenario.segments();
  if (scenario.bounds.acceleration_mps2.size() != segments) {
    throw Error({"bounds.acceleration_mps2",
                 std::to_string(scenario.bounds.acceleration_mps2.size()) + " entries",
                 "one per segment, " + std::to_string(segments)});
  }
  detail::check_semi_axes(scenario.bounds.position_m, "bounds.position_m");
  detail::check_semi_axes(scenario.bounds.velocity_mps, "bounds.velocity_mps");
  for (std::size_t i = 0; i < segments; ++i) {
    detail::check_semi_axes(scenario.bounds.acceleration_mps2[i],
                            "bounds.acceleration_mps2[" + std::to_string(i) + "]");
  }
  detail::check_criterion(scenario, basis);
  detail::check_stations(scenario);
  const std::vector<trajectory::NominalTrajectory> tracks = station_paths(scenario);
  for_each_measurement(scenario, [&](const MeasurementSite& site) {
    detail::check_measurement(scenario, basis, site);
    detail::check_track(scenario, tracks, site);
  });
  (void)make_nominal(scenario);
}

TRAMMEL_INLINE std::vector<trajectory::NominalTrajectory> station_paths(const Scenario& scenario) {
  std::vector<trajectory::NominalTrajectory> result;
  for (std::size_t i = 0; i < scenario.stations.size(); ++i) {
    const Station& station = scenario.stations[i];
    const PathSamples& track = station.track;
    const bool stands = track.times_s.empty() && track.positions_m.empty();
    result.push_back(
        stands ? trajectory::NominalTrajectory::line(scenario.knots_s.front(), station.position_m,
                                                     Eigen::Vector3d::Zero())
               : trajectory::NominalTrajectory::through(track.times_s, track.positions_m,
                                                        detail::station_label(scenario, i) + " track"));
  }
  return result;
}

TRAMMEL_INLINE trajectory::NominalTrajectory make_nominal(const Scenario& scenario) {
  const NominalPath& path = scenario.nominal;
  if (path.sample_times_s.empty() && path.sample_positions_m.empty()) {
    return trajectory::NominalTrajectory::line(scenario.knots_s.front(), path.position_m, path.velocity_mps);
  }
  trajectory::NominalTrajectory nominal =
      trajectory::NominalTrajectory::through(path.sample_times_s, path.sample_positions_m);
  if (!nominal.covers(scenario.knots_s.front()) || !nominal.covers(scenario.knots_s.back())) {
    throw Error(
        {"nominal samples",
         "times from " + std::to_string(nominal.begin_s()) + " to " + std::to_string(nominal.end_s()) + " s",
         "samples that cover all knots, " + std::to_string(scenario.knots_s.front()) + " to " +
             std::to_string(scenario.knots_s.back()) + " s"});
  }
  return nominal;
}

TRAMMEL_INLINE RelativeMotion linearised_motion(const TrajectoryProblem& problem, std::size_t station,
                                                double t_s) {
  const double made_s = t_s + problem.time_offsets_s[station];
  RelativeMotion motion = relative_motion(problem.nominal, problem.stations[station], made_s);
  if (problem.linearised_about) {
    motion.position_m += problem.linearised_about->position(made_s);
    motion.velocity_mps += problem.linearised_about->velocity(made_s);
    motion.acceleration_mps2 += problem.linearised_about->acceleration(made_s);
  }
  return motion;
}

TRAMMEL_INLINE TrajectoryProblem describe_problem(const Scenario& scenario,
                                                  const trajectory::QuadraticSpline<double>* about,
                                                  const std::vector<double>& time_offsets_s) {
  check(scenario);
  require(time_offsets_s.empty() || time_offsets_s.size() == scenario.stations.size(), "time_offsets_s",
          std::to_string(time_offsets_s.size()) + " entries", "one per station, or none");
  const trajectory::SplineBasis basis(scenario.knots_s);
  TrajectoryProblem result{
      .coordinates = MotionCoordinates(basis, scenario.bounds, bias_parameters(scenario)),
      .nominal = make_nominal(scenario),
      .stations = station_paths(scenario),
      .problem = {},
      .information_rhs = {},
      .information_residual = 0.0,
      .ellipsoid_of_bound = {},
      .ellipsoid_of_station = {},
      .observations = 0,
      .linearised_about = about == nullptr ? std::nullopt : std::optional(*about),
      .time_offsets_s = time_offsets_s};
  result.time_offsets_s.resize(scenario.stations.size(), 0.0);
  for_each_measurement(scenario, [&](const MeasurementSite& /*site*/) { ++result.observations; });
  return result;
}

TRAMMEL_INLINE TrajectoryProblem assemble(const Scenario& scenario,
                                          const trajectory::QuadraticSpline<double>* about,
                                          const std::vector<double>& time_offsets_s) {
  TrajectoryProblem result = describe_problem(scenario, about, time_offsets_s);
  linalg::ReducedRows reduced = detail::reduce_measurements(scenario, result);
  result.problem.information_factor = result.coordinates.restrict_rows(reduced.factor);
  detail::compress(result.problem.information_factor, reduced.rhs, reduced.residual);
  result.problem.criterion_factor = result.coordinates.restrict_rows(
      trajectory::for_three_axes(detail::axis_criterion(scenario, result.coordinates.basis())));
  detail::add_ellipsoids(scenario.bounds, result);

  const Eigen::VectorXd scale = detail::column_scale(result.problem);
  result.coordinates.set_scale(scale);
  const auto rescale = [&scale](Eigen::MatrixXd& rows) { rows = rows * scale.asDiagonal(); };
  rescale(result.problem.information_factor);
  rescale(result.problem.criterion_factor);
  for (Eigen::MatrixXd& rows : result.problem.ellipsoids) {
    rescale(rows);
  }
  if (!scenario.observations.empty()) {
    result.information_rhs = std::move(reduced.rhs);
    result.information_residual = reduced.residual;
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI
