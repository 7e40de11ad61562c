// SPDX-License-Identifier: Apache-2.0
/// @file
/// The path of a flight under way, a fixed number of segments behind its measurements.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/problem/scenario.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

/// Settings of FixedLag.
struct FixedLagSettings {
  Eigen::Index lag = 6;      ///< segments between the newest measurements and the path: more is more accurate
  Eigen::Index memory = 24;  ///< segments of measurements kept before the path
  bool relinearise = true;   ///< about a path fitted to the measurements kept; otherwise about the plan
};

/// The flight at a knot.
struct LaggedState {
  double t_s = 0.0;
  Eigen::Vector3d position_m;
  Eigen::Vector3d velocity_mps;
  double guaranteed_rms_m = 0.0;  ///< of the position, for every motion within the bounds
};

/// Estimates a flight while it is measured. Whenever a segment is complete, the window of the last `memory` +
/// `lag` segments is solved (solve_windows, one window) and the knot `lag` segments back is given out: what
/// lies before the window enters only through the bounds on accelerations, the window's first position and
/// velocity count as unknown (but for those of the flight's start).
///
/// Guarantee: guaranteed_rms_m of each knot is that of BandedPointwise for the estimator used, for the
/// measurements linearised as in estimate_flight. Cost per segment: one window, independent of the length of
/// the flight; so is the memory.
class FixedLag {
 public:
  /// `plan`: knots, reference path, bounds and stations; its observations are ignored. Throws Error as
  /// `check` does, for other than positive settings, and for a lag the flight is too short for.
  explicit FixedLag(Scenario plan, const FixedLagSettings& settings = {});

  /// Takes a measurement. Throws Error for one that is older than the measurements kept.
  void add(Measurement measurement);

  /// The knots that have become due: all measurements made before `now_s` have been added. Throws Error where
  /// those of a window do not determine the motion (assemble_banded).
  [[nodiscard]] std::vector<LaggedState> advance(double now_s);

  /// The knots left when the flight is over; measurements as in advance.
  [[nodiscard]] std::vector<LaggedState> finish();

 private:
  /// The states at the knots next_ .. last from the measurements up to knot `newest`.
  [[nodiscard]] std::vector<LaggedState> states(Eigen::Index newest, Eigen::Index last);

  Scenario plan_;
  FixedLagSettings settings_;
  std::vector<Measurement> kept_;
  Eigen::Index next_ = 0;  ///< knot to be given out next
};

}  // namespace trammel::inline TRAMMEL_ABI::window

#ifndef TRAMMEL_COMPILED
#include "trammel/window/fixed_lag_impl.hpp"
#endif
