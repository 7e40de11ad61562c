// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of flight.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/observer/flight.hpp"
#include "trammel/observer/plan_limits.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

TRAMMEL_INLINE std::vector<FlightEvent> flight_events(double duration_s, double measurement_interval_s,
                                                      double replan_interval_s) {
  // Moments closer than this part of the shorter interval are the same.
  constexpr double kCoincide = 1e-6;
  const double tolerance = kCoincide * std::min({measurement_interval_s, replan_interval_s, duration_s});
  std::vector<FlightEvent> events{{0.0, false, true}};
  double measure = 1.0;
  double replan = 1.0;
  while (true) {
    const double next_measure = measure * measurement_interval_s;
    const double next_replan = replan * replan_interval_s;
    double time = std::min(next_measure, next_replan);
    if (!(time < duration_s - tolerance)) {
      break;
    }
    const bool measures = next_measure - time <= tolerance;
    const bool replans = next_replan - time <= tolerance;
    // The measurement's time counts: planning at it uses it.
    time = measures ? next_measure : next_replan;
    events.push_back({time, measures, replans});
    measure += measures ? 1.0 : 0.0;
    replan += replans ? 1.0 : 0.0;
  }
  events.push_back({duration_s, measure * measurement_interval_s <= duration_s + tolerance, false});
  return events;
}

TRAMMEL_INLINE FlightLoop::FlightLoop(const PlanProblem& prior, const FlightSettings& settings)
    : prior_(prior), settings_(settings) {
  // Fractions of the final distance: 200 m and 50 m for the 2 km of the published example.
  constexpr double kFinalDistancePart = 0.1;
  constexpr double kGatePart = 0.025;
  // More events than this are a wrong unit, not a flight.
  constexpr double kMaxEvents = 1e6;
  require_valid(prior);
  if (!(settings.replan_interval_s > 0.0)) {
    throw Error({"replan_interval_s", shortest(settings.replan_interval_s), "a positive number"});
  }
  if (!(settings.max_lateral_speed_mps > 0.0)) {
    throw Error({"max_lateral_speed_mps", shortest(settings.max_lateral_speed_mps), "a positive number"});
  }
  if (std::isnan(settings.min_final_distance_m)) {
    settings_.min_final_distance_m = kFinalDistancePart * std::abs(prior.final_x_m());
  }
  if (std::isnan(settings.gate_m)) {
    settings_.gate_m = kGatePart * std::abs(prior.final_x_m());
  }
  if (!(settings_.min_final_distance_m > 0.0 && std::isfinite(settings_.min_final_distance_m))) {
    throw Error({"min_final_distance_m", shortest(settings.min_final_distance_m), "a positive number"});
  }
  if (!(settings_.gate_m >= 0.0 && std::isfinite(settings_.gate_m))) {
    throw Error({"gate_m", shortest(settings.gate_m), "a number >= 0"});
  }
  require(settings.filter != FilterKind::kRangeGrid || settings.measured == BearingKind::kTangents, "filter",
          "the grid filter with measured angles", "tangents, or the extended Kalman filter");
  const double events =
      prior.time_to_go_s / std::min(prior.measurement_interval_s, settings.replan_interval_s);
  if (!(events < kMaxEvents)) {
    throw Error({"measurement_interval_s", std::to_string(events) + " intervals in the flight",
                 "fewer than a million (check the units)"});
  }
  events_ = flight_events(prior.time_to_go_s, prior.measurement_interval_s, settings.replan_interval_s);
  for (const FlightEvent& event : events_) {
    measurements_ += static_cast<int>(event.measure);
  }
  if (single_weight()) {
    const double limit = largest_planned_x(0.0);
    const Eigen::Vector3d start(std::fmin(prior.position_m.x(), limit), prior.position_m.y(),
                                prior.position_m.z());
    const ChannelProblem channels(prior, prior.time_to_go_s, start, conditional_prior(prior.covariance_m2));
    first_xi_ = solve_single_weight(channels, prior.beta_per_s.x()).shape.xi;
  }
}

TRAMMEL_INLINE Plan FlightLoop::plan_from(const Eigen::Vector3d& estimate, const Eigen::Matrix3d& covariance,
                                          double time_s, bool& moved_back) const {
  PlanProblem problem = prior_;
  problem.time_to_go_s = prior_.time_to_go_s - time_s;
  problem.covariance_m2 = covariance;
  problem.position_m = estimate;
  const double limit = largest_planned_x(time_s);
  moved_back = !(estimate.x() <= limit);
  if (moved_back) {
    problem.position_m.x() = limit;
  }
  return std::isfinite(settings_.max_lateral_speed_mps)
             ? fastest_allowed_plan(problem, settings_.max_lateral_speed_mps)
             : make_plan_unchecked(problem);
}

}  // namespace trammel::inline TRAMMEL_ABI::observer
