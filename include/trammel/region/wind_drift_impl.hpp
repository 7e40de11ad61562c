// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of wind_drift.hpp.
#pragma once

#include <algorithm>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/region/wind_drift.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

namespace detail {

/// Position, deviation and end of a flight.
class FlightState {
 public:
  explicit FlightState(const WindFlight& flight)
      : flight_(flight), line_(std::hypot(flight.target_x_m, flight.target_y_m)) {}

  /// Moves for `duration` s with speeds along the line of sight and to its left.
  void move(double along_mps, double left_mps, double duration) {
    const double dx = flight_.target_x_m - result_.x_m;
    const double dy = flight_.target_y_m - result_.y_m;
    const double distance = std::hypot(dx, dy);
    const double ex = dx / distance;
    const double ey = dy / distance;
    result_.x_m += duration * (along_mps * ex - left_mps * ey);
    result_.y_m += duration * (along_mps * ey + left_mps * ex);
    result_.time_s += duration;
    result_.steps += 1;
    weighted_ +=
        duration * std::abs(result_.y_m * flight_.target_x_m - result_.x_m * flight_.target_y_m) / line_;
    const double left = std::hypot(flight_.target_x_m - result_.x_m, flight_.target_y_m - result_.y_m);
    result_.arrived = left < flight_.interval_s * (flight_.airspeed_mps + flight_.wind_speed_mps);
  }
  [[nodiscard]] bool arrived() const { return result_.arrived; }
  void record(double course, double residual, double estimate, std::vector<WindStep>* path) {
    result_.estimate = estimate;
    if (path != nullptr) {
      path->push_back({result_.time_s, course, residual, estimate, result_.x_m, result_.y_m});
    }
  }
  [[nodiscard]] WindResult result() {
    result_.mean_deviation_m = weighted_ / result_.time_s;
    return result_;
  }

 private:
  const WindFlight& flight_;
  double line_;
  double weighted_ = 0.0;
  WindResult result_;
};

TRAMMEL_INLINE void require_draws(const WindFlight& flight, const WindDraws& draws) {
  require(draws.theta_rad.size() >= flight.max_steps && draws.noise_m.size() >= flight.max_steps &&
              draws.sign.size() >= flight.max_steps,
          [&] {
            return ErrorDetail{"draws", std::to_string(draws.noise_m.size()) + " steps",
                               "at least max_steps, " + std::to_string(flight.max_steps)};
          });
}

}  // namespace detail

TRAMMEL_INLINE void validate(const WindFlight& flight) {
  const auto positive = [](double value, const char* name) {
    require(value > 0.0 && std::isfinite(value), [&] {
      return ErrorDetail{std::string("WindFlight.") + name, std::to_string(value), "a positive number"};
    });
  };
  positive(flight.airspeed_mps, "airspeed_mps");
  positive(flight.interval_s, "interval_s");
  require(flight.wind_speed_mps >= 0.0 && flight.wind_speed_mps < flight.airspeed_mps, [&] {
    return ErrorDetail{"WindFlight.wind_speed_mps", shortest(flight.wind_speed_mps),
                       "0 to below the airspeed"};
  });
  require(std::isfinite(flight.target_x_m) && std::isfinite(flight.target_y_m) &&
              std::hypot(flight.target_x_m, flight.target_y_m) > 0.0,
          "WindFlight.target", "the starting point or a value that is not finite", "another point");
  require(std::isfinite(flight.first_wind_rad), "WindFlight.first_wind_rad", "not finite", "a finite number");
  require(flight.wind_step_rad >= 0.0 && std::isfinite(flight.wind_step_rad), [&] {
    return ErrorDetail{"WindFlight.wind_step_rad", shortest(flight.wind_step_rad), "a number, at least 0"};
  });
  require(flight.max_steps >= 1, [&] {
    return ErrorDetail{"WindFlight.max_steps", std::to_string(flight.max_steps), "at least 1"};
  });
}

TRAMMEL_INLINE WindResult fly_as_printed(const WindFlight& flight, const PrintedCorrection& correction,
                                         const WindDraws& draws, std::vector<WindStep>* path) {
  validate(flight);
  detail::require_draws(flight, draws);
  const double a = flight.airspeed_mps;
  const double b = flight.wind_speed_mps;
  detail::FlightState state(flight);
  double estimate = 0.0;
  double base_course = 0.0;
  double variance = 0.0;
  for (Eigen::Index t = 0; t < flight.max_steps && !state.arrived(); ++t) {
    const double probe =
        correction.kind == WindCorrection::kRandomised ? correction.probe_rad * draws.sign(t) : 0.0;
    const double course = base_course + probe;
    const double left = a * std::sin(course) - b * std::sin(draws.theta_rad(t));
    const double residual = left + draws.noise_m(t) / flight.interval_s;
    state.move(a * std::cos(course), left, flight.interval_s);
    switch (correction.kind) {
      case WindCorrection::kNone:
        break;
      case WindCorrection::kRandomised:
        estimate -= correction.step * probe * residual;
        break;
      case WindCorrection::kKalman: {
        const double innovation = correction.noise_variance + variance * b * b;
        estimate -= variance * b / innovation * residual;
        variance += correction.wind_variance - variance * variance * b * b / innovation;
        break;
      }
      case WindCorrection::kLms:
        estimate -= correction.step * residual;
        break;
    }
    base_course = b / a * std::sin(estimate);
    state.record(course, residual, estimate, path);
  }
  return state.result();
}

TRAMMEL_INLINE WindResult fly_with_dwell(const WindFlight& flight, const DwellCorrection& correction,
                                         const WindDraws& draws, std::vector<WindStep>* path) {
  validate(flight);
  detail::require_draws(flight, draws);
  require(correction.dwell_change_s > 0.0 && correction.dwell_change_s < flight.interval_s, [&] {
    return ErrorDetail{"DwellCorrection.dwell_change_s", shortest(correction.dwell_change_s),
                       "between 0 and the interval"};
  });
  const double a = flight.airspeed_mps;
  const double b = flight.wind_speed_mps;
  // Variance of the change of d in one step, for a uniform wind step.
  const double drift_variance = b * b * flight.wind_step_rad * flight.wind_step_rad / 3.0;
  detail::FlightState state(flight);
  double estimate = 0.0;
  double variance = 0.0;
  for (Eigen::Index t = 0; t < flight.max_steps && !state.arrived(); ++t) {
    const double probe =
        correction.kind == WindCorrection::kRandomised ? correction.dwell_change_s * draws.sign(t) : 0.0;
    const double dwell = flight.interval_s + probe;
    const double course = std::asin(std::clamp(estimate / a, -b / a, b / a));
    const double drift = b * std::sin(draws.theta_rad(t));
    const double measured = dwell * drift - draws.noise_m(t);
    state.move(a * std::cos(course), a * std::sin(course) - drift, dwell);
    const double residual = dwell * estimate - measured;
    switch (correction.kind) {
      case WindCorrection::kNone:
        break;
      case WindCorrection::kRandomised:
        estimate -= correction.step * probe * residual;
        break;
      case WindCorrection::kKalman: {
        const double innovation = correction.noise_variance + variance * dwell * dwell;
        estimate -= variance * dwell / innovation * residual;
        variance += drift_variance - variance * variance * dwell * dwell / innovation;
        break;
      }
      case WindCorrection::kLms:
        estimate -= correction.lms_step * dwell * residual;
        break;
    }
    state.record(course, measured, estimate, path);
  }
  return state.result();
}

}  // namespace trammel::inline TRAMMEL_ABI::region
