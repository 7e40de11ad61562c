// SPDX-License-Identifier: Apache-2.0
/// @file
/// The estimate beside the measurements: paths, residuals, linearisation.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/estimate/path_table.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/scenario.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

/// Normalised residual of one measurement (observed minus computed at the estimate, in the station's units).
struct Residual {
  double t_s = 0.0;
  std::size_t station = 0;
  Eigen::VectorXd value;     ///< components of the station's kind; azimuth wrapped to (-pi, pi]
  Eigen::VectorXd whitened;  ///< L^-1 value, L the lower Cholesky factor of the covariance
};

/// What the linearisation costs at the estimate.
struct Linearisation {
  /// Largest second-order remainder |h(x_hat) - h(x_lin) - H (x_hat - x_lin)| over all components, each over
  /// its sigma; x_lin is the path linearised about. Well below 1: the linear model holds along the estimate.
  double ratio = std::numeric_limits<double>::quiet_NaN();
  int iterations = 0;      ///< relinearisations made: one, about a path fitted to the data, or none
  bool converged = false;  ///< whether that fit was made
};

/// Quantities that need measured values.
struct ObservationResult {
  double chi2 = std::numeric_limits<double>::quiet_NaN();  ///< sum of squares of whitened residuals
  Eigen::VectorXd theta;   ///< deviation from the reference: position, velocity at the first knot, then
                           ///< acceleration per segment (all 3 (r + 2), zeros where removed), SI
  Eigen::VectorXd biases;  ///< of the stations, one per bias_parameters entry
  Eigen::VectorXd biases_guaranteed_rms;       ///< of each (estimate_biases)
  std::vector<BiasParameter> bias_parameters;  ///< which; empty where no station has any
  Eigen::MatrixXd knot_position_m;             ///< (r + 1) x 3
  Eigen::MatrixXd knot_velocity_mps;           ///< (r + 1) x 3
  PathTable path;                              ///< the guaranteed estimate on the dense grid
  std::optional<PathTable> gauss_markov_path;  ///< absent when the information matrix is singular
  std::vector<Residual> residuals;
  Linearisation linearisation;
};

/// Gauss-Markov estimate of a trajectory problem: least squares without bounds.
struct GaussMarkov {
  double rms_m = std::numeric_limits<double>::quiet_NaN();
  Eigen::VectorXd z;  ///< in the problem's coordinates; empty without observations
};

/// Nothing where the measurements do not determine all parameters.
[[nodiscard]] std::optional<GaussMarkov> gauss_markov(const TrajectoryProblem& problem);

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
