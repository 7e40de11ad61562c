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
    : scenario_(scenario), trajectory_(assemble(scenario)) {
  require(!scenario.observations.empty(), "observations", "none", "measured values to fit");
  set_minimum_height(minimum_height_m);
  const trajectory::SplineBasis& basis = trajectory_.coordinates.basis();
  for_each_measurement(scenario, [&](const MeasurementSite& site) {
    const Station& station = scenario.stations[site.station];
    const Measurement& m = *site.observation;
    sites_.push_back(
        {.kind = station.kind,
         .station = site.station,
         .t_s = site.t_s,
         .reference = relative_motion(trajectory_.nominal, trajectory_.stations[site.station], site.t_s),
         .local = basis.at(site.t_s),
         .whiten = noise_factor(m.covariance ? *m.covariance : station.covariance, components(station.kind),
                                describe(scenario, site))
                       .triangularView<Eigen::Lower>()
                       .solve(Eigen::Matrix3d::Identity()),
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

TRAMMEL_INLINE void FitProblem::set_minimum_height(std::optional<double> height_m) {
  if (height_m && !std::isfinite(*height_m)) {
    throw Error({"minimum_height_m", shortest(*height_m), "a finite height"});
  }
  minimum_height_m_ = height_m;
}

TRAMMEL_INLINE FitProblem FitProblem::with_minimum_height(double height_m) const {
  FitProblem result = *this;
  result.set_minimum_height(height_m);
  return result;
}

TRAMMEL_INLINE FitProblem::LocalRows FitProblem::localise_rows(const Eigen::MatrixXd& rows) {
  const detail::NonzeroColumns local = detail::nonzero_columns(rows);
  LocalRows result{.first = local.first, .rows = rows.middleCols(local.first, local.count), .gram = {}};
  result.gram = result.rows.transpose() * result.rows;
  return result;
}

TRAMMEL_INLINE FitProblem::Deviation FitProblem::unpack(const Eigen::VectorXd& z) const {
  const MotionCoordinates& coordinates = trajectory_.coordinates;
  return {.coefficients = coordinates.coefficients(z).reshaped(3, coordinates.basis().coefficients()),
          .biases = coordinates.biases(z),
          .time_offsets_s = coordinates.time_offsets_s(z, scenario_.stations.size())};
}

TRAMMEL_INLINE FitProblem::Sighting FitProblem::see(const Site& site, const Deviation& deviation) const {
  Sighting result{.local = site.local, .motion = site.reference};
  const double offset_s = deviation.time_offsets_s[site.station];
  if (offset_s != 0.0) {
    const double made_s = site.t_s + offset_s;
    result.motion = relative_motion(trajectory_.nominal, trajectory_.stations[site.station], made_s);
    result.local = trajectory_.coordinates.basis().at(made_s);
  }
  const Eigen::Matrix3d near = deviation.coefficients.middleCols<3>(result.local.first);
  result.motion.position_m += near * result.local.value.transpose();
  result.motion.velocity_mps += near * result.local.rate.transpose();
  if (deviation.biases.size() > 0) {
    result.motion.acceleration_mps2 += near * result.local.second_rate.transpose();
    result.bias =
        bias_columns(trajectory_.coordinates.bias_parameters(), site.station, sensor::Padded::Zero()) *
        deviation.biases;
  }
  return result;
}

TRAMMEL_INLINE double FitProblem::chi2(const Eigen::VectorXd& z) const {
  const Deviation deviation = unpack(z);
  double sum = 0.0;
  try {
    for (const Site& site : sites_) {
      const Sighting seen = see(site, deviation);
      const sensor::Padded difference = sensor::difference(
          site.kind, site.value,
          sensor::measure(site.kind, seen.motion.position_m, seen.motion.velocity_mps) + seen.bias);
      sum += (site.whiten * difference).squaredNorm();
    }
  } catch (const Error&) {  // a sensor cannot be linearised at a trial point: it is no better than the others
    return std::numeric_limits<double>::infinity();
  }
  return std::isfinite(sum) ? sum : std::numeric_limits<double>::infinity();
}

TRAMMEL_INLINE Eigen::VectorXd FitProblem::residuals(const Eigen::VectorXd& z, Eigen::MatrixXd* A) const {
  const MotionCoordinates& coordinates = trajectory_.coordinates;
  const Deviation deviation = unpack(z);
  const Eigen::Index motions = coordinates.all_parameters();
  const Eigen::Index q = deviation.biases.size();
  const auto count = static_cast<Eigen::Index>(sites_.size());
  Eigen::VectorXd r(3 * count);
  Eigen::MatrixXd dense;
  if (A != nullptr) {
    dense = Eigen::MatrixXd::Zero(3 * count, motions + q);
  }
  for (Eigen::Index k = 0; k < count; ++k) {
    const Site& site = sites_[static_cast<std::size_t>(k)];
    const Sighting seen = see(site, deviation);
    const sensor::Linearised model =
        sensor::linearise(site.kind, seen.motion.position_m, seen.motion.velocity_mps);
    r.segment<3>(3 * k) = site.whiten * sensor::difference(site.kind, site.value, model.value + seen.bias);
    if (A == nullptr) {
      continue;
    }
    for (Eigen::Index i = 0; i < 3; ++i) {
      const Eigen::Matrix3d J =
          seen.local.value(i) * model.J_value_position + seen.local.rate(i) * model.J_value_velocity;
      dense.block<3, 3>(3 * k, 3 * (seen.local.first + i)) = site.whiten * J;
    }
    dense.block(3 * k, motions, 3, q) =
        site.whiten *
        bias_columns(coordinates.bias_parameters(), site.station, time_rate(model, seen.motion));
  }
  if (A != nullptr) {
    *A = coordinates.restrict_rows(dense);
  }
  return r;
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

TRAMMEL_INLINE double FitProblem::expand_misfit(const Deviation& deviation, Eigen::MatrixXd& normal,
                                                Eigen::MatrixXd& descent) const {
  const MotionCoordinates& coordinates = trajectory_.coordinates;
  const Eigen::Index motions = coordinates.all_parameters();
  const Eigen::Index q = deviation.biases.size();
  double squares = 0.0;
  for (const Site& site : sites_) {
    const Sighting seen = see(site, deviation);
    sensor::Linearised model = sensor::linearise(site.kind, seen.motion.position_m, seen.motion.velocity_mps);
    Eigen::Matrix<double, 3, Eigen::Dynamic> J_bias;
    if (q > 0) {
      J_bias = site.whiten *
               bias_columns(coordinates.bias_parameters(), site.station, time_rate(model, seen.motion));
    }
    model.J_value_position = site.whiten * model.J_value_position;
    const sensor::Padded r = site.whiten * sensor::difference(site.kind, site.value, model.value + seen.bias);
    squares += r.squaredNorm();
    // J = value x J_position + rate x J_velocity, whose products are sums of 3 x 3 blocks.
    const Eigen::Index first = 3 * seen.local.first;
    const auto& value = seen.local.value;
    const auto& rate = seen.local.rate;
    const Eigen::Matrix3d pp = model.J_value_position.transpose().lazyProduct(model.J_value_position);
    const Eigen::RowVector3d rp = r.transpose().lazyProduct(model.J_value_position);
    for (Eigen::Index i = 0; i < 3; ++i) {
      descent.middleCols<3>(first + 3 * i) += value(i) * rp;
      for (Eigen::Index j = 0; j <= i; ++j) {
        normal.block<3, 3>(first + 3 * i, first + 3 * j) += (value(i) * value(j)) * pp;
      }
    }
    const bool sees_velocity = !model.J_value_velocity.isZero(0.0);
    model.J_value_velocity = site.whiten * model.J_value_velocity;
    if (q > 0) {
      const Eigen::MatrixXd bp = J_bias.transpose() * model.J_value_position;
      const Eigen::MatrixXd bv = J_bias.transpose() * model.J_value_velocity;
      for (Eigen::Index i = 0; i < 3; ++i) {
        normal.block(motions, first + 3 * i, q, 3) += value(i) * bp + rate(i) * bv;
      }
      normal.bottomRightCorner(q, q) += J_bias.transpose() * J_bias;
      descent.rightCols(q) += r.transpose() * J_bias;
    }
    if (!sees_velocity) {
      continue;
    }
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
  return squares;
}

TRAMMEL_INLINE Quadratic FitProblem::expand(const Eigen::VectorXd& z, double mu) const {
  Quadratic result;
  result.cost = mu * (ellipsoid_barrier(z) + floor_barrier(z));
  if (!std::isfinite(result.cost)) {
    return result;
  }
  const MotionCoordinates& coordinates = trajectory_.coordinates;
  const Deviation deviation = unpack(z);
  const Eigen::Index count = coordinates.all_parameters() + deviation.biases.size();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
  Eigen::MatrixXd descent = Eigen::MatrixXd::Zero(1, count);
  result.chi2 = std::numeric_limits<double>::infinity();
  try {
    result.chi2 = expand_misfit(deviation, normal, descent);
  } catch (const Error&) {  // a sensor cannot be linearised at a trial point: it is no better than the others
  }
  result.cost += result.chi2 / 2;
  if (!std::isfinite(result.cost)) {
    result.cost = std::numeric_limits<double>::infinity();
    return result;
  }
  const Eigen::MatrixXd half = coordinates.restrict_rows(normal).transpose();
  result.hessian = coordinates.restrict_rows(half);
  result.gradient = -coordinates.restrict_rows(descent).transpose();
  for (const LocalRows& a : bounds_) {
    const Eigen::VectorXd T = a.times(z);
    const double room = 1.0 - T.squaredNorm();
    const Eigen::VectorXd v = (2 / room) * (a.rows.transpose() * T);
    result.gradient.segment(a.first, v.size()) += mu * v;
    result.hessian.block(a.first, a.first, v.size(), v.size()) +=
        (2 * mu / room) * a.gram + (mu * v).lazyProduct(v.transpose());
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
      result.hessian.block(row.first, row.first, size, size) += (weight / (near * near)) * row.gram;
    }
  }
  return result;
}

TRAMMEL_INLINE double FitProblem::distance_m(const Eigen::VectorXd& a, const Eigen::VectorXd& b) const {
  return (trajectory_.problem.criterion_factor * (a - b)).norm();
}

TRAMMEL_INLINE Eigen::VectorXd FitProblem::pull_inside(const Eigen::VectorXd& z, double share,
                                                       const Eigen::VectorXd& centre) const {
  const MotionCoordinates& coordinates = trajectory_.coordinates;
  Eigen::VectorXd theta = coordinates.motion(z);
  Eigen::VectorXd biases = coordinates.biases(z);
  const auto shrink = [&](Eigen::Index ellipsoid) {
    const double size =
        ellipsoid == TrajectoryProblem::kNoEllipsoid
            ? 0.0
            : (trajectory_.problem.ellipsoids[static_cast<std::size_t>(ellipsoid)] * z).norm();
    return size > share ? share / size : 1.0;
  };
  for (std::size_t l = 0; l < trajectory_.ellipsoid_of_bound.size(); ++l) {
    theta.segment<3>(3 * static_cast<Eigen::Index>(l)) *= shrink(trajectory_.ellipsoid_of_bound[l]);
  }
  for (Eigen::Index k = 0; k < biases.size(); ++k) {
    const std::size_t station = coordinates.bias_parameters()[static_cast<std::size_t>(k)].station;
    biases(k) *= shrink(trajectory_.ellipsoid_of_station[station]);
  }
  Eigen::VectorXd result = coordinates.from_motion(theta, biases);
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
