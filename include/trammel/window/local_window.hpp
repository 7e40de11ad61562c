// SPDX-License-Identifier: Apache-2.0
/// @file
/// One window of a long flight: its problem, multipliers, and the rows it contributes.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/minimax/solution.hpp"
#include "trammel/problem/banded_problem.hpp"
#include "trammel/window/ranges.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

/// Rows a window contributes to W and V of the flight: those of its core.
struct EstimatorRows {
  Eigen::MatrixXd bias;     ///< core coefficients x bounds: W
  Eigen::MatrixXd moments;  ///< core bounds x bounds: V
};

/// Rows it contributes to X and G.
struct PriorRows {
  Eigen::MatrixXd posterior;  ///< core coefficients x coefficients: X
  Eigen::MatrixXd image;      ///< core coefficients x bounds: G
};

/// What a window's own solver found.
struct WindowMultipliers {
  Eigen::VectorXd multipliers;  ///< one per bound of the window; empty where none were found
  Eigen::MatrixXd moments;      ///< bounds x bounds: V; empty where the multipliers suffice
  int iterations = 0;
};

/// The measurements, criterion and bounds within a window, as dense matrices. Coefficients are counted from
/// 3 first(); bounds from 3 first_bound(): those of the start where the window holds the flight's, then
/// accelerations.
class LocalWindow {
 public:
  LocalWindow(const BandedProblem& problem, const WindowRange& range);

  [[nodiscard]] Eigen::Index first_bound() const noexcept { return first_bound_; }
  [[nodiscard]] Eigen::Index bounds() const noexcept { return bound_rows_.rows() / 3; }
  /// First coefficient, per axis.
  [[nodiscard]] Eigen::Index first() const noexcept { return range_.first; }
  /// Coefficients and bounds the window answers for: first and one behind, counted in the flight.
  [[nodiscard]] Eigen::Index core_first() const noexcept;
  [[nodiscard]] Eigen::Index core_behind() const noexcept;
  [[nodiscard]] Eigen::Index core_bound_first() const noexcept;
  [[nodiscard]] Eigen::Index core_bound_behind() const noexcept { return range_.core_behind + 2; }

  /// Step 1 of solve_windows: no multipliers where the least favourable prior is singular.
  [[nodiscard]] WindowMultipliers solve(const minimax::SolverSettings& settings) const;
  /// Multipliers and moments by minimax::solve.
  [[nodiscard]] WindowMultipliers solve_fully(const minimax::SolverSettings& settings) const;
  /// Step 2, from sqrt(lambda) per row of D; nothing where V is not positive definite.
  [[nodiscard]] std::optional<EstimatorRows> from_multipliers(const Eigen::VectorXd& root) const;
  /// Step 3, from V.
  [[nodiscard]] PriorRows from_moments(const Eigen::MatrixXd& moments) const;

 private:
  /// One multiplier per bound from one per ellipsoid.
  [[nodiscard]] Eigen::VectorXd per_bound(const std::vector<Eigen::Index>& places,
                                          const Eigen::VectorXd& multipliers) const;
  /// Rows of bound l of the window that are not zero.
  [[nodiscard]] std::vector<Eigen::Index> finite_rows(Eigen::Index l) const;
  /// The window's own problem; the places of its bounds among the ellipsoids, -1 where infinite.
  [[nodiscard]] std::pair<GuaranteedProblem, std::vector<Eigen::Index>> weakly_bounded() const;

  WindowRange range_;
  Eigen::Index segments_ = 0;  ///< of the flight
  Eigen::Index first_bound_ = 0;
  Eigen::MatrixXd information_;  ///< F, triangle of the window's measurements
  Eigen::MatrixXd inverse_;      ///< F^-1
  Eigen::MatrixXd criterion_;    ///< C
  Eigen::MatrixXd bound_rows_;   ///< D
  Eigen::MatrixXd start_rows_;   ///< position and velocity at the window's begin, 6 rows
};

}  // namespace trammel::inline TRAMMEL_ABI::window

#ifndef TRAMMEL_COMPILED
#include "trammel/window/local_window_impl.hpp"
#endif
