// SPDX-License-Identifier: Apache-2.0
/// @file
/// Measurements and paths as CSV.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "trammel/problem/scenario.hpp"
#include "trammel/sensor/kind.hpp"

namespace trammel::io {

/// Reads measurements in long form: `t_s,station,y1[,y2[,y3]]`, one row each, in any order. A row may carry
/// its own covariance in the columns c11,c12,c13,c22,c23,c33 (upper triangle; as many as its kind needs, all
/// or none). Values in the order and units of the station's kind. A file without a column `station` whose
/// columns are NAME.COMPONENT is read in wide form (read_wide_form). Throws Error naming file, line and
/// column.
[[nodiscard]] std::vector<Measurement> read_measurements(const std::filesystem::path& file,
                                                         const Scenario& scenario);

/// The long form back, one row per measurement, with covariance columns where a measurement has its own.
[[nodiscard]] std::string format_measurements(const std::vector<Measurement>& measurements,
                                              const std::vector<Station>& stations);

using trammel::PathSamples;

/// Reads `t_s,x_m,y_m,z_m`; the further columns of a trajectory.csv and of the path.csv of `observer plan`
/// are allowed and left out. Throws Error unless times increase and reach from `begin_s` to `end_s`.
[[nodiscard]] PathSamples read_path(const std::filesystem::path& file, double begin_s, double end_s);

/// Throws Error unless `t_s` is within the scenario's knots.
void require_within_knots(double t_s, const std::vector<double>& knots_s, const std::string& where);

}  // namespace trammel::io
