// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of observed.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "trammel/estimate/bounded_motion.hpp"
#include "trammel/estimate/observed.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/qr.hpp"
#include "trammel/problem/noise.hpp"
#include "trammel/sensor/any_sensor.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

TRAMMEL_INLINE std::optional<GaussMarkov> gauss_markov(const TrajectoryProblem& problem) {
  const Eigen::MatrixXd& F = problem.problem.information_factor;
  const Eigen::Index p = problem.problem.parameters();
  if (F.rows() < p) {
    return std::nullopt;
  }
  Eigen::VectorXd scale = F.colwise().norm().transpose();
  if (!(scale.minCoeff() > 0.0)) {
    return std::nullopt;
  }
  scale = scale.cwiseInverse().eval();
  const linalg::PivotedQr qr(F * scale.asDiagonal());
  if (qr.rank() < p) {
    return std::nullopt;
  }
  // tr S J^-1 = |C D P R^-1|^2 with F D P = Q R.
  const Eigen::MatrixXd criterion =
      problem.problem.criterion_factor * scale.asDiagonal() * qr.colsPermutation();
  const Eigen::MatrixXd R = qr.matrixQR().topRows(p).triangularView<Eigen::Upper>();
  GaussMarkov result;
  result.rms_m = R.transpose().triangularView<Eigen::Lower>().solve(criterion.transpose()).norm();
  if (problem.information_rhs.size() > 0) {
    result.z = scale.asDiagonal() * qr.solve(problem.information_rhs);
  }
  return result;
}

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

TRAMMEL_INLINE BiasEstimate estimate_biases(const TrajectoryProblem& problem, const MotionBounds& bounds,
                                            const Eigen::MatrixXd& gain) {
  const MotionCoordinates& coordinates = problem.coordinates;
  const Eigen::Index motions = coordinates.motion_parameters();
  const Eigen::Index q = coordinates.parameters() - motions;
  BiasEstimate result;
  if (q == 0) {
    return result;
  }
  const Eigen::MatrixXd& F = problem.problem.information_factor;
  const Eigen::MatrixXd F_b = F.rightCols(q);
  Eigen::MatrixXd normal = F_b.transpose() * F_b;
  for (const Eigen::MatrixXd& a : problem.problem.ellipsoids) {
    normal += 3 * a.rightCols(q).transpose() * a.rightCols(q);
  }
  const Eigen::MatrixXd left =
      F_b.transpose() - (F_b.transpose() * F.leftCols(motions)) * (gain.topRows(motions) * F.transpose());
  const Eigen::MatrixXd T = linalg::PivotedCholesky(normal).solve(left);
  if (problem.information_rhs.size() > 0) {
    result.z = T * problem.information_rhs;
  }
  Eigen::MatrixXd error = T * F;
  error.rightCols(q).diagonal().array() -= 1.0;
  const BoundedMotion motion = bounded_motion(coordinates, bounds);
  const Eigen::MatrixXd bias = error * motion.bounded;
  const Eigen::MatrixXd free = error * motion.free;
  constexpr double kRounding = 1e-6;  // of an unbounded motion itself: followed exactly
  result.guaranteed_rms.resize(q);
  for (Eigen::Index k = 0; k < q; ++k) {
    double worst = 0.0;
    Eigen::Index at = 0;
    for (const Eigen::Index size : motion.block_sizes) {
      worst += bias.row(k).segment(at, size).norm();
      at += size;
    }
    const double unit = coordinates.biases(Eigen::VectorXd::Unit(motions + q, motions + k))(k);
    const bool follows = free.row(k).norm() <= kRounding * motion.free.row(motions + k).norm();
    result.guaranteed_rms(k) =
        follows ? unit * std::hypot(worst, T.row(k).norm()) : std::numeric_limits<double>::infinity();
  }
  return result;
}

namespace detail {

/// Largest second-order remainder of one measurement over its sigma; `linear`: its linearised deviation.
inline double remainder_ratio(SensorKind kind, const sensor::Padded& computed,
                              const sensor::Linearised& model, const sensor::Padded& linear,
                              const Eigen::Matrix3d& noise) {
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
  result.biases = problem.coordinates.biases(z);
  result.bias_parameters = problem.coordinates.bias_parameters();
  const std::vector<double> offsets_s = problem.coordinates.time_offsets_s(z, scenario.stations.size());
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
    const double made_s = m.t_s + offsets_s[m.station];
    RelativeMotion motion = relative_motion(problem.nominal, problem.stations[m.station], made_s);
    motion.position_m += deviation.position(made_s);
    motion.velocity_mps += deviation.velocity(made_s);
    const sensor::Padded bias =
        bias_columns(result.bias_parameters, m.station, sensor::Padded::Zero()) * result.biases;
    const sensor::Padded computed =
        sensor::measure(station.kind, motion.position_m, motion.velocity_mps) + bias;
    const RelativeMotion about = linearised_motion(problem, m.station, m.t_s);
    const sensor::Linearised model = sensor::linearise(station.kind, about.position_m, about.velocity_mps);
    const double about_s = m.t_s + problem.time_offsets_s[m.station];
    RelativeMotion shift{.position_m = deviation.position(about_s),
                         .velocity_mps = deviation.velocity(about_s),
                         .acceleration_mps2 = Eigen::Vector3d::Zero()};
    if (problem.linearised_about) {
      shift.position_m -= problem.linearised_about->position(about_s);
      shift.velocity_mps -= problem.linearised_about->velocity(about_s);
    }
    const sensor::Padded linear = bias + model.J_value_position * shift.position_m +
                                  model.J_value_velocity * shift.velocity_mps +
                                  time_rate(model, about) * (made_s - about_s);
    const sensor::Padded residual = sensor::difference(station.kind, sensor::padded(m.value), computed);
    const sensor::Padded whitened = lower.triangularView<Eigen::Lower>().solve(residual);
    result.chi2 += whitened.squaredNorm();
    result.residuals.push_back({.t_s = m.t_s,
                                .station = m.station,
                                .value = sensor::unpadded(residual, size),
                                .whitened = sensor::unpadded(whitened, size)});
    ratio = std::max(ratio, detail::remainder_ratio(station.kind, computed, model, linear, lower));
  }
  result.linearisation = {.ratio = ratio,
                          .iterations = problem.linearised_about ? 1 : 0,
                          .converged = problem.linearised_about.has_value()};
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::estimate
