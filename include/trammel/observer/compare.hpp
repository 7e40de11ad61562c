// SPDX-License-Identifier: Apache-2.0
/// @file
/// Where should the observer stand, or which path should it fly? Candidates ranked by guaranteed error.
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/core/status.hpp"
#include "trammel/estimate/trajectory_estimate.hpp"
#include "trammel/problem/scenario.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

/// One way to observe.
struct Candidate {
  std::string name;
  Scenario scenario;  ///< observations in it are not used, only the planned times
};

/// What a candidate guarantees.
struct CandidateResult {
  std::size_t index = 0;  ///< in the list given
  std::string name;
  SolveStatus status = SolveStatus::kNumericalTrouble;
  double guaranteed_rms_m = std::numeric_limits<double>::quiet_NaN();  ///< infinity: unbounded
  double lower_bound_rms_m = std::numeric_limits<double>::quiet_NaN();
};

/// Candidates from the smallest guaranteed error to the largest.
struct Comparison {
  std::vector<CandidateResult> ranking;
  /// True where the first's guaranteed error is not above the lower bound of any other: no better choice
  /// exists among the candidates, whatever the remaining gaps.
  bool decided = false;
};

/// Solves the guaranteed estimation problem of every candidate; the minimum over a finite set of
/// guaranteed_rms_m, each a certified bound of estimate::estimate_trajectory. Throws Error if there is no
/// candidate or one breaks the rules of a scenario. Cost: one estimate per candidate.
[[nodiscard]] Comparison compare(const std::vector<Candidate>& candidates,
                                 const estimate::EstimateSettings& settings = {},
                                 const ProgressObserver& observe = {});

/// The scenario with a station moved to a site.
[[nodiscard]] Scenario with_station_at(Scenario scenario, std::size_t station,
                                       const Eigen::Vector3d& position_m);

/// The scenario with a station that is carried along a track, without observations.
[[nodiscard]] Scenario with_station_along(Scenario scenario, std::size_t station, PathSamples track);

}  // namespace trammel::inline TRAMMEL_ABI::observer

#ifndef TRAMMEL_COMPILED
#include "trammel/observer/compare_impl.hpp"
#endif
