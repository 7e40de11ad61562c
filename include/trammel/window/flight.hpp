// SPDX-License-Identifier: Apache-2.0
/// @file
/// From the scenario of a long flight to its guaranteed trajectory, window by window.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/estimate/trajectory_estimate.hpp"
#include "trammel/problem/banded_problem.hpp"
#include "trammel/problem/scenario.hpp"
#include "trammel/window/solve.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

/// Settings of estimate_flight.
struct FlightSettings {
  WindowSettings windows;
  bool relinearise = true;     ///< assemble_about_fit; otherwise about the reference
  double output_step_s = 0.0;  ///< as in estimate::EstimateSettings
};

/// Guaranteed rms error (m) of the position at single times, as estimate::PointwiseGuarantee gives it: noise
/// and proved largest bias of the rows of one time. Memory linear in the flight; per time the cost of the
/// bounds within a window.
class BandedPointwise {
 public:
  BandedPointwise(const BandedProblem& problem, const BandedEstimator& estimator);

  /// Upper bound of the rms error at a time within the knots, m.
  [[nodiscard]] double rms_m(double t_s) const;

 private:
  trajectory::SplineBasis basis_;
  linalg::BandedMatrix noise_;  ///< K F'
  linalg::BandedMatrix bias_;   ///< W Sigma
};

/// The banded problem of a scenario with observations, linearised about the least-squares path: Gauss-Newton
/// steps from the reference; the reference itself where all sensors measure positions. Throws Error as
/// assemble_banded does, and where the steps do not settle.
[[nodiscard]] BandedProblem assemble_about_fit(const Scenario& scenario,
                                               const ProgressObserver& observe = {});

/// Solves a scenario by windows and, where it has observations, evaluates the estimate: the same result as
/// estimate::estimate_trajectory at a cost and in memory linear in the number of segments, without what needs
/// whole matrices (gain and prior_factor of the solution, near_optimality). prior_rms_m is exact for bounds
/// that are balls, an upper bound for others.
///
/// Throws Error as assemble_banded and assemble_about_fit do.
[[nodiscard]] estimate::TrajectoryEstimate estimate_flight(const Scenario& scenario,
                                                           const FlightSettings& settings = {},
                                                           const ProgressObserver& observe = {});

}  // namespace trammel::inline TRAMMEL_ABI::window

#ifndef TRAMMEL_COMPILED
#include "trammel/window/flight_impl.hpp"
#endif
