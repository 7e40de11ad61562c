// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of compare.hpp.
#pragma once

#include <algorithm>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/observer/compare.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

TRAMMEL_INLINE Comparison compare(const std::vector<Candidate>& candidates,
                                  const estimate::EstimateSettings& settings,
                                  const ProgressObserver& observe) {
  require(!candidates.empty(), "candidates", "none", "at least one");
  Comparison comparison;
  estimate::EstimateSettings bounds_only = settings;
  bounds_only.near_optimality.reset();
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    Scenario scenario = candidates[i].scenario;
    scenario.observations.clear();
    const estimate::TrajectoryEstimate estimate = estimate::estimate_trajectory(scenario, bounds_only);
    comparison.ranking.push_back({i, candidates[i].name, estimate.solution.status, estimate.guaranteed_rms_m,
                                  estimate.lower_bound_rms_m});
    if (observe) {
      observe({"compare candidates", static_cast<double>(i + 1) / static_cast<double>(candidates.size())});
    }
  }
  auto& ranking = comparison.ranking;
  // Not computed counts as worst.
  const auto key = [](const CandidateResult& result) {
    return result.guaranteed_rms_m >= 0.0 ? result.guaranteed_rms_m : std::numeric_limits<double>::infinity();
  };
  std::stable_sort(ranking.begin(), ranking.end(),
                   [&](const CandidateResult& a, const CandidateResult& b) { return key(a) < key(b); });
  comparison.decided = std::all_of(ranking.begin() + 1, ranking.end(), [&](const CandidateResult& other) {
    return ranking.front().guaranteed_rms_m <= other.lower_bound_rms_m ||
           (other.status == SolveStatus::kUnbounded && ranking.front().status != SolveStatus::kUnbounded);
  });
  return comparison;
}

TRAMMEL_INLINE Scenario with_station_at(Scenario scenario, std::size_t station,
                                        const Eigen::Vector3d& position_m) {
  require(station < scenario.stations.size(), "station", "an index beyond the stations",
          "a station of the scenario");
  scenario.stations[station].position_m = position_m;
  scenario.stations[station].track = {};
  return scenario;
}

TRAMMEL_INLINE Scenario with_station_along(Scenario scenario, std::size_t station, PathSamples track) {
  require(station < scenario.stations.size(), "station", "an index beyond the stations",
          "a station of the scenario");
  scenario.stations[station].track = std::move(track);
  scenario.observations.clear();
  return scenario;
}

}  // namespace trammel::inline TRAMMEL_ABI::observer
