// SPDX-License-Identifier: Apache-2.0
/// @file
/// Segment length and acceleration bounds that suit measured data.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/localise/levenberg_marquardt.hpp"
#include "trammel/localise/stated_value.hpp"
#include "trammel/minimax/solution.hpp"
#include "trammel/problem/scenario.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

/// Settings of suggest_segments.
struct SuggestSettings {
  std::vector<double> lengths_s = {};  ///< lengths to try; empty: 1, 2, 3, 5, 7 times powers of ten that fit
  int max_segments = 150;              ///< shorter lengths are not tried
  double quantile = 0.99;              ///< of the accelerations and of the jerk that the bounds cover
  double margin = 1.5;                 ///< bounds over that quantile
  std::optional<double> minimum_height_m = {};
  FitSettings fit = {};
  Minimiser minimise = fit_levenberg_marquardt;             ///< makes all fits
  minimax::SolverSettings solver = {.relative_gap = 1e-5};  ///< lengths are compared: few digits do
};

/// One segment length tried.
struct LengthTrial {
  double segment_s = 0.0;
  std::size_t segments = 0;
  Eigen::Vector3d acceleration_mps2 = Eigen::Vector3d::Zero();  ///< bound: margin times the quantile
  double jerk_mps3 = 0.0;                                       ///< the same of the jerk between segments
  double noise_share = 0.0;  ///< of the accelerations' mean square: what the data do not determine
  double chi2 = std::numeric_limits<double>::quiet_NaN();  ///< of the fit within these bounds, weak barriers
  double degrees = std::numeric_limits<double>::quiet_NaN();  ///< its expectation if the spline holds
  double likelihood =
      std::numeric_limits<double>::quiet_NaN();  ///< minus twice its logarithm, up to a constant
  ModelError model_error;                        ///< expected for the suggestion's jerk
  double linear_rms_m = std::numeric_limits<double>::quiet_NaN();     ///< guaranteed, certified
  double curvature_rms_m = std::numeric_limits<double>::quiet_NaN();  ///< as StatedValue
  double model_rms_m = std::numeric_limits<double>::quiet_NaN();      ///< model error through the estimate
  double stated_rms_m = std::numeric_limits<double>::quiet_NaN();     ///< sum of the three

  /// Standard deviations that chi2 is above its expectation.
  [[nodiscard]] double excess() const;
  /// Whether the residuals are no larger than the stated noise explains (excess below kMisfit).
  [[nodiscard]] bool fits() const { return excess() < kMisfit; }
  [[nodiscard]] bool dominated_by_model_error() const { return model_rms_m > linear_rms_m; }

  static constexpr double kMisfit = 6.0;
};

/// Result of suggest_segments.
struct Suggestion {
  std::vector<LengthTrial> trials;  ///< lengths ascending
  /// The longest of those that fit whose stated value is at most kAsGood times the least; where none fits,
  /// that of the least excess.
  std::size_t best = 0;
  std::size_t likeliest = 0;  ///< highest likelihood: what the jerk is taken from
  double jerk_mps3 = 0.0;

  static constexpr double kAsGood = 1.01;
};

/// Tries segment lengths on the observations of a scenario. Its bounds on position and velocity are used,
/// those on acceleration are not; of its knots only the ends.
///
/// For each length: a fit with hardly any bounds on the accelerations; about it, the accelerations as normal
/// variables of one variance for both horizontal axes and one for the vertical, found with the most likely
/// values by expectation and maximisation (Dempster, Laird, Rubin 1977; the "type II" likelihood of linear
/// Gaussian models); bounds from the second moments that remain of them given the data (data and what the
/// data leave open); and with those bounds the guarantee, stated as `state` does. The jerk is that between
/// neighbouring segments at the likeliest length, from which the model error j T^3/24 of every length
/// follows.
///
/// Nothing here is proved: bounds learnt from data that the estimate then uses are the user's decision.
/// Cost: for each length a constrained fit, some dozens of p x p inversions and one guaranteed solve.
/// Throws Error as FitProblem does, for settings out of range, and where fewer than three segments fit in.
[[nodiscard]] Suggestion suggest_segments(const Scenario& scenario, const SuggestSettings& settings = {},
                                          const ProgressObserver& observe = {});

}  // namespace trammel::inline TRAMMEL_ABI::localise

#ifndef TRAMMEL_COMPILED
#include "trammel/localise/suggest_impl.hpp"
#endif
