// SPDX-License-Identifier: Apache-2.0
/// @file
/// Results as text: result.json, trajectory.csv and the summary on the terminal.
#pragma once

#include <string>

#include "../io/json_output.hpp"
#include "report.hpp"

namespace trammel::report {

/// The fields of result.json. What was not computed, or is infinite, is null.
///
/// Always: status, claim, parameters, observations, method, iterations, guaranteed_rms_m, lower_bound_rms_m,
/// relative_gap, gauss_markov_rms_m, prior_rms_m, lambda_m2, solve_time_s, library_version, inputs; where
/// unbounded also unbounded_directions. With measured values: chi2, estimate {theta, knots_s, position_m,
/// velocity_mps}, linearisation {ratio, iterations, converged}. With a true path: truth {actual_rms_error_m,
/// actual_gauss_markov_rms_error_m}.
[[nodiscard]] io::Json result_json(const ReportInput& input);

/// `t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,guaranteed_rms_m` on the dense grid: the estimate, or the reference
/// where there are no measured values.
[[nodiscard]] std::string trajectory_csv(const estimate::TrajectoryEstimate& estimate);

/// A few lines for a person.
[[nodiscard]] std::string summary(const ReportInput& input);

}  // namespace trammel::report
