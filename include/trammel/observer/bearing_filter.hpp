// SPDX-License-Identifier: Apache-2.0
/// @file
/// Measured bearings of the beacon and the extended Kalman filter that turns them into a position.
#pragma once

#include <cmath>
#include <utility>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/cholesky.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

/// What is measured.
enum class BearingKind {
  kTangents,  ///< y/x and z/x
  kAngles,    ///< azimuth atan(y/x) and elevation atan(-z/hypot(x, y)) of the beacon, rad; x < 0
};

/// Value and Jacobian of a measurement at `position` relative to the beacon.
struct Bearing {
  Eigen::Vector2d value;
  Eigen::Matrix<double, 2, 3> J_bearing_position;
};

[[nodiscard]] inline Eigen::Vector2d bearing_value(BearingKind kind, const Eigen::Vector3d& position) {
  if (kind == BearingKind::kTangents) {
    return position.tail<2>() / position.x();
  }
  return {std::atan2(-position.y(), -position.x()),
          std::atan2(-position.z(), std::hypot(position.x(), position.y()))};
}

[[nodiscard]] inline Bearing bearing(BearingKind kind, const Eigen::Vector3d& position) {
  Bearing result;
  result.value = bearing_value(kind, position);
  if (kind == BearingKind::kTangents) {
    const double inverse = 1.0 / position.x();
    result.J_bearing_position << -result.value.x() * inverse, inverse, 0.0,  //
        -result.value.y() * inverse, 0.0, inverse;
    return result;
  }
  const double horizontal2 = position.head<2>().squaredNorm();
  const double horizontal = std::sqrt(horizontal2);
  const double distance2 = position.squaredNorm();
  const double pull = position.z() / (horizontal * distance2);
  result.J_bearing_position << -position.y() / horizontal2, position.x() / horizontal2, 0.0,  //
      pull * position.x(), pull * position.y(), -horizontal / distance2;
  return result;
}

/// Extended Kalman filter in information form for a position that moves by known displacements.
///
///   predict: R += displacement, D unchanged (no process noise: exact);
///   update:  D += H'H/sigma0^2,  R += D^-1 H' (zeta - h(R))/sigma0^2,  H and h at the predicted R.
///
/// D can not lose positive definiteness. H has to be taken at the prediction: the measured tangents or an
/// iterated update correlate H with the noise and bias the range by hundreds of metres. Update gate: H grows
/// as 1/x, so an estimate that rounding or a bad prior puts near the beacon's plane would take over all
/// confidence; measurements are skipped while the predicted x > -gate. Source: Emelyanov and Rubinovich
/// (2020), section 1 (the filter in covariance form).
class BearingFilter {
 public:
  /// `covariance` must be positive definite (require_covariance).
  BearingFilter(const Eigen::Vector3d& position, const Eigen::Matrix3d& covariance, double sigma0,
                BearingKind kind, double gate_m)
      : position_(position),
        information_(linalg::Cholesky3(covariance).solve(Eigen::Matrix3d::Identity())),
        weight_(1.0 / (sigma0 * sigma0)),
        gate_m_(gate_m),
        kind_(kind) {}

  void move(const Eigen::Vector3d& displacement) { position_ += displacement; }

  /// False when the gate skips the measurement.
  bool update(const Eigen::Vector2d& measured) {
    if (!(position_.x() <= -gate_m_) || position_.x() == 0.0) {
      return false;
    }
    const Bearing predicted = bearing(kind_, position_);
    const auto& h = predicted.J_bearing_position;
    information_.noalias() += weight_ * (h.transpose() * h);
    const Eigen::Vector3d pull = weight_ * (h.transpose() * (measured - predicted.value));
    position_ += solve(pull);
    return true;
  }

  [[nodiscard]] const Eigen::Vector3d& position() const { return position_; }
  [[nodiscard]] const Eigen::Matrix3d& information() const { return information_; }
  [[nodiscard]] Eigen::Matrix3d covariance() const {
    const Eigen::Matrix3d inverse = linalg::Cholesky3(information_).solve(Eigen::Matrix3d::Identity());
    return 0.5 * (inverse + inverse.transpose());
  }

 private:
  /// D^-1 v by elimination of x last: D22 is well conditioned and the Schur complement is the information on
  /// x.
  [[nodiscard]] Eigen::Vector3d solve(const Eigen::Vector3d& v) const {
    const double d22 = information_(1, 1);
    const double r = information_(2, 1) / d22;
    const double d33 = information_(2, 2) - r * information_(2, 1);
    const double c2 = information_(1, 0);
    const double c3 = information_(2, 0) - r * c2;
    const double l2 = c2 / d22;
    const double l3 = c3 / d33;
    const double d11 = information_(0, 0) - l2 * c2 - l3 * c3;
    const double v3 = v.z() - r * v.y();
    const double x = (v.x() - l2 * v.y() - l3 * v3) / d11;
    const double z = (v3 - c3 * x) / d33;
    return {x, (v.y() - c2 * x) / d22 - r * z, z};
  }

  Eigen::Vector3d position_;
  Eigen::Matrix3d information_;
  double weight_;
  double gate_m_;
  BearingKind kind_;
};

}  // namespace trammel::inline TRAMMEL_ABI::observer
