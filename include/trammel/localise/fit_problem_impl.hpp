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

TRAMMEL_INLINE detail::NonzeroColumns detail::nonzero_columns(const Eigen::Ref<const Eigen::MatrixXd>& rows) {
  Eigen::Index first = 0;
  Eigen::Index end = rows.cols();
  while (first < end && rows.col(first).isZero(0.0)) {
    ++first;
  }
  while (end > first && rows.col(end - 1).isZero(0.0)) {
    --end;
  }
  return {.first = first, .count = end - first};
}

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
  for (const Eigen::MatrixXd& a : trajectory_.problem.ellipsoids) {
    bounds_.push_back(localise_rows(a));
  }
  constexpr int kPerSegment = 4;
  for (Eigen::Index i = 0; i < basis.segments(); ++i) {
    for (int k = 0; k < kPerSegment; ++k) {
      grid_s_.push_back(basis.knot(i) + basis.length_s(i) * k / kPerSegment);
    }
  }
  grid_s_.push_back(basis.end_s());
  const auto count = static_cast<Eigen::Index>(grid_s_.size());
  height_offset_m_.resize(count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const double t = grid_s_[static_cast<std::size_t>(j)];
    height_rows_.push_back(localise_rows(trajectory_.coordinates.position_rows(t).row(2)));
    height_offset_m_(j) = trajectory_.nominal.position(t).z();
  }
}

TRAMMEL_INLINE FitProblem::LocalRows FitProblem::localise_rows(const Eigen::MatrixXd& rows) {
  const detail::NonzeroColumns local = detail::nonzero_columns(rows);
  return {.first = local.first, .rows = rows.middleCols(local.first, local.count)};
}

TRAMMEL_INLINE double FitProblem::chi2(const Eigen::VectorXd& z) const {
  const Eigen::MatrixXd c =
      trajectory_.coordinates.coefficients(z).reshaped(3, trajectory_.coordinates.basis().coefficients());
  double sum = 0.0;
  try {
    for (const Site& site : sites_) {
      const Eigen::Matrix3d near = c.middleCols<3>(site.local.first);
      const Eigen::Vector3d position = site.reference_m + near * site.local.value.transpose();
      const Eigen::Vector3d velocity = site.reference_mps + near * site.local.rate.transpose();
      const sensor::Padded difference =
          sensor::difference(site.kind, site.value, sensor::measure(site.kind, position, velocity));
      sum += site.whiten.triangularView<Eigen::Lower>().solve(difference).squaredNorm();
    }
  } catch (const Error&) {  // a sensor cannot be linearised at a trial point: it is no better than the others
    return std::numeric_limits<double>::infinity();
  }
  return std::isfinite(sum) ? sum : std::numeric_limits<double>::infinity();
}

TRAMMEL_INLINE double FitProblem::ellipsoid_barrier(const Eigen::VectorXd& z) const {
  double sum = 0.0;
  for (const LocalRows& a : bounds_) {
    const double room = 1.0 - a.times(z).squaredNorm();
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
  const Eigen::VectorXd room = heights_m(z).array() - *minimum_height_m_;
  if (!(room.minCoeff() > 0.0)) {
    return std::numeric_limits<double>::infinity();
  }
  return -static_cast<double>(trajectory_.coordinates.basis().coefficients()) /
         static_cast<double>(room.size()) * room.array().log().sum();
}

TRAMMEL_INLINE double FitProblem::lowest_height_m(const Eigen::VectorXd& z) const {
  return heights_m(z).minCoeff();
}

TRAMMEL_INLINE Eigen::VectorXd FitProblem::heights_m(const Eigen::VectorXd& z) const {
  Eigen::VectorXd result = height_offset_m_;
  for (std::size_t j = 0; j < height_rows_.size(); ++j) {
    result(static_cast<Eigen::Index>(j)) += height_rows_[j].times(z)(0);
  }
  return result;
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
    const Eigen::Matrix3d near = c.middleCols<3>(site.local.first);
    const Eigen::Vector3d position = site.reference_m + near * site.local.value.transpose();
    const Eigen::Vector3d velocity = site.reference_mps + near * site.local.rate.transpose();
    const auto whiten = site.whiten.triangularView<Eigen::Lower>();
    sensor::Linearised model = sensor::linearise(site.kind, position, velocity);
    whiten.solveInPlace(model.J_value_position);
    const sensor::Padded r = whiten.solve(sensor::difference(site.kind, site.value, model.value));
    squares += r.squaredNorm();
    // J = value x J_position + rate x J_velocity, whose products are sums of 3 x 3 blocks.
    const Eigen::Index first = 3 * site.local.first;
    const auto& value = site.local.value;
    const auto& rate = site.local.rate;
    const Eigen::Matrix3d pp = model.J_value_position.transpose().lazyProduct(model.J_value_position);
    const Eigen::RowVector3d rp = r.transpose().lazyProduct(model.J_value_position);
    for (Eigen::Index i = 0; i < 3; ++i) {
      descent.middleCols<3>(first + 3 * i) += value(i) * rp;
      for (Eigen::Index j = 0; j <= i; ++j) {
        normal.block<3, 3>(first + 3 * i, first + 3 * j) += (value(i) * value(j)) * pp;
      }
    }
    if (model.J_value_velocity.isZero(0.0)) {
      continue;
    }
    whiten.solveInPlace(model.J_value_velocity);
    const Eigen::Matrix3d pv = model.J_value_position.transpose().lazyProduct(model.J_value_velocity);
    const Eigen::Matrix3d vv = model.J_value_velocity.transpose().lazyProduct(model.J_value_velocity);
    const Eigen::RowVector3d rv = r.transpose().lazyProduct(model.J_value_velocity);
    for (Eigen::Index i = 0; i < 3; ++i) {
      descent.middleCols<3>(first + 3 * i) += rate(i) * rv;
      for (Eigen::Index j = 0; j <= i; ++j) {
        normal.block<3, 3>(first + 3 * i, first + 3 * j) +=
            (value(i) * rate(j)) * pv + (rate(i) * value(j)) * pv.transpose() + (rate(i) * rate(j)) * vv;
      }
    }
  }
  normal.triangularView<Eigen::StrictlyUpper>() = normal.transpose();
  Quadratic result;
  const Eigen::MatrixXd half = coordinates.restrict_rows(normal).transpose();
  result.hessian = coordinates.restrict_rows(half);
  result.gradient = -coordinates.restrict_rows(descent).transpose();
  for (const LocalRows& a : bounds_) {
    const Eigen::VectorXd T = a.times(z);
    const double room = 1.0 - T.squaredNorm();
    const Eigen::VectorXd v = (2 / room) * (a.rows.transpose() * T);
    result.gradient.segment(a.first, v.size()) += mu * v;
    result.hessian.block(a.first, a.first, v.size(), v.size()) +=
        (2 * mu / room) * (a.rows.transpose() * a.rows) + mu * v * v.transpose();
  }
  if (minimum_height_m_) {
    const Eigen::VectorXd room = heights_m(z).array() - *minimum_height_m_;
    const double weight =
        mu * static_cast<double>(coordinates.basis().coefficients()) / static_cast<double>(room.size());
    for (std::size_t j = 0; j < height_rows_.size(); ++j) {
      const LocalRows& row = height_rows_[j];
      const double near = room(static_cast<Eigen::Index>(j));
      const Eigen::Index size = row.rows.cols();
      result.gradient.segment(row.first, size) -= (weight / near) * row.rows.transpose();
      result.hessian.block(row.first, row.first, size, size) +=
          (weight / (near * near)) * (row.rows.transpose() * row.rows);
    }
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
