// SPDX-License-Identifier: Apache-2.0
/// @file
/// Input files of the bearings-only observer: plans, flights, comparisons.
#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "scenario_reader.hpp"
#include "trammel/observer/compare.hpp"
#include "trammel/observer/flight.hpp"
#include "trammel/observer/plan_problem.hpp"

namespace trammel::io {

/// What a plan file says.
struct ObserverInput {
  std::string title;
  observer::PlanProblem problem;
  observer::FlightSettings flight;  ///< used by simulate alone, but for max_lateral_speed_mps
  double max_start_x_m = std::numeric_limits<double>::infinity();
  std::optional<double> target_sigma_x_m;
  std::optional<double> energy_budget_m2ps;
};

/// What an input file is read for.
enum class ObserverUse { kPlan, kSimulate };

/// Reads a plan problem, TOML or JSON by its ending.
///
/// ```
/// title                   = "text"                    # optional
/// position_m              = [x, y, z]                 # x < 0; simulate: mean of the prior
/// covariance_m2           = [[..], [..], [..]]
/// speed_mps, time_to_go_s, sigma0, measurement_interval_s
/// beta_per_s              = [b1, b2, b3]
/// terminal_m              = [y, z]                    # default 0, 0
/// beacon_velocity_mps     = [vx, vy, vz]              # default 0
/// max_lateral_speed_mps                               # plan: lower beta until the limit holds; simulate:
/// always target_sigma_x_m | energy_budget_m2ps               # plan only: scale beta to reach it
/// replan_interval_s                                   # simulate; default 5 measurement intervals
/// max_start_x_m                                       # simulate; draw starts beyond it again
/// min_final_distance_m, gate_m                        # simulate; see observer::FlightSettings
/// measured                = "tangents" | "angles"     # simulate
/// filter                  = "kalman" | "range_grid"   # simulate
/// ```
/// Throws Error naming file, line or key, what was found and what was expected.
[[nodiscard]] ObserverInput read_observer(const std::filesystem::path& file, ObserverUse use);

/// A scenario and the candidates to compare in it.
struct CompareInput {
  std::string title;
  ScenarioInput base;
  std::vector<observer::Candidate> candidates;
};

/// Reads a comparison.
///
/// ```
/// scenario = "flight.toml"                            # its stations need times_s
/// [[candidate]]
///   name    = "north hill"
///   station = "radar"                                 # the one to place
///   position_m = [..3] | path = "weave.csv"           # a site, or t_s,x_m,y_m,z_m of a carried station
/// ```
[[nodiscard]] CompareInput read_comparison(const std::filesystem::path& file);

}  // namespace trammel::io
