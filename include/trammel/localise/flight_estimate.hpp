// SPDX-License-Identifier: Apache-2.0
/// @file
/// From a scenario with observations to an estimate whose stated error allows for bent measurements.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/estimate/trajectory_estimate.hpp"
#include "trammel/localise/locate.hpp"
#include "trammel/localise/stated_value.hpp"
#include "trammel/problem/scenario.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

/// Settings of estimate_flight. Solver and method are those of `estimate`.
struct FlightSettings {
  estimate::EstimateSettings estimate;
  std::optional<double> minimum_height_m;  ///< see LocateSettings
  ModelError model_error;
  FitSettings fit;
  Minimiser minimise = fit_levenberg_marquardt;  ///< see LocateSettings
  bool relinearise = true;  ///< about a path fitted to the data; otherwise about the reference path
  /// Each half of the scans (every second one of a station) is linearised about the path fitted to the other
  /// half; the estimate is the mean of the two.
  bool cross_fit = false;
};

/// What the path linearised about knows of the noise of the measurements estimated from.
enum class Independence {
  kSameData,        ///< fitted to them: the dependence is neglected
  kCrossFit,        ///< fitted to the other half of the scans
  kFixedReference,  ///< given beforehand
};

/// Name as in result files.
[[nodiscard]] constexpr std::string_view to_string(Independence independence) noexcept {
  switch (independence) {
    case Independence::kSameData:
      return "same_data";
    case Independence::kCrossFit:
      return "cross_fit";
    case Independence::kFixedReference:
      break;
  }
  return "fixed_reference";
}

/// A motion that explains the observations nearly as well as the best one but is too far from it.
struct CompetingSolution {
  double excess_cost = 0.0;  ///< see Branch
  double distance_m = 0.0;
  bool from_floor_test = false;
  double chi2 = 0.0;
  double stated_rms_m = std::numeric_limits<double>::quiet_NaN();  ///< holds if this motion is the true one
  double linear_guarantee_rms_m = std::numeric_limits<double>::quiet_NaN();
  estimate::PathTable path;  ///< its own estimate on the dense grid
};

/// What an estimate from measured values states beyond the linear guarantee. rms values are NaN where not
/// proved. With cross-fit every value is the mean of the two halves' (rms of a mean <= mean of the rms).
struct Statement {
  bool ambiguous = false;  ///< then there is no stated value, and `conditional_rms_m` holds only for the
                           ///< best branch
  Independence independence = Independence::kFixedReference;
  Consistency consistency = Consistency::kNoBound;  ///< with cross-fit the weaker of the two
  double stated_rms_m = std::numeric_limits<double>::quiet_NaN();
  double conditional_rms_m = std::numeric_limits<double>::quiet_NaN();
  double linear_guarantee_rms_m = std::numeric_limits<double>::quiet_NaN();
  double curvature_rms_m = std::numeric_limits<double>::quiet_NaN();
  double curvature_lower_rms_m = std::numeric_limits<double>::quiet_NaN();
  double model_error_rms_m = std::numeric_limits<double>::quiet_NaN();
  double kappa = std::numeric_limits<double>::quiet_NaN();
  std::optional<double> fixed_point_rms_m;
  std::vector<CompetingSolution> competing;
  std::vector<FloorTest> floor_tests;
  estimate::PathTable reference;  ///< the path linearised about, on the dense grid (mean of the two halves')
  double reference_cost =
      std::numeric_limits<double>::quiet_NaN();  ///< F, strong barriers; sum of the halves'
  double reference_chi2 = std::numeric_limits<double>::quiet_NaN();
  int starts = 0;   ///< fits tried
  int systems = 0;  ///< linear systems solved in them
  /// Per observation in the scenario's order: bound of the reference's rms error there (tube).
  std::vector<double> tube_m;
  double tube_widening = 1.0;  ///< contained in it (StatedValue); the larger of the halves'
};

/// Estimate and statement.
struct FlightEstimate {
  estimate::TrajectoryEstimate estimate;  ///< of the best branch, at its final linearisation
  std::optional<Statement> statement;     ///< absent without observations and where nothing is bounded
};

/// Solves a scenario. Without observations that is estimate::estimate_trajectory. With observations the
/// measurements are linearised about the path that fits them (locate), and the stated value adds to the
/// linear guarantee what the linearisation leaves out (state). Where all sensors measure positions there is
/// nothing to linearise.
///
/// Throws Error as locate does, where no motion within the bounds stays above the floor, and for cross-fit
/// with fewer than two observations.
[[nodiscard]] FlightEstimate estimate_flight(const Scenario& scenario, const FlightSettings& settings = {},
                                             const ProgressObserver& observe = {});

/// What the stated value proves, in one sentence.
[[nodiscard]] std::string describe_proved(const Statement& statement);

/// What it takes for granted, one sentence each.
[[nodiscard]] std::vector<std::string> describe_assumed(const Statement& statement,
                                                        const ModelError& model_error);

}  // namespace trammel::inline TRAMMEL_ABI::localise

#ifndef TRAMMEL_COMPILED
#include "trammel/localise/flight_estimate_impl.hpp"
#endif
