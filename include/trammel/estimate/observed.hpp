// SPDX-License-Identifier: Apache-2.0
/// @file
/// The estimate beside the measurements: paths, residuals, linearisation.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/estimate/observation_result.hpp"
#include "trammel/estimate/path_table.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/scenario.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

/// The reference plus the deviation z, on a time grid.
[[nodiscard]] PathTable path_on_grid(const TrajectoryProblem& problem, const Eigen::VectorXd& z,
                                     const std::vector<double>& times_s);

/// The stations' biases that explain best, together with their bounds, what an estimate of the motion leaves:
///
///   b = T d,  T = (3 G_bb + F_b'F_b)^-1 F_b' (I - F_m K_m F'),   G_bb = sum of the bounds' a_l'a_l.
///
/// | symbol   | meaning                                                                   | shape    |
/// |----------|---------------------------------------------------------------------------|----------|
/// | F, d     | information factor, its columns of motion and biases; right-hand side     | m x p, m |
/// | K_m      | rows of the solution's gain for the motion                                | - x p    |
///
/// (The gain's own rows for the biases say nothing: the criterion does not see them.) Guaranteed rms error of
/// each: noise |T_k|, and the largest bias over the bounds, attained; infinite where that is not bounded.
struct BiasEstimate {
  Eigen::VectorXd z;               ///< q parameters of the problem; empty without observations
  Eigen::VectorXd guaranteed_rms;  ///< units of the biases
};

/// `bounds` are those of the scenario that `problem` was made from, `gain` that of its solution.
[[nodiscard]] BiasEstimate estimate_biases(const TrajectoryProblem& problem, const MotionBounds& bounds,
                                           const Eigen::MatrixXd& gain);

/// Everything that needs measured values, for the estimate z of a scenario with observations.
[[nodiscard]] ObservationResult compare_with_observations(
    const Scenario& scenario, const TrajectoryProblem& problem, const Eigen::VectorXd& z,
    const std::optional<GaussMarkov>& unbounded_estimate, const std::vector<double>& times_s);

}  // namespace trammel::inline TRAMMEL_ABI::estimate

#ifndef TRAMMEL_COMPILED
#include "trammel/estimate/observed_impl.hpp"
#endif
