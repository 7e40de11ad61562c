// SPDX-License-Identifier: Apache-2.0
/// @file
/// Optimal path of a bearings-only observer with a certified lower bound.
#pragma once

#include <cstddef>
#include <limits>
#include <string_view>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/elementary.hpp"
#include "trammel/core/packet.hpp"
#include "trammel/observer/closed_form.hpp"
#include "trammel/observer/plan_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

/// A path across OX as a function of x, relative to the beacon:
///   (y, z) = x phi,  phi = fm + fd sin(eta)/sin(xi/2) + 2 w sin(xi r/2) sin(xi (1 - r)/2),
///   r = (1/x - 1/a)/ds (1 at the start, 0 at the end), eta = xi (r - 1/2).
template <class Real>
class PathCurve {
 public:
  PathCurve() = default;
  PathCurve(const BasicChannelProblem<Real>& problem, const BasicPathShape<Real>& shape);

  /// (y, z) at x, x_start <= x <= x_end, m.
  [[nodiscard]] Vector2<Real> position(const Real& x) const {
    Real ramp;
    Real wave;
    basis(x, ramp, wave);
    return {x * (middle_.x() + ramp * half_change_.x() + wave * wave_.x()),
            x * (middle_.y() + ramp * half_change_.y() + wave * wave_.y())};
  }
  /// Takes over one lane from another path.
  void set_lane(std::size_t lane, const PathCurve<double>& path);

 protected:
  void basis(const Real& x, Real& ramp, Real& wave) const;

  Real start_ = -1.0;
  Real end_ = -1.0;
  Real scale_start_ = 0.0;  ///< 1/(x0 ds)
  Real scale_end_ = 0.0;    ///< 1/(a ds)
  Real half_xi_ = 0.0;
  Real sin_ = 0.0;  ///< of half_xi_
  Real cos_ = 1.0;
  Real inverse_sin_ = 0.0;  ///< 0: straight to every digit
  Vector2<Real> middle_ = Vector2<Real>::Zero();
  Vector2<Real> half_change_ = Vector2<Real>::Zero();
  Vector2<Real> wave_ = Vector2<Real>::Zero();

  template <class Other>
  friend class PathCurve;
};

template <class Real>
PathCurve<Real>::PathCurve(const BasicChannelProblem<Real>& problem, const BasicPathShape<Real>& shape)
    : start_(problem.x_start),
      end_(problem.x_end),
      scale_start_(problem.inverse_flown * problem.x_end),
      scale_end_(problem.inverse_flown * problem.x_start),
      half_xi_(0.5 * shape.xi),
      middle_(problem.rotation.to_axes(problem.middle)),
      half_change_(problem.rotation.to_axes(problem.half_change)),
      wave_(problem.rotation.to_axes(shape.wave)) {
  // Below this the ratio of sines is the straight line in every digit, and would underflow further down.
  constexpr double kStraight = 1e-100;
  const SineCosine<Real> turn = sine_cosine(half_xi_);
  sin_ = turn.sine;
  cos_ = turn.cosine;
  const MaskOf<Real> straight = shape.xi < kStraight;
  inverse_sin_ = select(straight, Real(0.0), 1.0 / select(straight, Real(1.0), sin_));
}

template <class Real>
void PathCurve<Real>::basis(const Real& x, Real& ramp, Real& wave) const {
  // From this half phase on the addition theorem is exact enough for the second pair of sines.
  constexpr double kAddition = 0.05;
  const Real inverse_x = 1.0 / x;
  const Real r = (end_ - x) * inverse_x * scale_end_;
  const SineCosine<Real> first = sine_cosine<Real>(half_xi_ * r);
  SineCosine<Real> second{sin_ * first.cosine - cos_ * first.sine, cos_ * first.cosine + sin_ * first.sine};
  const MaskOf<Real> slow = half_xi_ < kAddition;
  if (any(slow)) {
    const Real rest = (x - start_) * inverse_x * scale_start_;
    const SineCosine<Real> direct = sine_cosine<Real>(half_xi_ * rest);
    second = {select(slow, direct.sine, second.sine), select(slow, direct.cosine, second.cosine)};
    ramp = select(inverse_sin_ == 0.0, r - rest,
                  (first.sine * second.cosine - first.cosine * second.sine) * inverse_sin_);
  } else {
    ramp = (first.sine * second.cosine - first.cosine * second.sine) * inverse_sin_;
  }
  wave = 2.0 * first.sine * second.sine;
}

template <class Real>
void PathCurve<Real>::set_lane(std::size_t lane, const PathCurve<double>& path) {
  using trammel::set_lane;
  set_lane(start_, lane, path.start_);
  set_lane(end_, lane, path.end_);
  set_lane(scale_start_, lane, path.scale_start_);
  set_lane(scale_end_, lane, path.scale_end_);
  set_lane(half_xi_, lane, path.half_xi_);
  set_lane(sin_, lane, path.sin_);
  set_lane(cos_, lane, path.cos_);
  set_lane(inverse_sin_, lane, path.inverse_sin_);
  for (int i = 0; i < 2; ++i) {
    set_lane(middle_[i], lane, path.middle_[i]);
    set_lane(half_change_[i], lane, path.half_change_[i]);
    set_lane(wave_[i], lane, path.wave_[i]);
  }
}

/// The path of a plan, with its speed.
class LateralPath : public PathCurve<double> {
 public:
  LateralPath() = default;
  LateralPath(const ChannelProblem& problem, const PathShape& shape)
      : PathCurve(problem, shape), speed_(problem.speed) {}

  /// (y', z') at x, m/s.
  [[nodiscard]] Eigen::Vector2d velocity(double x) const;
  /// Largest |(y', z') + offset| along the path, m/s, to rounding: the extrema are where the velocity is
  /// orthogonal to phi - B, found by bisection between samples.
  [[nodiscard]] double max_speed(const Eigen::Vector2d& offset = Eigen::Vector2d::Zero()) const;

 private:
  [[nodiscard]] bool straight() const { return inverse_sin_ == 0.0; }
  [[nodiscard]] double x_at(double r) const { return 1.0 / (1.0 / end_ + r / inverse_span()); }
  [[nodiscard]] double inverse_span() const { return scale_end_ * end_; }

  double speed_ = 0.0;
};

/// What is known about a plan's optimality.
enum class PlanStatus {
  kOptimal,    ///< cost and lower bound agree to kCertifiedGap
  kBestFound,  ///< best of several starts; lower_bound tells how far from the optimum it can be
};

/// Largest relative gap between cost and lower bound that counts as proof of optimality in double precision.
inline constexpr double kCertifiedGap = 1e-9;

[[nodiscard]] constexpr std::string_view to_string(PlanStatus status) noexcept {
  return status == PlanStatus::kOptimal ? "optimal" : "best_found";
}

/// Answer to a PlanProblem.
///
/// | symbol  | field              | unit  | meaning |
/// |---------|--------------------|-------|------------------------------------------------------------------|
/// | xi      | xi                 | 1     | phase of the path's wave between start and end | | xi_1    |
/// xi_critical        | 1     | the single-weight optimum lies in [0, xi_1]                      | | epsilon
/// | epsilon_m          | m     | xi/ds; the phase at x is epsilon/x                               | | B |
/// wave_centre        | 1     | the tangents oscillate about it: phi_ss = -eps^2 (phi - B)       | | w |
/// wave_amplitude     | 1     | B = fm - w cos(xi/2)                                             | | L |
/// information_gain   | 1     | ds/(V sigma^2)                                                   | | D(T) |
/// information        | 1/m^2 | information matrix at T                                          | |
/// Gamma(T)| final_covariance_m2| m^2   | its inverse                                                      |
/// | J       | cost               | m^2/s | cost_information + cost_control | | g       | lower_bound | m^2/s
/// | no path costs less (dual bound, rounding not enclosed)           |
struct Plan {
  PlanStatus status = PlanStatus::kBestFound;
  double xi = std::numeric_limits<double>::quiet_NaN();
  double xi_critical = std::numeric_limits<double>::quiet_NaN();
  double epsilon_m = std::numeric_limits<double>::quiet_NaN();
  Eigen::Vector2d wave_centre = Eigen::Vector2d::Zero();
  Eigen::Vector2d wave_amplitude = Eigen::Vector2d::Zero();
  double information_gain = std::numeric_limits<double>::quiet_NaN();
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d final_covariance_m2 = Eigen::Matrix3d::Zero();
  double cost = std::numeric_limits<double>::quiet_NaN();
  double cost_information = std::numeric_limits<double>::quiet_NaN();
  double cost_control = std::numeric_limits<double>::quiet_NaN();
  double lower_bound = std::numeric_limits<double>::quiet_NaN();
  int evaluations = 0;  ///< of the secular equation or of the dual function
  LateralPath path;     ///< relative to the beacon
  double x_start_m = std::numeric_limits<double>::quiet_NaN();
  double closing_speed_mps = std::numeric_limits<double>::quiet_NaN();
  Eigen::Vector2d beacon_drift_mps = Eigen::Vector2d::Zero();  ///< own u = relative u + this

  /// (cost - lower_bound)/cost; 0 when both are 0.
  [[nodiscard]] double relative_gap() const {
    return cost == lower_bound ? 0.0 : (cost - lower_bound) / cost;
  }
  /// Largest own lateral speed sqrt(u1^2 + u2^2) along the path, m/s.
  [[nodiscard]] double max_speed_mps() const { return path.max_speed(beacon_drift_mps); }
  /// (x, y, z) relative to the beacon at `time_s` after the start of the plan.
  [[nodiscard]] Eigen::Vector3d position(double time_s) const;
  /// Own lateral velocity (u1, u2) at `time_s` after the start of the plan.
  [[nodiscard]] Eigen::Vector2d control(double time_s) const;
};

/// Solves the auxiliary optimal control problem: the single-weight algorithm when only beta_1 is positive
/// (see single_weight.hpp), the straight line when no weight is, the dual Newton method otherwise
/// (general_weight.hpp).
///
/// Guarantee: `lower_bound` <= optimal cost <= `cost` up to rounding; status tells whether they agree. With a
/// single weight they always do. Throws Error for a problem that breaks its rules (require_valid).
/// Cost: about one microsecond (single weight), tens of microseconds otherwise.
/// Source: Emelyanov and Rubinovich (2020), sections 3 and 4, with corrections: J_Gamma of (3.19) needs the
/// factor 1/sigma; the root in (0, xi_1) is unique and the global optimum; a symmetric start has its optimum
/// at xi_1 itself, which the paper's root search does not find.
[[nodiscard]] Plan make_plan(const PlanProblem& problem);

/// make_plan without the checks of require_valid, for loops that guarantee them.
[[nodiscard]] Plan make_plan_unchecked(const PlanProblem& problem);

}  // namespace trammel::inline TRAMMEL_ABI::observer

#ifndef TRAMMEL_COMPILED
#include "trammel/observer/plan_impl.hpp"
#endif
