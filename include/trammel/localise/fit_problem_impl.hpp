// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of fit_problem.hpp.
#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/localise/fit_problem.hpp"
#include "trammel/problem/noise.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

TRAMMEL_INLINE FitProblem::FitProblem(const Scenario& scenario, std::optional<double> minimum_height_m)
    : scenario_(scenario), minimum_height_m_(minimum_height_m), trajectory_(assemble(scenario)) {
  require(!scenario.observations.empty(), "observations", "none", "measured values to fit");
  if (minimum_height_m && !std::isfinite(*minimum_height_m)) {
    throw Error({"minimum_height_m", std::to_string(*minimum_height_m), "a finite height"});
  }
  const trajectory::SplineBasis& basis = trajectory_.coordinates.basis();
  for_each_measurement(scenario, [&](const MeasurementSite& site) {
    const Station& station = scenario.stations[site.station];
    const Measurement& m = *site.observation;
    sites_.push_back({.kind = station.kind,
                      .reference_m = trajectory_.nominal.position(site.t_s) - station.position_m,
                      .reference_mps = trajectory_.nominal.velocity(site.t_s),
                      .local = basis.at(site.t_s),
                      .whiten = noise_factor(m.covariance ? *m.covariance : station.covariance,
                                             components(station.kind), describe(scenario, site)),
                      .value = sensor::padded(m.value)});
  });
  constexpr int kPerSegment = 4;
  for (Eigen::Index i = 0; i < basis.segments(); ++i) {
    for (int k = 0; k < kPerSegment; ++k) {
      grid_s_.push_back(basis.knot(i) + basis.length_s(i) * k / kPerSegment);
    }
  }
  grid_s_.push_back(basis.end_s());
  const auto count = static_cast<Eigen::Index>(grid_s_.size());
  height_rows_.resize(count, parameters());
  height_offset_m_.resize(count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const double t = grid_s_[static_cast<std::size_t>(j)];
    height_rows_.row(j) = trajectory_.coordinates.position_rows(t).row(2);
    height_offset_m_(j) = trajectory_.nominal.position(t).z();
  }
}

TRAMMEL_INLINE sensor::Padded FitProblem::residual(const Site& site, const Eigen::MatrixXd& c,
                                                   Local* J) const {
  const Eigen::Matrix3d near = c.middleCols<3>(site.local.first);
  const Eigen::Vector3d position = site.reference_m + near * site.local.value.transpose();
  const Eigen::Vector3d velocity = site.reference_mps + near * site.local.rate.transpose();
  const auto whiten = site.whiten.triangularView<Eigen::Lower>();
  if (J == nullptr) {
    return whiten.solve(
        sensor::difference(site.kind, site.value, sensor::measure(site.kind, position, velocity)));
  }
  sensor::Linearised model = sensor::linearise(site.kind, position, velocity);
  whiten.solveInPlace(model.J_value_position);
  whiten.solveInPlace(model.J_value_velocity);
  for (Eigen::Index k = 0; k < 3; ++k) {
    J->middleCols<3>(3 * k) =
        site.local.value(k) * model.J_value_position + site.local.rate(k) * model.J_value_velocity;
  }
  return whiten.solve(sensor::difference(site.kind, site.value, model.value));
}

TRAMMEL_INLINE double FitProblem::chi2(const Eigen::VectorXd& z) const {
  const Eigen::MatrixXd c =
      trajectory_.coordinates.coefficients(z).reshaped(3, trajectory_.coordinates.basis().coefficients());
  double sum = 0.0;
  try {
    for (const Site& site : sites_) {
      sum += residual(site, c, nullptr).squaredNorm();
    }
  } catch (const Error&) {  // a sensor cannot be linearised at a trial point: it is no better than the others
    return std::numeric_limits<double>::infinity();
  }
  return std::isfinite(sum) ? sum : std::numeric_limits<double>::infinity();
}

TRAMMEL_INLINE double FitProblem::ellipsoid_barrier(const Eigen::VectorXd& z) const {
  double sum = 0.0;
  for (const Eigen::MatrixXd& a : trajectory_.problem.ellipsoids) {
    const double room = 1.0 - (a * z).squaredNorm();
    if (!(room > 0.0)) {
      return std::numeric_limits<double>::infinity();
    }
    sum -= std::log(room);
  }
  return sum;
}

TRAMMEL_INLINE double FitProblem::floor_barrier(const Eigen::VectorXd& z) const {
  if (!minimum_height_m_) {
    return 0.0;
  }
  const Eigen::VectorXd room = (height_offset_m_ + height_rows_ * z).array() - *minimum_height_m_;
  if (!(room.minCoeff() > 0.0)) {
    return std::numeric_limits<double>::infinity();
  }
  return -static_cast<double>(trajectory_.coordinates.basis().coefficients()) /
         static_cast<double>(room.size()) * room.array().log().sum();
}

TRAMMEL_INLINE double FitProblem::lowest_height_m(const Eigen::VectorXd& z) const {
  return (height_offset_m_ + height_rows_ * z).minCoeff();
}

TRAMMEL_INLINE bool FitProblem::inside(const Eigen::VectorXd& z) const {
  return std::isfinite(ellipsoid_barrier(z)) &&
         (!minimum_height_m_ || lowest_height_m(z) > *minimum_height_m_);
}

TRAMMEL_INLINE double FitProblem::cost(const Eigen::VectorXd& z, double mu) const {
  const double barrier = mu * (ellipsoid_barrier(z) + floor_barrier(z));
  return std::isfinite(barrier) ? chi2(z) / 2 + barrier : std::numeric_limits<double>::infinity();
}

TRAMMEL_INLINE Quadratic FitProblem::expand(const Eigen::VectorXd& z, double mu) const {
  const MotionCoordinates& coordinates = trajectory_.coordinates;
  const Eigen::Index all = coordinates.all_parameters();
  const Eigen::MatrixXd c = coordinates.coefficients(z).reshaped(3, coordinates.basis().coefficients());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(all, all);
  Eigen::MatrixXd descent = Eigen::MatrixXd::Zero(1, all);
  double squares = 0.0;
  for (const Site& site : sites_) {
    Local J;
    const sensor::Padded r = residual(site, c, &J);
    const Eigen::Index first = 3 * site.local.first;
    normal.block<9, 9>(first, first) += J.transpose() * J;
    descent.middleCols<9>(first) += r.transpose() * J;
    squares += r.squaredNorm();
  }
  Quadratic result;
  const Eigen::MatrixXd half = coordinates.restrict_rows(normal).transpose();
  result.hessian = coordinates.restrict_rows(half);
  result.gradient = -coordinates.restrict_rows(descent).transpose();
  for (const Eigen::MatrixXd& a : trajectory_.problem.ellipsoids) {
    const Eigen::VectorXd T = a * z;
    const double room = 1.0 - T.squaredNorm();
    const Eigen::VectorXd v = (2 / room) * (a.transpose() * T);
    result.gradient += mu * v;
    result.hessian += (2 * mu / room) * (a.transpose() * a) + mu * v * v.transpose();
  }
  if (minimum_height_m_) {
    const Eigen::VectorXd room = (height_offset_m_ + height_rows_ * z).array() - *minimum_height_m_;
    const double weight =
        mu * static_cast<double>(coordinates.basis().coefficients()) / static_cast<double>(room.size());
    const Eigen::VectorXd inverse = room.cwiseInverse();
    result.gradient -= weight * (height_rows_.transpose() * inverse);
    const Eigen::MatrixXd scaled = inverse.asDiagonal() * height_rows_;
    result.hessian += weight * (scaled.transpose() * scaled);
  }
  result.cost = squares / 2 + mu * (ellipsoid_barrier(z) + floor_barrier(z));
  return result;
}

TRAMMEL_INLINE double FitProblem::distance_m(const Eigen::VectorXd& a, const Eigen::VectorXd& b) const {
  return (trajectory_.problem.criterion_factor * (a - b)).norm();
}

TRAMMEL_INLINE Eigen::VectorXd FitProblem::pull_inside(const Eigen::VectorXd& z, double share,
                                                       const Eigen::VectorXd& centre) const {
  const MotionCoordinates& coordinates = trajectory_.coordinates;
  Eigen::VectorXd theta = coordinates.motion(z);
  for (std::size_t l = 0; l < trajectory_.ellipsoid_of_bound.size(); ++l) {
    const Eigen::Index at = trajectory_.ellipsoid_of_bound[l];
    if (at == TrajectoryProblem::kNoEllipsoid) {
      continue;
    }
    const double size = (trajectory_.problem.ellipsoids[static_cast<std::size_t>(at)] * z).norm();
    if (size > share) {
      theta.segment<3>(3 * static_cast<Eigen::Index>(l)) *= share / size;
    }
  }
  Eigen::VectorXd result = coordinates.from_motion(theta);
  constexpr double kShrink = 0.7;
  constexpr int kShrinks = 60;  // 5e-10 of the distance: as good as the centre
  for (int i = 0; i < kShrinks; ++i) {
    if (inside(result)) {
      return result;
    }
    result = centre + kShrink * (result - centre);
  }
  return centre;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
