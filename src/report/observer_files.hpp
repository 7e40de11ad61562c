// SPDX-License-Identifier: Apache-2.0
/// @file
/// What the observer's commands write: JSON, CSV, text, the report page.
#pragma once

#include <string>

#include "../io/json_output.hpp"
#include "../io/observer_reader.hpp"
#include "trammel/observer/compare.hpp"
#include "trammel/observer/monte_carlo.hpp"
#include "trammel/observer/plan_limits.hpp"

namespace trammel::report {

/// A simulation with what it was asked for.
struct SimulationReport {
  const io::ObserverInput& input;
  const observer::FlightLoop& loop;
  const observer::MonteCarloSettings& settings;
  const observer::MonteCarloResult& result;
};

[[nodiscard]] io::Json plan_json(const io::ObserverInput& input, const observer::LimitedPlan& plan);
[[nodiscard]] std::string plan_summary(const io::ObserverInput& input, const observer::LimitedPlan& plan);
/// `t_s,x_m,y_m,z_m,u1_mps,u2_mps` at the measurement times.
[[nodiscard]] std::string plan_csv(const io::ObserverInput& input, const observer::Plan& plan);

[[nodiscard]] io::Json simulation_json(const SimulationReport& report);
[[nodiscard]] std::string simulation_summary(const SimulationReport& report);
/// `run,error_x_m,miss_m,effort_m,nees`.
[[nodiscard]] std::string runs_csv(const observer::MonteCarloResult& result);
/// The page: flights in three projections, spread over time, distributions.
[[nodiscard]] std::string simulation_html(const SimulationReport& report);

[[nodiscard]] io::Json comparison_json(const io::CompareInput& input, const observer::Comparison& comparison);
[[nodiscard]] std::string comparison_summary(const observer::Comparison& comparison);

}  // namespace trammel::report
