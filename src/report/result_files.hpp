// SPDX-License-Identifier: Apache-2.0
/// @file
/// Results as text: result.json, trajectory.csv and the summary on the terminal.
#pragma once

#include <string>

#include "../io/json_output.hpp"
#include "report.hpp"

namespace trammel::report {

/// Name of the file beside result.json that holds worst_case_csv().
inline constexpr const char* kWorstCaseFile = "worst_case.csv";

/// What a claim of "verified" is about.
inline constexpr const char* kClaimCovers =
    "the linear problem as computed in floating point from the inputs; not the linearisation, the model or "
    "the bounds themselves";

/// The fields of result.json. What was not computed, or is infinite, is null.
///
/// Always: status, claim, claim_covers, inflation (with remark and envelope where there are any),
/// attained_fraction, any_estimator_lower_bound_rms_m, any_estimator_bound_kind, parameters, observations,
/// method, iterations, guaranteed_rms_m, lower_bound_rms_m, relative_gap, gauss_markov_rms_m, prior_rms_m,
/// lambda_m2, solve_time_s, library_version, inputs; where unbounded also unbounded_directions. Where the
/// worst motion was found: worst_case {file, theta}; after Monte Carlo any_estimator_proved_rms_m,
/// any_estimator_proved_kind, monte_carlo_lower_bound_rms_m, monte_carlo_confidence. With measured values:
/// chi2, estimate {theta, knots_s, position_m, velocity_mps}, linearisation {ratio, iterations, converged},
/// and the statement (localise::Statement): stated_rms_m (null where ambiguous), stated_rms_fixed_point_m,
/// linear_guarantee_rms_m, curvature_rms_m, curvature_lower_rms_m, model_error_rms_m, kappa, consistency,
/// independence, model_error {position_m, velocity_mps, kind}, reference {method, barrier_weight,
/// minimum_height_m, starts, linear_systems, cost, chi2, observations}, tube {factor, widening, rms_m},
/// floor_test, entries {height_m, cost_difference, distance_m, reference_cost_difference,
/// reference_distance_m}, competing_solutions, proved, assumed; status is "ambiguous" where the data are.
/// Where stations have biases: lambda_stations_m2 (one per station) and estimate.biases, entries {station,
/// component, estimate, guaranteed_rms, semi_axis}.
/// Where outliers were looked for: outlier_test {false_alarm, quantile, tested, rounds, settled} and
/// rejected, entries {station, t_s, components, residual, worst_case, reason}. With a true path: truth
/// {actual_rms_error_m, actual_gauss_markov_rms_error_m}.
[[nodiscard]] io::Json result_json(const ReportInput& input);

/// `t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,guaranteed_rms_m` on the dense grid: the estimate, or the reference
/// where there are no measured values.
[[nodiscard]] std::string trajectory_csv(const estimate::TrajectoryEstimate& estimate);

/// `t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps` on the dense grid: the admissible motion with the largest error of
/// this estimator that was found, reference plus estimate.worst_case_motion; no rows where there is none.
[[nodiscard]] std::string worst_case_csv(const estimate::TrajectoryEstimate& estimate);

/// The same columns but the last on the dense grid: the estimate about a competing solution.
[[nodiscard]] std::string competing_csv(const localise::CompetingSolution& solution);

/// Name of the file that holds competing_csv() of competing solution `index`, counted from 0: the first is
/// competing_2.csv (the best solution is in trajectory.csv).
[[nodiscard]] std::string competing_file(std::size_t index);

/// Name of a bias as in scenario files: that of the component, or time_s.
[[nodiscard]] std::string bias_name(const Scenario& scenario, const BiasParameter& bias);

/// "radar at 12 s: range_m is 913 off what the others predict; ...".
[[nodiscard]] std::string why_rejected(const ReportInput& input,
                                       const localise::RejectedMeasurement& rejected);

/// A few lines for a person.
[[nodiscard]] std::string summary(const ReportInput& input);

}  // namespace trammel::report
