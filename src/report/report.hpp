// SPDX-License-Identifier: Apache-2.0
/// @file
/// The report: one self-contained HTML page.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "../io/json_output.hpp"
#include "../io/scenario_reader.hpp"
#include "trammel/estimate/trajectory_estimate.hpp"
#include "truth_comparison.hpp"

namespace trammel::report {

/// Second-order remainder, in sigma, from which a linear model is no longer called good: a tenth of the
/// noise adds half a per cent to the rms.
inline constexpr double kSmallLinearisationRatio = 0.1;

/// What a report is made of.
struct ReportInput {
  const io::ScenarioInput& scenario;
  const estimate::TrajectoryEstimate& estimate;
  const TruthComparison* truth = nullptr;  ///< null: not given
};

/// "averaged over the whole flight, 0 to 160 s".
[[nodiscard]] std::string describe_criterion(const Scenario& scenario);

/// Sentences a reader has to know before trusting the numbers; empty where there is nothing to warn of.
[[nodiscard]] std::vector<std::string> warnings(const ReportInput& input);

/// Everything the page shows, as the JSON its script reads.
[[nodiscard]] io::Json report_data(const ReportInput& input);

/// The page. Needs no network and no file beside it.
[[nodiscard]] std::string report_html(const ReportInput& input);

}  // namespace trammel::report
