// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of motion_coordinates.hpp.
#pragma once

#include <string>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/linalg/qr.hpp"
#include "trammel/problem/motion_coordinates.hpp"
#include "trammel/trajectory/motion_parameters.hpp"

namespace trammel::inline TRAMMEL_ABI {

TRAMMEL_INLINE std::vector<BiasParameter> bias_parameters(const Scenario& scenario) {
  std::vector<BiasParameter> result;
  for (std::size_t i = 0; i < scenario.stations.size(); ++i) {
    const StationBias& bias = scenario.stations[i].bias;
    for (Eigen::Index c = 0; c < bias.components.size(); ++c) {
      if (bias.components(c) != 0.0) {
        result.push_back({.station = i, .component = c, .semi_axis = bias.components(c)});
      }
    }
    if (bias.time_s != 0.0) {
      result.push_back({.station = i, .component = BiasParameter::kTimeOffset, .semi_axis = bias.time_s});
    }
  }
  return result;
}

TRAMMEL_INLINE MotionCoordinates::MotionCoordinates(trajectory::SplineBasis basis, const MotionBounds& bounds,
                                                    std::vector<BiasParameter> biases)
    : basis_(std::move(basis)),
      removed_(static_cast<std::size_t>(all_parameters()), false),
      biases_(std::move(biases)) {
  for (Eigen::Index l = 0; l < basis_.coefficients(); ++l) {
    const Eigen::Vector3d& axes = semi_axes(bounds, l);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const Eigen::Index place = 3 * l + axis;
      removed_[static_cast<std::size_t>(place)] = axes(axis) == 0.0;
      if (axes(axis) != 0.0) {
        kept_.push_back(place);
      }
    }
  }
  require(!kept_.empty(), "bounds", "zero for every parameter", "at least one parameter left to estimate");
  scale_ = Eigen::VectorXd::Ones(motion_parameters() + static_cast<Eigen::Index>(biases_.size()));
  if (motion_parameters() < all_parameters()) {
    make_null_spaces();
  }
}

TRAMMEL_INLINE void MotionCoordinates::make_null_spaces() {
  const Eigen::Index count = basis_.coefficients();
  Eigen::MatrixXd motion = trajectory::motion_from_coefficients(basis_);
  motion.rowwise().normalize();
  null_space_ = Eigen::MatrixXd::Zero(all_parameters(), motion_parameters());
  Eigen::Index column = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<Eigen::Index> zero;
    for (Eigen::Index l = 0; l < count; ++l) {
      if (removed_[static_cast<std::size_t>(3 * l + axis)]) {
        zero.push_back(l);
      }
    }
    const auto gone = static_cast<Eigen::Index>(zero.size());
    Eigen::MatrixXd space = Eigen::MatrixXd::Identity(count, count);
    if (gone > 0) {
      const Eigen::MatrixXd constraints = motion(zero, Eigen::all).transpose();
      space = linalg::Qr(constraints).householderQ() * space;
    }
    for (Eigen::Index j = 0; j < count - gone; ++j) {
      for (Eigen::Index i = 0; i < count; ++i) {
        null_space_(3 * i + axis, column) = space(i, gone + j);
      }
      ++column;
    }
  }
}

TRAMMEL_INLINE void MotionCoordinates::set_scale(const Eigen::VectorXd& scale) {
  require(scale.size() == parameters(), "scale", std::to_string(scale.size()) + " entries",
          std::to_string(parameters()));
  require(scale.allFinite() && scale.minCoeff() > 0.0, "scale", "an entry that is not positive and finite",
          "positive entries");
  scale_ = scale;
}

TRAMMEL_INLINE Eigen::MatrixXd MotionCoordinates::restrict_rows(const Eigen::MatrixXd& rows) const {
  const auto q = static_cast<Eigen::Index>(biases_.size());
  if (rows.cols() != all_parameters() && rows.cols() != all_parameters() + q) {
    throw Error({"rows", std::to_string(rows.cols()) + " columns",
                 std::to_string(all_parameters()) + ", three per bound, and the biases or none"});
  }
  if (null_space_.size() == 0 && q == 0) {
    return rows * scale_.asDiagonal();
  }
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(rows.rows(), parameters());
  const Eigen::MatrixXd motion = rows.leftCols(all_parameters());
  result.leftCols(motion_parameters()) =
      null_space_.size() == 0 ? motion : Eigen::MatrixXd(motion * null_space_);
  if (rows.cols() > all_parameters()) {
    result.rightCols(q) = rows.rightCols(q);
  }
  return result * scale_.asDiagonal();
}

TRAMMEL_INLINE Eigen::MatrixXd MotionCoordinates::coefficients(const Eigen::MatrixXd& z) const {
  require(z.rows() == parameters(), "z", std::to_string(z.rows()) + " rows",
          std::to_string(parameters()) + ", the number of parameters");
  const Eigen::MatrixXd scaled =
      scale_.head(motion_parameters()).asDiagonal() * z.topRows(motion_parameters());
  return null_space_.size() == 0 ? scaled : Eigen::MatrixXd(null_space_ * scaled);
}

TRAMMEL_INLINE Eigen::MatrixXd MotionCoordinates::biases(const Eigen::MatrixXd& z) const {
  const auto q = static_cast<Eigen::Index>(biases_.size());
  return scale_.tail(q).asDiagonal() * z.bottomRows(q);
}

TRAMMEL_INLINE std::vector<double> MotionCoordinates::time_offsets_s(const Eigen::VectorXd& z,
                                                                     std::size_t stations) const {
  std::vector<double> result(stations, 0.0);
  const Eigen::VectorXd values = biases(z);
  for (std::size_t k = 0; k < biases_.size(); ++k) {
    if (biases_[k].component == BiasParameter::kTimeOffset) {
      result.at(biases_[k].station) = values(static_cast<Eigen::Index>(k));
    }
  }
  return result;
}

TRAMMEL_INLINE Eigen::MatrixXd MotionCoordinates::motion(const Eigen::MatrixXd& z) const {
  const Eigen::MatrixXd c = coefficients(z);
  Eigen::MatrixXd theta = Eigen::MatrixXd::Zero(all_parameters(), z.cols());
  for (Eigen::Index l = 0; l < basis_.coefficients(); ++l) {
    const trajectory::MotionRow row = trajectory::motion_row_of_coefficients(basis_, l);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (removed_[static_cast<std::size_t>(3 * l + axis)]) {
        continue;
      }
      for (Eigen::Index k = 0; k < 3; ++k) {
        theta.row(3 * l + axis) += row.weight(k) * c.row(3 * (row.first + k) + axis);
      }
    }
  }
  return theta;
}

TRAMMEL_INLINE Eigen::MatrixXd MotionCoordinates::from_motion(const Eigen::MatrixXd& theta) const {
  return from_motion(theta, Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(biases_.size()), theta.cols()));
}

TRAMMEL_INLINE Eigen::MatrixXd MotionCoordinates::from_motion(const Eigen::MatrixXd& theta,
                                                              const Eigen::MatrixXd& biases) const {
  require(theta.rows() == all_parameters(), "theta", std::to_string(theta.rows()) + " rows",
          std::to_string(all_parameters()) + ", three per bound");
  require(biases.rows() == static_cast<Eigen::Index>(biases_.size()) && biases.cols() == theta.cols(),
          "biases", std::to_string(biases.rows()) + " x " + std::to_string(biases.cols()),
          std::to_string(biases_.size()) + " rows and the columns of theta");
  Eigen::MatrixXd kept(parameters(), theta.cols());
  kept << theta(kept_, Eigen::all), biases;
  return from_kept_motion() * kept;
}

TRAMMEL_INLINE Eigen::MatrixXd MotionCoordinates::from_kept_motion() const {
  const Eigen::MatrixXd map = trajectory::coefficients_from_motion(basis_);
  Eigen::MatrixXd c = Eigen::MatrixXd::Zero(all_parameters(), motion_parameters());
  for (Eigen::Index k = 0; k < motion_parameters(); ++k) {
    const Eigen::Index place = kept_[static_cast<std::size_t>(k)];
    const Eigen::Index axis = place % 3;
    for (Eigen::Index j = 0; j < basis_.coefficients(); ++j) {
      c(3 * j + axis, k) = map(j, place / 3);
    }
  }
  Eigen::MatrixXd inner = Eigen::MatrixXd::Identity(parameters(), parameters());
  // N has orthonormal columns and c lies in their span.
  inner.topLeftCorner(motion_parameters(), motion_parameters()) =
      null_space_.size() == 0 ? c : Eigen::MatrixXd(null_space_.transpose() * c);
  return scale_.cwiseInverse().asDiagonal() * inner;
}

TRAMMEL_INLINE Eigen::MatrixXd MotionCoordinates::kept_motion_rows() const {
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(parameters(), parameters());
  Eigen::MatrixXd rows(parameters(), parameters());
  rows << motion(identity)(kept_, Eigen::all), biases(identity);
  return rows;
}

TRAMMEL_INLINE MotionCoordinates::Rows3 MotionCoordinates::local_rows(
    const trajectory::LocalBasis<double>& local, const Eigen::Matrix<double, 1, 3>& weight) const {
  Rows3 rows = Rows3::Zero(3, parameters());
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Index block = 3 * (local.first + k);
    if (null_space_.size() == 0) {
      rows.middleCols<3>(block).diagonal().array() += weight(k);
    } else {
      rows.leftCols(motion_parameters()) += weight(k) * null_space_.middleRows<3>(block);
    }
  }
  return rows * scale_.asDiagonal();
}

TRAMMEL_INLINE MotionCoordinates::Rows3 MotionCoordinates::position_rows(double t_s) const {
  const trajectory::LocalBasis<double> local = basis_.at(t_s);
  return local_rows(local, local.value);
}

TRAMMEL_INLINE MotionCoordinates::Rows3 MotionCoordinates::velocity_rows(double t_s) const {
  const trajectory::LocalBasis<double> local = basis_.at(t_s);
  return local_rows(local, local.rate);
}

TRAMMEL_INLINE MotionCoordinates::Rows3 MotionCoordinates::acceleration_rows(double t_s) const {
  const trajectory::LocalBasis<double> local = basis_.at(t_s);
  return local_rows(local, local.second_rate);
}

TRAMMEL_INLINE trajectory::QuadraticSpline<double> MotionCoordinates::spline(const Eigen::VectorXd& z) const {
  const Eigen::MatrixXd c = coefficients(z);
  return {basis_, c.reshaped(3, basis_.coefficients())};
}

}  // namespace trammel::inline TRAMMEL_ABI
