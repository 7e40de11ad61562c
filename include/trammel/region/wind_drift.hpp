// SPDX-License-Identifier: Apache-2.0
/// @file
/// Course correction of a light aircraft in a wind of unknown direction, measured with arbitrary errors.
#pragma once

#include <cmath>
#include <numbers>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// How the course is corrected for the wind.
enum class WindCorrection {
  kNone,        ///< straight at the target
  kRandomised,  ///< probes in the course (Amelin 2013, eq. (14)) or in the dwell time
  kKalman,      ///< eq. (15)
  kLms,         ///< eq. (16)
};

/// The three measurement noises of section 4 of Amelin (2013), in m.
enum class WindNoise {
  kUniform,    ///< 5 (4 rand - 2)
  kSwitching,  ///< 0.1 sin t + 19 sign(50 - t mod 100)
  kConstant,   ///< 20
};

[[nodiscard]] constexpr std::string_view to_string(WindCorrection correction) noexcept {
  switch (correction) {
    case WindCorrection::kRandomised:
      return "randomised";
    case WindCorrection::kKalman:
      return "kalman";
    case WindCorrection::kLms:
      return "lms";
    case WindCorrection::kNone:
      break;
  }
  return "none";
}

[[nodiscard]] constexpr std::string_view to_string(WindNoise noise) noexcept {
  switch (noise) {
    case WindNoise::kSwitching:
      return "switching";
    case WindNoise::kConstant:
      return "constant";
    case WindNoise::kUniform:
      break;
  }
  return "uniform";
}

/// A flight from (0, 0) to a target. The wind blows across the line of sight with speed b sin theta_t (to the
/// right); theta_{t+1} = theta_t + w, w uniform. Defaults: the published example where it is printed.
struct WindFlight {
  double airspeed_mps = 20.0;   ///< a
  double wind_speed_mps = 7.0;  ///< b, below a
  double interval_s = 2.0;      ///< delta, from one measurement to the next
  double target_x_m = 5000.0;
  double target_y_m = 5000.0;
  double first_wind_rad = 3.0 * std::numbers::pi / 180.0;  ///< theta_0
  /// Half width of the uniform wind step. The published table is met only by 8 rad, with which sin theta_t is
  /// practically white; 8 degrees is the physical reading.
  double wind_step_rad = 8.0 * std::numbers::pi / 180.0;
  int max_steps = 250;  ///< T
};

/// What is drawn at random for one flight.
struct WindDraws {
  Eigen::VectorXd theta_rad;  ///< max_steps + 1
  Eigen::VectorXd noise_m;    ///< max_steps
  Eigen::VectorXd sign;       ///< max_steps, the probes
};

/// Draws wind, noise (only kUniform uses random numbers) and probes, in this order. `random` offers uniform()
/// and sign(). Does not allocate once the sizes are the same.
template <class Generator>
void draw_wind(Generator& random, const WindFlight& flight, WindNoise noise, WindDraws& out) {
  const Eigen::Index steps = flight.max_steps;
  out.theta_rad.resize(steps + 1);
  out.noise_m.resize(steps);
  out.sign.resize(steps);
  out.theta_rad(0) = flight.first_wind_rad;
  for (Eigen::Index t = 0; t < steps; ++t) {
    out.theta_rad(t + 1) = out.theta_rad(t) + flight.wind_step_rad * (2.0 * random.uniform() - 1.0);
  }
  for (Eigen::Index t = 0; t < steps; ++t) {
    const auto time = static_cast<double>(t + 1);
    const double phase = 50.0 - std::fmod(time, 100.0);
    switch (noise) {
      case WindNoise::kUniform:
        out.noise_m(t) = 5.0 * (4.0 * random.uniform() - 2.0);
        break;
      case WindNoise::kSwitching:
        out.noise_m(t) =
            0.1 * std::sin(time) + 19.0 * ((phase > 0.0 ? 1.0 : 0.0) - (phase < 0.0 ? 1.0 : 0.0));
        break;
      case WindNoise::kConstant:
        out.noise_m(t) = 20.0;
        break;
    }
  }
  for (Eigen::Index t = 0; t < steps; ++t) {
    out.sign(t) = random.sign();
  }
}

/// One step of a flight, for plots and tests.
struct WindStep {
  double time_s = 0.0;      ///< at the end of the step
  double course_rad = 0.0;  ///< u, from the line of sight, positive to the left
  double residual = 0.0;    ///< epsilon (m/s), or the measured drift (m) of the dwell variant
  double estimate = 0.0;  ///< theta^ (rad), or the drift speed d^ (m/s) of the dwell variant, after the step
  double x_m = 0.0;
  double y_m = 0.0;
};

/// Outcome of a flight.
struct WindResult {
  double mean_deviation_m = 0.0;  ///< from the straight line, weighted by time
  int steps = 0;
  double time_s = 0.0;
  double x_m = 0.0;
  double y_m = 0.0;
  double estimate = 0.0;  ///< the last one
  bool arrived = false;
};

/// Settings of the corrections as printed.
struct PrintedCorrection {
  WindCorrection kind = WindCorrection::kRandomised;
  double step = 0.1;                    ///< alpha of (14) and (16)
  double probe_rad = 0.01;              ///< beta of (14)
  double noise_variance = 100.0 / 3.0;  ///< of (15)
  double wind_variance = 64.0 / 3.0;    ///< of (15)
};

/// Flies with the corrections (14) to (16) of Amelin (2013) on epsilon_t = a sin u_t - b sin theta_t +
/// v_t/delta:
///   randomised  u_t = ubar_{t-1} +- beta,  theta^ -= alpha Delta_t epsilon_t
///   Kalman      theta^ -= K_t epsilon_t,   K = gamma b / (R + gamma b^2), gamma_0 = 0
///   LMS         theta^ -= alpha epsilon_t
/// and ubar_t = (b/a) sin theta^_{t+1}. `path`, if given, receives every step.
///
/// The randomised correction (14) carries no information about the wind: E[Delta_t epsilon_t | past, wind,
/// noise] = a beta cos(ubar) sin(beta) whatever theta_t and v_t are, because the probe is added to the course
/// instead of multiplying the wind. Its deviation is that of a flight without correction, up to the jitter of
/// its own probes; that it hardly depends on the noise is no merit. Of epsilon_t, moreover, no method can
/// separate a constant noise from a wind. `fly_with_dwell` is the variant that works.
[[nodiscard]] WindResult fly_as_printed(const WindFlight& flight, const PrintedCorrection& correction,
                                        const WindDraws& draws, std::vector<WindStep>* path = nullptr);

/// Settings of the variant with random dwell time.
struct DwellCorrection {
  WindCorrection kind = WindCorrection::kRandomised;
  /// alpha of the randomised correction; .02 is the optimum of best_step for a drift of b 8/sqrt(3) degrees
  /// per step, noise of 20 m and mean dwell 2 s.
  double step = 0.02;
  double dwell_change_s = 1.0;  ///< the dwell time is interval_s plus or minus this
  double lms_step = 0.02;
  double noise_variance = 100.0 / 3.0;  ///< of the Kalman correction, m^2
};

/// Flies with courses held for a random time delta_t = interval +- change. The drift measured over a step is
/// z_t = delta_t d_t - v_t with d_t = b sin theta_t: now the probe multiplies what is sought, and the
/// randomised prediction (prediction.hpp, phi = delta_t, Delta = +- change, A = Gamma = 1) applies:
///   d^ -= alpha Delta_t (delta_t d^ - z_t),  u = asin(clip(d^/a, +-b/a)).
/// Kalman and LMS corrections keep the dwell time constant.
[[nodiscard]] WindResult fly_with_dwell(const WindFlight& flight, const DwellCorrection& correction,
                                        const WindDraws& draws, std::vector<WindStep>* path = nullptr);

/// Throws Error naming the first member out of range.
void validate(const WindFlight& flight);

}  // namespace trammel::inline TRAMMEL_ABI::region

#ifndef TRAMMEL_COMPILED
#include "trammel/region/wind_drift_impl.hpp"
#endif
