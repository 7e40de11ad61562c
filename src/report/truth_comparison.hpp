// SPDX-License-Identifier: Apache-2.0
/// @file
/// An estimate beside the path that was really flown.
#pragma once

#include <limits>
#include <vector>

#include "../io/measurement_csv.hpp"
#include "trammel/estimate/trajectory_estimate.hpp"

namespace trammel::report {

/// Errors against a true path. Empty or NaN where the estimate compared is absent.
struct TruthComparison {
  Eigen::MatrixXd position_m;            ///< the true path on the estimate's grid, n x 3
  std::vector<double> estimate_error_m;  ///< |estimate - truth| on the grid
  std::vector<double> gauss_markov_error_m;
  /// Root of the mean squared error over what the scenario's criterion averages (trapezoidal rule on the grid
  /// for integrals).
  double estimate_rms_m = std::numeric_limits<double>::quiet_NaN();
  double gauss_markov_rms_m = std::numeric_limits<double>::quiet_NaN();
};

/// Compares; the truth is joined between its samples as a nominal path is.
[[nodiscard]] TruthComparison compare_with_truth(const Scenario& scenario,
                                                 const estimate::TrajectoryEstimate& estimate,
                                                 const io::PathSamples& truth);

}  // namespace trammel::report
