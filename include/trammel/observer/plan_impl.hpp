// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of plan.hpp.
#pragma once

#include <algorithm>
#include <cmath>

#include "trammel/observer/general_weight.hpp"
#include "trammel/observer/plan.hpp"
#include "trammel/observer/single_weight.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

TRAMMEL_INLINE Eigen::Vector2d LateralPath::velocity(double x) const {
  double ramp = 0.0;
  double wave = 0.0;
  basis(x, ramp, wave);
  const double r = (end_ - x) / x * scale_end_;
  const double eta = 2.0 * half_xi_ * (r - 0.5);
  const double ramp_slope =
      inverse_span() * (straight() ? 2.0 : 2.0 * half_xi_ * inverse_sin_ * std::cos(eta));
  const double wave_slope = -2.0 * half_xi_ * inverse_span() * std::sin(eta);
  return speed_ * (middle_ + (ramp - ramp_slope / x) * half_change_ + (wave - wave_slope / x) * wave_);
}

TRAMMEL_INLINE double LateralPath::max_speed(const Eigen::Vector2d& offset) const {
  // phi makes at most one full oscillation: this many samples separate the extrema of the speed.
  constexpr int kSamples = 128;
  constexpr int kBisections = 60;
  // d|u|^2/ds is proportional to u . (phi - B) and phi - B to phi_ss; the sign of the factor is constant.
  const auto direction = [&](double x) -> double {
    const double eta = 2.0 * half_xi_ * ((end_ - x) / x * scale_end_ - 0.5);
    const Eigen::Vector2d bend =
        straight() ? Eigen::Vector2d::Zero().eval()
                   : (std::sin(eta) * inverse_sin_ * half_change_ + std::cos(eta) * wave_).eval();
    return (velocity(x) + offset).dot(bend);
  };
  double largest = 0.0;
  double r_previous = 1.0;
  double direction_previous = direction(start_);
  for (int i = 0; i <= kSamples; ++i) {
    const double r = 1.0 - static_cast<double>(i) / kSamples;
    const double x = i == 0 ? start_ : (i == kSamples ? end_ : x_at(r));
    largest = std::max(largest, (velocity(x) + offset).norm());
    const double here = direction(x);
    if (here * direction_previous < 0.0) {
      double low = r;
      double high = r_previous;
      for (int step = 0; step < kBisections; ++step) {
        const double middle = 0.5 * (low + high);
        (direction(x_at(middle)) * here > 0.0 ? low : high) = middle;
      }
      largest = std::max(largest, (velocity(x_at(low)) + offset).norm());
    }
    r_previous = r;
    direction_previous = here;
  }
  return largest;
}

TRAMMEL_INLINE Eigen::Vector3d Plan::position(double time_s) const {
  const double x = x_start_m + closing_speed_mps * time_s;
  const Eigen::Vector2d lateral = path.position(x);
  return {x, lateral.x(), lateral.y()};
}

TRAMMEL_INLINE Eigen::Vector2d Plan::control(double time_s) const {
  return path.velocity(x_start_m + closing_speed_mps * time_s) + beacon_drift_mps;
}

namespace detail {

/// Information matrix at T from q, b and D22(T): d22 = M, d1 = -M b, d11 = q + b'M b.
inline Eigen::Matrix3d final_information(const Eigen::Matrix2d& lateral, const Eigen::Vector2d& slope,
                                         double q) {
  const Eigen::Vector2d coupling = lateral * slope;
  Eigen::Matrix3d information;
  information << q + slope.dot(coupling), -coupling.x(), -coupling.y(),  //
      -coupling.x(), lateral(0, 0), lateral(0, 1),                       //
      -coupling.y(), lateral(1, 0), lateral(1, 1);
  return information;
}

inline Eigen::Matrix3d final_covariance(const Eigen::Matrix2d& lateral, const Eigen::Vector2d& slope,
                                        double q) {
  const double variance = 1.0 / q;
  Eigen::Matrix3d covariance;
  covariance(0, 0) = variance;
  covariance.block<2, 1>(1, 0) = slope * variance;
  covariance.block<1, 2>(0, 1) = slope.transpose() * variance;
  covariance.block<2, 2>(1, 1) = lateral + slope * (slope.transpose() * variance);
  return covariance;
}

}  // namespace detail

TRAMMEL_INLINE Plan make_plan(const PlanProblem& problem) {
  require_valid(problem);
  return make_plan_unchecked(problem);
}

TRAMMEL_INLINE Plan make_plan_unchecked(const PlanProblem& problem) {
  const ChannelProblem channels(problem);
  const Eigen::Vector3d& beta = problem.beta_per_s;
  Plan plan;
  PathShape shape;
  double bound = 0.0;
  PathValue value;
  const Eigen::Vector2d lateral_precision =
      channels.prior_precision + Eigen::Vector2d::Constant(channels.gain);
  if (beta.y() == 0.0 && beta.z() == 0.0) {
    const SingleWeightRoot root = solve_single_weight(channels, beta.x());
    shape = root.shape;
    plan.xi_critical = root.critical;
    plan.evaluations = root.evaluations;
    value = evaluate(channels, Frequency(shape.xi), shape.wave);
    // Dual value at p = xi/(sigma L), which the root makes sqrt(beta)/q; the latter also holds without
    // measurements (L = 0).
    const double p = channels.gain > 0.0 ? shape.xi / (channels.sigma * channels.gain)
                                         : std::sqrt(beta.x()) / value.range_information;
    bound = value.control_energy + p * (2.0 * std::sqrt(beta.x()) - p * value.range_information);
  } else {
    const GeneralWeightSolution solution = solve_general_weight(channels, beta);
    shape = solution.shape;
    plan.xi_critical = solution.critical;
    plan.evaluations = solution.evaluations;
    value = evaluate(channels, Frequency(shape.xi), shape.wave);
    bound = solution.lower_bound;
  }
  const Frequency frequency(shape.xi);
  const Eigen::Vector2d slope = channels.rotation.to_axes(value.slope);
  const Eigen::Matrix2d lateral = channels.rotation.to_axes_matrix(lateral_precision);
  const Eigen::Matrix2d lateral_inverse = channels.rotation.to_axes_matrix(lateral_precision.cwiseInverse());
  plan.information = detail::final_information(lateral, slope, value.range_information);
  plan.final_covariance_m2 = detail::final_covariance(lateral_inverse, slope, value.range_information);
  plan.xi = shape.xi;
  plan.epsilon_m = shape.xi / channels.span;
  plan.wave_amplitude = channels.rotation.to_axes(shape.wave);
  plan.wave_centre = channels.rotation.to_axes(channels.middle) - frequency.cos_half * plan.wave_amplitude;
  plan.information_gain = channels.gain;
  plan.path = LateralPath(channels, shape);
  plan.x_start_m = channels.x_start;
  plan.closing_speed_mps = channels.speed;
  plan.beacon_drift_mps = problem.beacon_velocity_mps.tail<2>();
  // Own u = relative u + drift: the difference of the energies depends on the end points alone.
  const Eigen::Vector2d displacement = problem.terminal_m - problem.position_m.tail<2>();
  const double drift_energy =
      plan.beacon_drift_mps.dot(2.0 * displacement + problem.time_to_go_s * plan.beacon_drift_mps);
  plan.cost_information = beta.dot(plan.final_covariance_m2.diagonal());
  plan.cost_control = value.control_energy + drift_energy;
  plan.cost = plan.cost_information + plan.cost_control;
  // Where both agree, rounding may put the bound above the cost.
  plan.lower_bound = std::min(bound + drift_energy, plan.cost);
  plan.status = plan.cost - plan.lower_bound <= kCertifiedGap * std::abs(plan.cost) ? PlanStatus::kOptimal
                                                                                    : PlanStatus::kBestFound;
  return plan;
}

}  // namespace trammel::inline TRAMMEL_ABI::observer
