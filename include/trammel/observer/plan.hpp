// SPDX-License-Identifier: Apache-2.0
/// @file
/// Optimal path of a bearings-only observer with a certified lower bound.
#pragma once

#include <limits>
#include <string_view>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/observer/closed_form.hpp"
#include "trammel/observer/plan_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

/// A path across OX as a function of x, relative to the beacon:
///   (y, z) = x phi,  phi = fm + fd sin(eta)/sin(xi/2) + 2 w sin(xi r/2) sin(xi (1 - r)/2),
///   r = (1/x - 1/a)/ds (1 at the start, 0 at the end), eta = xi (r - 1/2).
class LateralPath {
 public:
  LateralPath() = default;
  LateralPath(const ChannelProblem& problem, const PathShape& shape);

  /// (y, z) at x, x_start <= x <= x_end, m.
  [[nodiscard]] Eigen::Vector2d position(double x) const {
    double ramp = 0.0;
    double wave = 0.0;
    basis(x, ramp, wave);
    return x * (middle_ + ramp * half_change_ + wave * wave_);
  }
  /// (y', z') at x, m/s.
  [[nodiscard]] Eigen::Vector2d velocity(double x) const;
  /// Largest |(y', z') + offset| along the path, m/s, to rounding: the extrema are where the velocity is
  /// orthogonal to phi - B, found by bisection between samples.
  [[nodiscard]] double max_speed(const Eigen::Vector2d& offset = Eigen::Vector2d::Zero()) const;

 private:
  /// From this half phase on the addition theorem is exact enough for the second pair of sines.
  static constexpr double kAddition = 0.05;

  void basis(double x, double& ramp, double& wave) const {
    const double r = (end_ - x) / (x * end_) * inverse_span_;
    const double rest = (x - start_) / (x * start_) * inverse_span_;
    const double s1 = std::sin(half_xi_ * r);
    const double c1 = std::cos(half_xi_ * r);
    double s2 = sin_ * c1 - cos_ * s1;
    double c2 = cos_ * c1 + sin_ * s1;
    if (half_xi_ < kAddition) {
      s2 = std::sin(half_xi_ * rest);
      c2 = std::cos(half_xi_ * rest);
    }
    ramp = straight_ ? r - rest : (s1 * c2 - c1 * s2) * inverse_sin_;
    wave = 2.0 * s1 * s2;
  }
  [[nodiscard]] double x_at(double r) const { return 1.0 / (1.0 / end_ + r / inverse_span_); }

  double speed_ = 0.0;
  double start_ = -1.0;
  double end_ = -1.0;
  double inverse_span_ = 0.0;
  double half_xi_ = 0.0;
  double sin_ = 0.0;  ///< of half_xi_
  double cos_ = 1.0;
  double inverse_sin_ = 0.0;
  bool straight_ = true;
  Eigen::Vector2d middle_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d half_change_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d wave_ = Eigen::Vector2d::Zero();
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
