// SPDX-License-Identifier: Apache-2.0
#include "campaign_summary.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "trammel/campaign/motion_study.hpp"
#include "trammel/core/config.hpp"

namespace trammel::report {

namespace {

using io::Json;

void add_studies(const io::CampaignManifest& manifest, const io::CsvTable& merged, Json& json) {
  json["runs"] = manifest.runs;
  json["seed"] = manifest.seed;
  json["motion"] = io::name_of(manifest.motion);
  json["confidence"] = campaign::StudySummary::kConfidence;
  json["contradicted"] = 0;
  json["studies"] = Json::array();
  const std::size_t linear = merged.column("actual_rms_error_m");
  const std::size_t nonlinear = merged.column("nonlinear_rms_error_m");
  int contradicted = 0;
  for (std::size_t k = 0; k < manifest.scenarios.size(); ++k) {
    const auto errors = [&](std::size_t column) {
      std::vector<double> values;
      for (std::size_t row = k * manifest.runs; row < (k + 1) * manifest.runs; ++row) {
        values.push_back(merged.number(row, column));
      }
      return values;
    };
    const double guaranteed = manifest.scenarios[k].guaranteed_rms_m;
    const campaign::StudySummary summary = campaign::summarise(errors(linear), guaranteed);
    const campaign::StudySummary by_sensors = campaign::summarise(errors(nonlinear), guaranteed);
    contradicted += summary.contradicts() ? 1 : 0;
    json["studies"].push_back(
        {{"scenario", manifest.scenarios[k].file},
         {"runs", summary.runs},
         {"guaranteed_rms_m", guaranteed},
         {"actual_rms_m", std::sqrt(summary.mean_square_m2)},
         {"mean_square_m2", summary.mean_square_m2},
         {"standard_error_m2", io::to_json(summary.standard_error_m2)},
         {"ratio", summary.ratio},
         {"ratio_interval", {io::to_json(summary.ratio_low), io::to_json(summary.ratio_high)}},
         {"largest_rms_m", summary.largest_rms_m},
         {"contradicts", summary.contradicts()},
         {"nonlinear_rms_m", std::sqrt(by_sensors.mean_square_m2)},
         {"nonlinear_ratio", by_sensors.ratio}});
  }
  json["contradicted"] = contradicted;
}

void add_flights(const io::CsvTable& merged, Json& json) {
  const std::size_t status = merged.column("status");
  const std::size_t guaranteed = merged.column("guaranteed_rms_m");
  const std::size_t gap = merged.column("relative_gap");
  json["status"] = Json::object();
  std::vector<std::pair<double, std::string>> values;
  double largest_gap = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t row = 0; row < merged.rows.size(); ++row) {
    const std::vector<std::string>& cells = merged.rows[row];
    Json& count = json["status"][cells[status]];
    count = count.is_null() ? 1 : count.get<int>() + 1;
    double value = 0.0;
    if (io::parse_number(cells[guaranteed], value)) {
      values.emplace_back(value, cells[0]);
    }
    if (io::parse_number(cells[gap], value)) {
      largest_gap = std::fmax(largest_gap, value);
    }
  }
  std::sort(values.begin(), values.end());
  json["guaranteed_rms_m"] = nullptr;
  if (!values.empty()) {
    const std::size_t half = values.size() / 2;
    const double median =
        values.size() % 2 == 1 ? values[half].first : (values[half - 1].first + values[half].first) / 2;
    json["guaranteed_rms_m"] = {
        {"smallest", values.front().first}, {"median", median}, {"largest", values.back().first}};
    json["largest_guaranteed"] = values.back().second;
  }
  json["largest_relative_gap"] = io::to_json(largest_gap);
}

std::string line(const char* format, auto... values) {
  std::array<char, 256> buffer{};
  std::snprintf(buffer.data(), buffer.size(), format, values...);
  return buffer.data();
}

}  // namespace

Json campaign_json(const io::CampaignManifest& manifest, const io::CsvTable& merged) {
  Json json;
  const bool monte_carlo = manifest.kind == io::CampaignKind::kMonteCarlo;
  json["kind"] = monte_carlo ? "monte-carlo" : "archive";
  json["scenarios"] = manifest.scenarios.size();
  if (monte_carlo) {
    add_studies(manifest, merged, json);
  } else {
    add_flights(merged, json);
  }
  json["library_version"] = kVersion;
  return json;
}

std::string campaign_text(const Json& summary) {
  std::string text;
  if (summary["kind"] == "archive") {
    text += std::to_string(summary["scenarios"].get<std::size_t>()) + " flights:";
    for (const auto& [status, count] : summary["status"].items()) {
      text += " " + std::to_string(count.get<int>()) + " " + status;
    }
    text += "\n";
    const Json& values = summary["guaranteed_rms_m"];
    if (!values.is_null()) {
      text +=
          line("guaranteed rms error    %.6g to %.6g m, median %.6g m\n", values["smallest"].get<double>(),
               values["largest"].get<double>(), values["median"].get<double>());
      text += "largest for             " + summary["largest_guaranteed"].get<std::string>() + "\n";
    }
    return text;
  }
  for (const Json& study : summary["studies"]) {
    text += study["scenario"].get<std::string>() + "\n";
    text += line("  guaranteed rms error  %.6g m\n  actual, %zu runs    %.6g m (largest %.6g m)\n",
                 study["guaranteed_rms_m"].get<double>(), study["runs"].get<std::size_t>(),
                 study["actual_rms_m"].get<double>(), study["largest_rms_m"].get<double>());
    text += line("  mean square / guaranteed square  %.4f", study["ratio"].get<double>());
    const Json& interval = study["ratio_interval"];
    if (!interval[0].is_null()) {
      text += line(", %.0f %% confidence %.4f to %.4f", 100.0 * summary["confidence"].get<double>(),
                   interval[0].get<double>(), interval[1].get<double>());
    }
    text += study["contradicts"].get<bool>() ? "\n  THE RUNS CONTRADICT THE GUARANTEE\n" : "\n";
    text += line("  by the sensors, not linearised   %.6g m, ratio %.4g\n",
                 study["nonlinear_rms_m"].get<double>(), study["nonlinear_ratio"].get<double>());
  }
  return text;
}

}  // namespace trammel::report
