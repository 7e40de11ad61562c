// SPDX-License-Identifier: Apache-2.0
/// @file
/// What measured values add to an estimate.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/estimate/path_table.hpp"
#include "trammel/problem/assemble.hpp"

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

}  // namespace trammel::inline TRAMMEL_ABI::estimate
