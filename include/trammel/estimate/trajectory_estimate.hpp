// SPDX-License-Identifier: Apache-2.0
/// @file
/// From a scenario to the guaranteed trajectory: settings, result and entry point.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "trammel/certify/certificate.hpp"
#include "trammel/certify/near_optimality.hpp"
#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/estimate/observation_result.hpp"
#include "trammel/estimate/path_table.hpp"
#include "trammel/minimax/methods.hpp"
#include "trammel/minimax/solution.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/scenario.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

/// Settings of `estimate_trajectory`.
struct EstimateSettings {
  minimax::MethodChoice method;
  minimax::SolverSettings solver;
  /// Spacing of the dense output grid; 0: equal parts of each segment, at least 200 rows, with the knots
  /// among them.
  double output_step_s = 0.0;
  /// Search for the worst admissible motion and the bound over all estimators; absent: neither. Leave out
  /// where many scenarios are compared: it takes longer than the solution itself.
  std::optional<certify::NearOptimalitySettings> near_optimality = certify::NearOptimalitySettings{};
};

/// Everything the program writes and the report draws. rms values are NaN where not computed, infinity where
/// proved unbounded.
struct TrajectoryEstimate {
  minimax::Solution solution;
  Eigen::Index parameters = 0;   ///< p after removal of zero bounds
  std::size_t observations = 0;  ///< measurements used (planned or made), each counted once
  double guaranteed_rms_m = std::numeric_limits<double>::quiet_NaN();   ///< sqrt(solution.upper), rounded up
  double lower_bound_rms_m = std::numeric_limits<double>::quiet_NaN();  ///< sqrt(solution.lower), down
  certify::Certificate certificate;  ///< the proof of both; solution.claim is its claim
  /// How good the guarantee is, squared errors in m^2; absent where not asked for or unbounded.
  std::optional<certify::NearOptimality> near_optimality;
  double gauss_markov_rms_m = std::numeric_limits<double>::quiet_NaN();
  double prior_rms_m = std::numeric_limits<double>::quiet_NaN();  ///< the same problem without measurements
  Eigen::VectorXd lambda_m2;  ///< position, velocity, segments in order; 0 where a bound removed everything
  Eigen::VectorXd lambda_stations_m2;  ///< of the biases, one per station; empty where no station has any
  PathTable nominal;                   ///< reference on the dense grid
  std::vector<double> guaranteed_rms_at_m;  ///< certified rms bound of the same estimator per grid time
  /// The admissible motion with the largest mean-square error of this estimator that was found
  /// (near_optimality->worst_case), as deviation from the reference in the order of ObservationResult::theta.
  /// Empty without near_optimality.
  Eigen::VectorXd worst_case_theta;
  PathTable worst_case_motion;  ///< the same on the dense grid; no rows without near_optimality
  /// Where status is unbounded: words for the directions, "velocity y", "acceleration of segment 3 z".
  std::vector<std::string> unbounded_directions;
  std::optional<ObservationResult> observed;
};

/// Solves the guaranteed problem of a scenario and, where it has observations, evaluates the estimate.
///
/// | result              | formula                                                                 |
/// |---------------------|-------------------------------------------------------------------------|
/// | observed->path      | z = K F'y, y whitened deviations (Mamaev and Semenikhin, eq. (15))      |
/// | guaranteed_rms_m    | sqrt(tr S K J K' + sum lambda), proved by certify::verify (eq. (16))    |
/// | gauss_markov_rms_m  | sqrt(tr S J^-1)                                                         |
/// | prior_rms_m         | proved bound of the same without measurements (bound_bias)              |
/// | guaranteed_rms_at_m | PointwiseGuarantee                                                      |
///
/// The guarantee is that of the linear model: `observed->linearisation` tells how far that holds.
/// Throws Error for a scenario that breaks its own rules.
[[nodiscard]] TrajectoryEstimate estimate_trajectory(const Scenario& scenario,
                                                     const EstimateSettings& settings = {},
                                                     const ProgressObserver& observe = {});

/// The same from a problem already assembled from the scenario and its solution: what `estimate_trajectory`
/// does after solving, whatever made the solution: its bounds are replaced by those certify::verify proves.
/// Throws Error for a solution of another shape.
[[nodiscard]] TrajectoryEstimate evaluate_solution(const Scenario& scenario, const TrajectoryProblem& problem,
                                                   minimax::Solution solution,
                                                   const EstimateSettings& settings = {},
                                                   const ProgressObserver& observe = {});

/// The same for a solution that certify::certify was called for already, with the certificate.
[[nodiscard]] TrajectoryEstimate evaluate_verified(const Scenario& scenario, const TrajectoryProblem& problem,
                                                   minimax::Solution solution,
                                                   certify::Certificate certificate,
                                                   const EstimateSettings& settings = {},
                                                   const ProgressObserver& observe = {});

/// Least squares without bounds; nothing where the measurements do not determine all parameters.
[[nodiscard]] std::optional<GaussMarkov> gauss_markov(const TrajectoryProblem& problem);

}  // namespace trammel::inline TRAMMEL_ABI::estimate

#ifndef TRAMMEL_COMPILED
#include "trammel/estimate/trajectory_estimate_impl.hpp"
#endif
