// SPDX-License-Identifier: Apache-2.0
/// @file
/// Measured bearings of the beacon and the extended Kalman filter that turns them into a position.
#pragma once

#include <cmath>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/packet.hpp"
#include "trammel/linalg/small_cholesky.hpp"
#include "trammel/observer/closed_form.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

/// What is measured.
enum class BearingKind {
  kTangents,  ///< y/x and z/x
  kAngles,    ///< azimuth atan(y/x) and elevation atan(-z/hypot(x, y)) of the beacon, rad; x < 0
};

/// Value and Jacobian of a measurement at `position` relative to the beacon.
template <class Real>
struct Bearing {
  Vector2<Real> value;
  Eigen::Matrix<Real, 2, 3> J_bearing_position;
};

template <class Real>
[[nodiscard]] Vector2<Real> bearing_value(BearingKind kind, const Vector3<Real>& position) {
  if (kind == BearingKind::kTangents) {
    const Real inverse = 1.0 / position.x();
    return {position.y() * inverse, position.z() * inverse};
  }
  using std::atan2;
  using std::sqrt;
  const Real horizontal = sqrt(position.x() * position.x() + position.y() * position.y());
  return {atan2(-position.y(), -position.x()), atan2(-position.z(), horizontal)};
}

template <class Real>
[[nodiscard]] Bearing<Real> bearing(BearingKind kind, const Vector3<Real>& position) {
  using std::sqrt;
  Bearing<Real> result;
  result.value = bearing_value(kind, position);
  auto& jacobian = result.J_bearing_position;
  jacobian(0, 2) = 0.0;
  if (kind == BearingKind::kTangents) {
    const Real inverse = 1.0 / position.x();
    jacobian(0, 0) = -result.value.x() * inverse;
    jacobian(1, 0) = -result.value.y() * inverse;
    jacobian(0, 1) = jacobian(1, 2) = inverse;
    jacobian(1, 1) = 0.0;
    return result;
  }
  const Real horizontal2 = position.x() * position.x() + position.y() * position.y();
  const Real horizontal = sqrt(horizontal2);
  const Real distance2 = horizontal2 + position.z() * position.z();
  const Real pull = position.z() / (horizontal * distance2);
  jacobian(0, 0) = -position.y() / horizontal2;
  jacobian(0, 1) = position.x() / horizontal2;
  jacobian(1, 0) = pull * position.x();
  jacobian(1, 1) = pull * position.y();
  jacobian(1, 2) = -horizontal / distance2;
  return result;
}

/// Inverse of an information matrix with x eliminated last: D22 is well conditioned and the last pivot is the
/// information on x alone, 1/Gamma_11. The lower triangle counts.
///
/// | symbol | meaning                          |
/// |--------|----------------------------------|
/// | H      | D22^-1, covariance of y, z given x |
/// | b      | -H d1 = Gamma_1i/Gamma_11        |
/// | g      | Gamma_11 = 1/(d11 + d1'b)        |
template <class Real>
class InformationInverse {
 public:
  [[gnu::always_inline]] explicit InformationInverse(const Matrix3<Real>& information) {
    const Real inverse =
        1.0 / (information(1, 1) * information(2, 2) - information(2, 1) * information(2, 1));
    h11_ = information(2, 2) * inverse;
    h21_ = -information(2, 1) * inverse;
    h22_ = information(1, 1) * inverse;
    b1_ = -(h11_ * information(1, 0) + h21_ * information(2, 0));
    b2_ = -(h21_ * information(1, 0) + h22_ * information(2, 0));
    pivot_ = information(0, 0) + (b1_ * information(1, 0) + b2_ * information(2, 0));
    g_ = 1.0 / pivot_;
  }

  /// D^-1 v
  [[nodiscard]] Vector3<Real> solve(const Vector3<Real>& v) const {
    const Real x = g_ * (v.x() + (b1_ * v.y() + b2_ * v.z()));
    return {x, h11_ * v.y() + h21_ * v.z() + b1_ * x, h21_ * v.y() + h22_ * v.z() + b2_ * x};
  }
  /// Gamma_11
  [[nodiscard]] const Real& variance_x() const { return g_; }
  [[nodiscard]] ConditionalPrior<Real> prior() const { return {pivot_, b1_, b2_, h11_, h21_, h22_}; }
  /// Gamma = D^-1
  [[nodiscard]] Matrix3<Real> covariance() const {
    Matrix3<Real> gamma;
    gamma(0, 0) = g_;
    gamma(1, 0) = gamma(0, 1) = b1_ * g_;
    gamma(2, 0) = gamma(0, 2) = b2_ * g_;
    gamma(1, 1) = h11_ + b1_ * b1_ * g_;
    gamma(2, 1) = gamma(1, 2) = h21_ + b1_ * b2_ * g_;
    gamma(2, 2) = h22_ + b2_ * b2_ * g_;
    return gamma;
  }

 private:
  Real h11_;
  Real h21_;
  Real h22_;
  Real b1_;
  Real b2_;
  Real pivot_;
  Real g_;
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
template <class Real>
class BasicBearingFilter {
 public:
  /// `covariance` must be positive definite (require_covariance).
  BasicBearingFilter(const Eigen::Vector3d& position, const Eigen::Matrix3d& covariance, double sigma0,
                     BearingKind kind, double gate_m)
      : position_(position.cast<Real>()),
        information_(linalg::Cholesky3(covariance).solve(Eigen::Matrix3d::Identity()).cast<Real>()),
        inverse_(information_),
        weight_(1.0 / (sigma0 * sigma0)),
        gate_m_(gate_m),
        kind_(kind) {}

  void move(const Vector3<Real>& displacement) { position_ += displacement; }

  /// False where the gate skips the measurement.
  MaskOf<Real> update(const Vector2<Real>& measured) {
    const MaskOf<Real> used = position_.x() <= -gate_m_ && position_.x() < 0.0;
    const Real weight = select(used, Real(weight_), Real(0.0));
    if (kind_ == BearingKind::kTangents) {
      // H = (1/x) [-phi 1 0; -psi 0 1], written out.
      const Real inverse_x = 1.0 / select(used, position_.x(), Real(-1.0));
      const Real first = position_.y() * inverse_x;
      const Real second = position_.z() * inverse_x;
      const Real scaled = weight * inverse_x;
      const Real gain = scaled * inverse_x;
      information_(0, 0) += gain * (first * first + second * second);
      information_(1, 0) -= gain * first;
      information_(2, 0) -= gain * second;
      information_(1, 1) += gain;
      information_(2, 2) += gain;
      inverse_ = InformationInverse<Real>(information_);
      const Real pull1 = scaled * (measured.x() - first);
      const Real pull2 = scaled * (measured.y() - second);
      position_ += inverse_.solve({-first * pull1 - second * pull2, pull1, pull2});
      return used;
    }
    const Vector3<Real> from(select(used, position_.x(), Real(-1.0)), position_.y(), position_.z());
    const Bearing<Real> predicted = bearing(kind_, from);
    const auto& h = predicted.J_bearing_position;
    for (int column = 0; column < 3; ++column) {
      for (int row = column; row < 3; ++row) {
        information_(row, column) += weight * (h(0, row) * h(0, column) + h(1, row) * h(1, column));
      }
    }
    inverse_ = InformationInverse<Real>(information_);
    const Vector2<Real> innovation = measured - predicted.value;
    Vector3<Real> pull;
    for (int row = 0; row < 3; ++row) {
      pull[row] = weight * (h(0, row) * innovation.x() + h(1, row) * innovation.y());
    }
    position_ += inverse_.solve(pull);
    return used;
  }

  [[nodiscard]] const Vector3<Real>& position() const { return position_; }
  [[nodiscard]] Matrix3<Real> information() const {
    return information_.template selfadjointView<Eigen::Lower>();
  }
  [[nodiscard]] Matrix3<Real> covariance() const { return inverse_.covariance(); }
  [[nodiscard]] const Real& variance_x() const { return inverse_.variance_x(); }
  /// The estimate's covariance as a prior for the next plan.
  [[nodiscard]] ConditionalPrior<Real> prior() const { return inverse_.prior(); }

 private:
  Vector3<Real> position_;
  Matrix3<Real> information_;  ///< the lower triangle counts
  InformationInverse<Real> inverse_;
  double weight_;
  double gate_m_;
  BearingKind kind_;
};

using BearingFilter = BasicBearingFilter<double>;

}  // namespace trammel::inline TRAMMEL_ABI::observer
