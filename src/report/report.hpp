// SPDX-License-Identifier: Apache-2.0
/// @file
/// The report: one self-contained HTML page.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "../io/json_output.hpp"
#include "../io/scenario_reader.hpp"
#include "trammel/estimate/trajectory_estimate.hpp"
#include "trammel/localise/flight_estimate.hpp"
#include "trammel/localise/outliers.hpp"
#include "truth_comparison.hpp"

namespace trammel::report {

/// What a report is made of.
struct ReportInput {
  const io::ScenarioInput& scenario;
  const estimate::TrajectoryEstimate& estimate;
  const TruthComparison* truth = nullptr;             ///< null: not given
  const localise::Statement* statement = nullptr;     ///< null: no observations, or nothing is bounded
  const localise::OutlierSearch* outliers = nullptr;  ///< null: not looked for; the scenario has the others
};

/// How a result ended, in the words of result.json, the terminal and the page.
struct Outcome {
  std::string_view name;    ///< that of the solver's status, or "ambiguous"
  std::string_view cause;   ///< what happened
  std::string_view remedy;  ///< what to do about it
  bool solved = false;      ///< a single value is stated as asked for
};

[[nodiscard]] Outcome outcome(const ReportInput& input);

/// A number for a reader: `digits` significant ones.
[[nodiscard]] std::string rounded(double value, int digits = 4);

/// "averaged over the whole flight, 0 to 160 s".
[[nodiscard]] std::string describe_criterion(const Scenario& scenario);

/// Sentences a reader has to know before trusting the numbers; empty where there is nothing to warn of.
[[nodiscard]] std::vector<std::string> warnings(const ReportInput& input);

/// Everything the page shows, as the JSON its script reads.
[[nodiscard]] io::Json report_data(const ReportInput& input);

/// The page. Needs no network and no file beside it.
[[nodiscard]] std::string report_html(const ReportInput& input);

}  // namespace trammel::report
