// SPDX-License-Identifier: Apache-2.0
/// @file
/// Finds the motions that explain the observations and states how good the estimate is, honestly.
#pragma once

#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/localise/fit.hpp"
#include "trammel/localise/fit_problem.hpp"
#include "trammel/localise/levenberg_marquardt.hpp"
#include "trammel/localise/stated_value.hpp"
#include "trammel/minimax/methods.hpp"
#include "trammel/problem/scenario.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

/// Settings of locate.
struct LocateSettings {
  std::optional<double> minimum_height_m;  ///< the path stays above it; excludes mirrored solutions
  ModelError model_error;
  FitSettings fit;
  Minimiser minimise = fit_levenberg_marquardt;  ///< makes all fits
  minimax::SolverSettings solver;
  minimax::MethodChoice method;
};

/// What locate found.
enum class LocateStatus {
  kUnique,           ///< one motion explains the observations best by far
  kAmbiguous,        ///< motions too far apart explain them nearly equally well: no single value is stated
  kInfeasibleStart,  ///< no motion within the bounds was found that stays above the floor
};

/// Name as in result files.
[[nodiscard]] constexpr std::string_view to_string(LocateStatus status) noexcept {
  switch (status) {
    case LocateStatus::kUnique:
      return "unique";
    case LocateStatus::kAmbiguous:
      return "ambiguous";
    case LocateStatus::kInfeasibleStart:
      break;
  }
  return "infeasible_start";
}

/// One way to explain the observations.
struct Branch {
  Fit minimum;                        ///< with weak barriers
  double excess_cost = 0.0;           ///< above the best branch: twice F, weak barriers
  double distance_m = 0.0;            ///< root mean square distance from the best branch over the criterion
  bool from_floor_test = false;       ///< the fit above a station's plane rather than a local minimum
  Fit reference;                      ///< linearised about: the fit with strong barriers
  std::optional<StatedValue> stated;  ///< holds if this branch is the true one
};

/// The best fit confined above a station's plane, beside the best of all.
struct FloorTest {
  double height_m = 0.0;     ///< of the plane
  double excess_cost = 0.0;  ///< above the best branch: |r|^2 plus twice the bounds' barrier, weak barriers
  double distance_m = 0.0;   ///< root mean square distance from the best branch over the criterion
  /// The same between the fits with strong barriers, which linearisations are made about.
  double reference_excess_cost = 0.0;
  double reference_distance_m = 0.0;
};

/// Result of locate.
struct Location {
  LocateStatus status = LocateStatus::kInfeasibleStart;
  /// Best first. Only one unless ambiguous.
  std::vector<Branch> branches;
  std::vector<FloorTest> floor_tests;  ///< planes that the floor does not exclude and a motion stays above
  double lowest_height_m = 0.0;        ///< of the motion the search starts from
  int starts = 0;                      ///< fits tried
  int systems = 0;                     ///< linear systems solved in all fits
};

/// Barrier weights: modes are told apart with weak barriers, the linearisation point is the fit with strong
/// ones (curvature 9/d^2 at the centre, as of a prior of three standard deviations per semi-axis).
inline constexpr double kWeakBarrier = 0.1;
inline constexpr double kStrongBarrier = 4.5;
/// Two motions are told apart where twice their costs differ by at least this: for a fixed pair the false one
/// then wins with a probability of at most Q(4) = 3.2e-5.
inline constexpr double kDecisiveCost = 16.0;
/// The same for a floor test. There one side as a whole is set against the other, and a spline may fit the
/// true path worse than a false one on the other side: with a misfit of A standard deviations (root of chi^2)
/// the false path of a pair wins by (4 + A)^2 with a probability of at most Q(4) (its own misfit B and the
/// distance D <= A + B of the two at their worst). Here A = 4, as the half cosine of the published manoeuvre
/// has it.
inline constexpr double kDecisiveFloorCost = 64.0;

/// 1. Minimises F from many starts: falling barrier weights, steps along the weakest directions, the path
///    mirrored (wholly or in parts) in each station's horizontal plane, two random motions; 2. clusters the
///    minima; 3. from the best one, scaled by 0.9, fits with strong barriers and states the value there;
/// 4. ambiguous if another minimum costs less than kDecisiveCost more and is further away than the linear
///    guarantee, or if the fit confined above a station's plane costs less than kDecisiveFloorCost more and
///    is (floor test: the alternative need not be a local minimum), with weak or with strong barriers (where
///    the minimum is near the plane, the two sides part only at the linearisation point). Then every such
///    branch has its own reference and stated value.
/// Where the reference path itself is not above the floor the search starts from find_interior_motion.
///
/// Assumed, not proved: the starts find all relevant minima.
/// Cost: some hundred linear systems of p unknowns per start, one guaranteed solve per branch.
/// Throws Error as FitProblem does, and for settings out of range.
[[nodiscard]] Location locate(const Scenario& scenario, const LocateSettings& settings = {},
                              const ProgressObserver& observe = {});

/// The same with the value stated for other measurements of the same flight than those fitted: the reference
/// then does not depend on the noise of the measurements it linearises. `fit` has the floor already;
/// references are in its coordinates. `stated_on`: same knots, reference path and bounds.
[[nodiscard]] Location locate(const FitProblem& fit, const FitProblem& stated_on,
                              const LocateSettings& settings = {}, const ProgressObserver& observe = {});

}  // namespace trammel::inline TRAMMEL_ABI::localise

#ifndef TRAMMEL_COMPILED
#include "trammel/localise/locate_impl.hpp"
#endif
