// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of fixed_lag.hpp.
#pragma once

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/window/fixed_lag.hpp"
#include "trammel/window/flight.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

namespace fixed_lag_detail {

/// The part of a plan between two knots, with measurements; the start is unknown inside the flight.
inline Scenario part(const Scenario& plan, Eigen::Index first, Eigen::Index behind,
                     const std::vector<Measurement>& measurements) {
  Scenario result = plan;
  result.knots_s.assign(plan.knots_s.begin() + first, plan.knots_s.begin() + behind + 1);
  result.bounds.acceleration_mps2.assign(plan.bounds.acceleration_mps2.begin() + first,
                                         plan.bounds.acceleration_mps2.begin() + behind);
  if (first > 0) {
    result.bounds.position_m.setConstant(std::numeric_limits<double>::infinity());
    result.bounds.velocity_mps.setConstant(std::numeric_limits<double>::infinity());
    result.nominal.position_m +=
        (result.knots_s.front() - plan.knots_s.front()) * plan.nominal.velocity_mps;  // a straight line's
  }
  for (Station& station : result.stations) {
    station.times_s.clear();
  }
  result.observations.clear();
  for (const Measurement& m : measurements) {
    if (m.t_s >= result.knots_s.front() && m.t_s <= result.knots_s.back()) {
      result.observations.push_back(m);
    }
  }
  return result;
}

}  // namespace fixed_lag_detail

TRAMMEL_INLINE FixedLag::FixedLag(Scenario plan, const FixedLagSettings& settings)
    : plan_(std::move(plan)), settings_(settings) {
  plan_.observations.clear();
  check(plan_);
  const auto segments = static_cast<Eigen::Index>(plan_.segments());
  require(settings.lag >= 1 && settings.lag <= segments, "settings.lag", std::to_string(settings.lag),
          "from 1 to the segments of the flight, " + std::to_string(segments));
  require(settings.memory >= 1, "settings.memory", std::to_string(settings.memory), "at least 1");
}

TRAMMEL_INLINE void FixedLag::add(Measurement measurement) {
  const Eigen::Index oldest = std::max<Eigen::Index>(0, next_ - settings_.memory);
  const double begin_s = plan_.knots_s[static_cast<std::size_t>(oldest)];
  require(measurement.t_s >= begin_s, "measurement", "time " + std::to_string(measurement.t_s) + " s",
          "a time of the measurements kept, from " + std::to_string(begin_s) + " s");
  kept_.push_back(std::move(measurement));
}

TRAMMEL_INLINE std::vector<LaggedState> FixedLag::advance(double now_s) {
  const auto complete =
      static_cast<Eigen::Index>(std::upper_bound(plan_.knots_s.begin(), plan_.knots_s.end(), now_s) -
                                plan_.knots_s.begin()) -
      1;
  std::vector<LaggedState> result;
  while (next_ + settings_.lag <= complete) {  // one window per knot, however late it is asked for
    const std::vector<LaggedState> due = states(next_ + settings_.lag, next_);
    result.insert(result.end(), due.begin(), due.end());
  }
  return result;
}

TRAMMEL_INLINE std::vector<LaggedState> FixedLag::finish() {
  const auto last = static_cast<Eigen::Index>(plan_.segments());
  std::vector<LaggedState> result = advance(plan_.knots_s.back());
  const std::vector<LaggedState> rest = states(last, last);
  result.insert(result.end(), rest.begin(), rest.end());
  return result;
}

TRAMMEL_INLINE std::vector<LaggedState> FixedLag::states(Eigen::Index newest, Eigen::Index last) {
  const Eigen::Index first = std::max<Eigen::Index>(0, next_ - settings_.memory);
  const double begin_s = plan_.knots_s[static_cast<std::size_t>(first)];
  std::erase_if(kept_, [&](const Measurement& m) { return m.t_s < begin_s; });
  const Scenario scenario = fixed_lag_detail::part(plan_, first, newest, kept_);
  const BandedProblem problem =
      settings_.relinearise ? assemble_about_fit(scenario) : assemble_banded(scenario);
  const WindowSolution solution =
      solve_windows(problem, {.core = static_cast<int>(newest - first), .overlap = 1});
  const trajectory::QuadraticSpline<double> deviation =
      problem.trajectory.coordinates.spline(estimate_coefficients(problem, solution.estimator));
  const BandedPointwise guarantee(problem, solution.estimator);
  std::vector<LaggedState> result;
  for (; next_ <= last; ++next_) {
    const double t_s = plan_.knots_s[static_cast<std::size_t>(next_)];
    result.push_back({.t_s = t_s,
                      .position_m = problem.trajectory.nominal.position(t_s) + deviation.position(t_s),
                      .velocity_mps = problem.trajectory.nominal.velocity(t_s) + deviation.velocity(t_s),
                      .guaranteed_rms_m = guarantee.rms_m(t_s)});
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::window
