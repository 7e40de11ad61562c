// SPDX-License-Identifier: Apache-2.0
/// @file
/// Measured bearings of the beacon and the extended Kalman filter that turns them into a position.
#pragma once

#include <cmath>
#include <utility>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/small_cholesky.hpp"

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

/// Information matrix factored with x eliminated last: D22 is well conditioned and the last pivot is the
/// information on x alone, 1/Gamma_11.
class InformationFactor {
 public:
  explicit InformationFactor(const Eigen::Matrix3d& information)
      : d22_(information(1, 1)),
        r_(information(2, 1) / d22_),
        d33_(information(2, 2) - r_ * information(2, 1)),
        c2_(information(1, 0)),
        c3_(information(2, 0) - r_ * c2_),
        l2_(c2_ / d22_),
        l3_(c3_ / d33_),
        d11_(information(0, 0) - l2_ * c2_ - l3_ * c3_) {}

  /// D^-1 v
  [[nodiscard]] Eigen::Vector3d solve(const Eigen::Vector3d& v) const {
    const double v3 = v.z() - r_ * v.y();
    const double x = (v.x() - l2_ * v.y() - l3_ * v3) / d11_;
    const double z = (v3 - c3_ * x) / d33_;
    return {x, (v.y() - c2_ * x) / d22_ - r_ * z, z};
  }
  /// Gamma_11
  [[nodiscard]] double variance_x() const { return 1.0 / d11_; }
  /// Gamma = D^-1
  [[nodiscard]] Eigen::Matrix3d covariance() const {
    const double g11 = 1.0 / d11_;
    const double b3 = -l3_;
    const double b2 = -l2_ - r_ * b3;
    const double h33 = 1.0 / d33_;
    Eigen::Matrix3d gamma;
    gamma(0, 0) = g11;
    gamma(1, 0) = gamma(0, 1) = b2 * g11;
    gamma(2, 0) = gamma(0, 2) = b3 * g11;
    gamma(1, 1) = 1.0 / d22_ + r_ * r_ * h33 + b2 * b2 * g11;
    gamma(2, 1) = gamma(1, 2) = -r_ * h33 + b2 * b3 * g11;
    gamma(2, 2) = h33 + b3 * b3 * g11;
    return gamma;
  }

 private:
  double d22_;
  double r_;
  double d33_;
  double c2_;
  double c3_;
  double l2_;
  double l3_;
  double d11_;
};

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
    if (kind_ == BearingKind::kTangents) {
      // H = (1/x) [-phi 1 0; -psi 0 1], written out.
      const double inverse = 1.0 / position_.x();
      const double first = position_.y() * inverse;
      const double second = position_.z() * inverse;
      const double gain = weight_ * inverse * inverse;
      information_(0, 0) += gain * (first * first + second * second);
      information_(1, 0) -= gain * first;
      information_(2, 0) -= gain * second;
      information_(1, 1) += gain;
      information_(2, 2) += gain;
      const double pull1 = weight_ * inverse * (measured.x() - first);
      const double pull2 = weight_ * inverse * (measured.y() - second);
      position_ += InformationFactor(information_).solve({-first * pull1 - second * pull2, pull1, pull2});
      return true;
    }
    const Bearing predicted = bearing(kind_, position_);
    const auto& h = predicted.J_bearing_position;
    information_.noalias() += weight_ * (h.transpose() * h);
    const Eigen::Vector3d pull = weight_ * (h.transpose() * (measured - predicted.value));
    position_ += InformationFactor(information_).solve(pull);
    return true;
  }

  [[nodiscard]] const Eigen::Vector3d& position() const { return position_; }
  [[nodiscard]] Eigen::Matrix3d information() const { return information_.selfadjointView<Eigen::Lower>(); }
  [[nodiscard]] Eigen::Matrix3d covariance() const { return InformationFactor(information_).covariance(); }
  [[nodiscard]] double variance_x() const { return InformationFactor(information_).variance_x(); }

 private:
  Eigen::Vector3d position_;
  Eigen::Matrix3d information_;  ///< the lower triangle counts
  double weight_;
  double gate_m_;
  BearingKind kind_;
};

}  // namespace trammel::inline TRAMMEL_ABI::observer
