// SPDX-License-Identifier: Apache-2.0
/// @file
/// Many flights of the closed loop with random starts and noises, on all cores.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/observer/flight.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

/// What to simulate.
struct MonteCarloSettings {
  std::int64_t runs = 5000;
  std::uint64_t seed = 1;
  unsigned threads = 0;  ///< 0: as many as the machine has; the result does not depend on it
  double max_start_x_m = std::numeric_limits<double>::infinity();  ///< starts beyond it are drawn again
  int sample_paths = 12;  ///< flights of which the whole path is kept
};

/// Mean and standard deviation (divisor n - 1; NaN for fewer than two values).
struct MeanDeviation {
  double mean = std::numeric_limits<double>::quiet_NaN();
  double deviation = std::numeric_limits<double>::quiet_NaN();
};

/// Spread of the estimation error over time.
struct SpreadPoint {
  double time_s = 0.0;
  double mean_error_x_m = 0.0;
  double sd_error_x_m = 0.0;
  double rms_predicted_x_m = 0.0;  ///< sqrt(mean Gamma_11) that the filter states
};

/// One flight in full.
struct SamplePath {
  std::vector<double> times_s;
  std::vector<Eigen::Vector3d> truth_m;
  std::vector<Eigen::Vector3d> estimate_m;
};

/// Statistics over all runs, and what each run came to (index = run).
///
/// | field        | of                                                                                |
/// |--------------|-----------------------------------------------------------------------------------|
/// | error_x_m    | x_hat(T) - x(T)                                                                    |
/// | miss_m       | distance of (y, z)(T) from the terminal point                                      |
/// | effort_m     | total variation of y plus that of z                                                |
/// | nees         | e' Gamma^-1 e of the final error; consistent: chi-squared with 3 degrees of freedom |
struct MonteCarloResult {
  MeanDeviation error;
  MeanDeviation miss;
  MeanDeviation effort;
  double rms_predicted_m = std::numeric_limits<double>::quiet_NaN();  ///< sqrt(mean Gamma_11(T))
  double median_nees = std::numeric_limits<double>::quiet_NaN();
  std::int64_t runs_moved_back = 0;  ///< runs in which an estimate had to be moved back for planning
  std::int64_t skipped = 0;          ///< measurements skipped by the gate, all runs
  std::vector<double> error_x_m;
  std::vector<double> miss_m;
  std::vector<double> effort_m;
  std::vector<double> nees;
  std::vector<SpreadPoint> spread;
  std::vector<SamplePath> paths;
};

/// Flies `settings.runs` times. Run k draws its start from N(prior.position_m, prior.covariance_m2), again
/// while x > max_start_x_m, and its noises from the stream (seed, k): the result is the same, bit for bit,
/// for any number of threads. Throws Error for bad input, also if the prior hardly ever meets max_start_x_m.
/// `observe` is called from the calling thread.
[[nodiscard]] MonteCarloResult simulate(const FlightLoop& loop, const MonteCarloSettings& settings,
                                        const ProgressObserver& observe = {});

/// Value below which the part `probability` of the values lies (linear between order statistics); NaN if
/// empty.
[[nodiscard]] double quantile(std::vector<double> values, double probability);

}  // namespace trammel::inline TRAMMEL_ABI::observer

#ifndef TRAMMEL_COMPILED
#include "trammel/observer/monte_carlo_impl.hpp"
#endif
