// SPDX-License-Identifier: Apache-2.0
/// @file
/// The estimate beside the measurements: paths, residuals, linearisation.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/estimate/trajectory_estimate.hpp"
#include "trammel/problem/assemble.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

/// The reference plus the deviation z, on a time grid.
[[nodiscard]] PathTable path_on_grid(const TrajectoryProblem& problem, const Eigen::VectorXd& z,
                                     const std::vector<double>& times_s);

/// Everything that needs measured values, for the estimate z of a scenario with observations.
[[nodiscard]] ObservationResult compare_with_observations(
    const Scenario& scenario, const TrajectoryProblem& problem, const Eigen::VectorXd& z,
    const std::optional<GaussMarkov>& unbounded_estimate, const std::vector<double>& times_s);

}  // namespace trammel::inline TRAMMEL_ABI::estimate
