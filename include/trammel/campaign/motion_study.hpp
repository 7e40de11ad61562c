// SPDX-License-Identifier: Apache-2.0
/// @file
/// One estimator tried on random admissible motions.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/estimate/bounded_motion.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/scenario.hpp"

namespace trammel::inline TRAMMEL_ABI::campaign {

/// How the true motion of a run is drawn. Independent for each bound; unbounded parameters as planned.
enum class RandomMotion {
  kWithin,      ///< uniformly within each ellipsoid
  kOnBoundary,  ///< on the surface of each ellipsoid, uniformly in direction: the harder case
};

/// Actual rms errors of one run over the scenario's criterion, m.
struct RunErrors {
  double linear_m = 0.0;     ///< measurements linear in the deviation, as the guarantee assumes
  double nonlinear_m = 0.0;  ///< measurements by the sensors themselves: what linearising costs is in it
};

/// A scenario and the gain of its estimator, ready to be tried out run by run:
///
///   z drawn within the bounds,  z_hat = K F'y,  error = |C (z_hat - z)|,
///   y = F z + e (linear), or whitened deviations of h(reference + z) + noise (nonlinear).
///
/// Run k uses random numbers of stream k of the seed only: it comes out the same whichever runs are made
/// beside it, in whichever order, on however many threads or machines. Runs of the same number and seed share
/// their noise across scenarios with the same stations, so that designs can be compared with few runs.
/// Cost per run: that of `assemble` plus O(p^2).
class MotionStudy {
 public:
  /// `gain` (p x p) is minimax::Solution::gain of the scenario; observations serve as times only.
  /// Throws Error as `assemble` does, and for a gain of another shape.
  MotionStudy(Scenario scenario, Eigen::MatrixXd gain, RandomMotion motion);

  /// Errors of one run. Safe to call from several threads. Throws Error where the drawn motion meets a
  /// station.
  [[nodiscard]] RunErrors run(std::uint64_t seed, std::uint64_t run) const;

 private:
  Scenario scenario_;
  TrajectoryProblem planned_;
  estimate::BoundedMotion motions_;
  Eigen::MatrixXd gain_;
  RandomMotion motion_;
};

/// Mean square of rms errors against the squared error that is guaranteed.
struct StudySummary {
  std::size_t runs = 0;
  double mean_square_m2 = std::numeric_limits<double>::quiet_NaN();
  /// Of the mean square: sample standard deviation over the root of the runs; NaN for one run.
  double standard_error_m2 = std::numeric_limits<double>::quiet_NaN();
  double largest_rms_m = 0.0;
  /// mean square / guaranteed square, and its 99 % confidence interval (normal approximation).
  double ratio = std::numeric_limits<double>::quiet_NaN();
  double ratio_low = std::numeric_limits<double>::quiet_NaN();
  double ratio_high = std::numeric_limits<double>::quiet_NaN();

  static constexpr double kConfidence = 0.99;

  /// Whether the runs speak against the guarantee: even the lower end of the interval is above one.
  [[nodiscard]] bool contradicts() const { return ratio_low > 1.0; }
};

/// Summary of the errors (m) of runs with the same guaranteed rms error (m). Sums are formed in order.
/// Throws Error without runs.
[[nodiscard]] StudySummary summarise(const std::vector<double>& rms_errors_m, double guaranteed_rms_m);

}  // namespace trammel::inline TRAMMEL_ABI::campaign

#ifndef TRAMMEL_COMPILED
#include "trammel/campaign/motion_study_impl.hpp"
#endif
