// SPDX-License-Identifier: Apache-2.0
/// @file
/// Solves the banded problem of a long flight window by window.
#pragma once

#include <limits>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/core/status.hpp"
#include "trammel/problem/banded_problem.hpp"
#include "trammel/window/banded_certificate.hpp"
#include "trammel/window/ranges.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

/// Answer to a banded problem, in its coordinates.
struct WindowSolution {
  SolveStatus status = SolveStatus::kNumericalTrouble;
  BandedCertificate certificate;
  BandedEstimator estimator;
  Eigen::Index windows = 0;
  Eigen::Index nearly_singular = 0;  ///< windows whose least favourable prior is not positive definite
  int iterations = 0;                ///< of all windows' solvers
  double solve_time_s = std::numeric_limits<double>::quiet_NaN();
};

/// Solves a banded problem by overlapping windows, each with the measurements and the criterion inside it, at
/// a cost linear in the number of segments, and proves the result for the whole flight.
///
/// 1. Multipliers: each window is solved with its first position and velocity bounded weakly
///    (minimax::solve_in_multipliers); its core's multipliers are kept.
/// 2. With these, Lambda = diag(lambda), each window gives the rows of its core of
///      W = -J^-1 D' Lambda^1/2 M^-1/2,   V = Lambda^-1/2 M^1/2 Lambda^-1/2 - D J^-1 D',
///      M = Lambda^1/2 D J^-1 S J^-1 D' Lambda^1/2,
///    for which W'SW = I whatever lambda, so that an error of the multipliers enters the upper bound only
///    squared. M is nearly singular for slowly varying accelerations (as the square of the square of their
///    frequency), which would tie W to the whole flight: (M + e^2 I)^-1/2 in place of M^-1/2 keeps W'SW below
///    I, loses little where M is small anyway, and lets what a window does not see decay over its overlap. (D
///    without the rows of a bounded start inside the flight: W D leaves uniform motion alone.) Where V is not
///    positive definite, multipliers, W and V are those of the window's own solution by minimax::solve.
///    Near the borders of cores the rows of neighbours are blended.
/// 3. The joint V, scaled to its bounds, gives the estimators of the lower bound, again window by window.
/// 4. certify_bands, which repairs the multipliers at the least cost.
///
/// Guarantee: that of certify_bands. Cost: per window about twelve eigendecompositions of 3 (core + 2
/// overlap) rows, memory for a few bands of that width. `observe` is told the share of windows done.
[[nodiscard]] WindowSolution solve_windows(const BandedProblem& problem, const WindowSettings& settings = {},
                                           const ProgressObserver& observe = {});

/// The least-squares coefficients J^-1 F'd.
[[nodiscard]] Eigen::VectorXd least_squares(const BandedProblem& problem);

/// The estimate c of a solution, from the problem's measurements.
[[nodiscard]] Eigen::VectorXd estimate_coefficients(const BandedProblem& problem,
                                                    const BandedEstimator& estimator);

}  // namespace trammel::inline TRAMMEL_ABI::window

#ifndef TRAMMEL_COMPILED
#include "trammel/window/solve_impl.hpp"
#endif
