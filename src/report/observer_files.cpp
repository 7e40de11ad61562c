// SPDX-License-Identifier: Apache-2.0
#include "observer_files.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "../io/csv.hpp"
#include "page.hpp"
#include "report.hpp"
#include "report_assets.hpp"

namespace trammel::report {

namespace {

using io::Json;

std::string row(const std::string& name, const std::string& value, const std::string& remark = "") {
  constexpr std::size_t kColumn = 30;
  std::string line = name;
  line.resize(std::max(kColumn, line.size() + 1), ' ');
  return line + value + (remark.empty() ? "" : "   " + remark) + "\n";
}

/// Equal bins from a low to a high quantile; what lies outside is counted in the end bins.
Json histogram(const std::vector<double>& values, double low_probability, double high_probability) {
  constexpr int kBins = 40;
  const double low = observer::quantile(values, low_probability);
  const double high = observer::quantile(values, high_probability);
  const double width = high > low ? (high - low) / kBins : 1.0;
  std::vector<double> share(kBins, 0.0);
  for (const double value : values) {
    const double bin = std::clamp((value - low) / width, 0.0, kBins - 1.0);
    share[static_cast<std::size_t>(bin)] += 1.0 / static_cast<double>(values.size());
  }
  Json centres = Json::array();
  for (int i = 0; i < kBins; ++i) {
    centres.push_back(low + (i + 0.5) * width);
  }
  return {{"centre", centres}, {"share", share}, {"width", width}};
}

/// Adds a density, as expected share per bin, to a histogram.
template <class Density>
void add_density(Json& histogram, const char* name, const Density& density) {
  Json values = Json::array();
  for (const double x : histogram.at("centre")) {
    values.push_back(io::to_json(histogram.at("width").get<double>() * density(x)));
  }
  histogram[name] = values;
}

Json histograms(const observer::MonteCarloResult& result) {
  constexpr double kTail = 0.002;
  Json error = histogram(result.error_x_m, kTail, 1.0 - kTail);
  const double mean = result.error.mean;
  const double sigma = result.error.deviation;
  add_density(error, "normal", [&](double x) {
    const double u = (x - mean) / sigma;
    return std::exp(-0.5 * u * u) / (sigma * std::sqrt(2.0 * std::numbers::pi));
  });
  Json nees = histogram(result.nees, 0.0, 0.98);
  add_density(nees, "chi2",
              [](double x) { return std::sqrt(x / (2.0 * std::numbers::pi)) * std::exp(-0.5 * x); });
  return {{"error", error},
          {"miss", histogram(result.miss_m, 0.0, 1.0 - kTail)},
          {"effort", histogram(result.effort_m, kTail, 1.0 - kTail)},
          {"nees", nees}};
}

Json sample_paths(const observer::MonteCarloResult& result) {
  Json paths = Json::array();
  for (const observer::SamplePath& path : result.paths) {
    Json x = Json::array();
    Json y = Json::array();
    Json z = Json::array();
    for (const Eigen::Vector3d& p : path.truth_m) {
      x.push_back(io::to_json(p.x()));
      y.push_back(io::to_json(p.y()));
      z.push_back(io::to_json(p.z()));
    }
    paths.push_back({{"x", x}, {"y", y}, {"z", z}});
  }
  return paths;
}

Json spread_json(const observer::MonteCarloResult& result) {
  Json t = Json::array();
  Json mean = Json::array();
  Json sd = Json::array();
  Json predicted = Json::array();
  for (const observer::SpreadPoint& point : result.spread) {
    t.push_back(point.time_s);
    mean.push_back(io::to_json(point.mean_error_x_m));
    sd.push_back(io::to_json(point.sd_error_x_m));
    predicted.push_back(io::to_json(point.rms_predicted_x_m));
  }
  return {{"t", t}, {"mean", mean}, {"sd", sd}, {"predicted", predicted}};
}

std::string filter_name(const observer::FlightSettings& settings) {
  if (settings.filter == observer::FilterKind::kRangeGrid) {
    return "exact Bayes on a grid over x";
  }
  return settings.measured == observer::BearingKind::kAngles ? "extended Kalman filter, measured angles"
                                                             : "extended Kalman filter, measured tangents";
}

std::string vector_text(const Eigen::Ref<const Eigen::VectorXd>& values) {
  std::string text;
  for (const double value : values) {
    text += (text.empty() ? "" : ", ") + rounded(value);
  }
  return text;
}

}  // namespace

Json plan_json(const io::ObserverInput& input, const observer::LimitedPlan& limited) {
  const observer::Plan& plan = limited.plan;
  Json json;
  json["title"] = input.title;
  json["status"] = to_string(plan.status);
  json["xi"] = io::to_json(plan.xi);
  json["xi1"] = io::to_json(plan.xi_critical);
  json["epsilon"] = io::to_json(plan.epsilon_m);
  json["B1"] = io::to_json(plan.wave_centre.x());
  json["B2"] = io::to_json(plan.wave_centre.y());
  json["D"] = io::matrix_to_json(plan.information);
  json["gamma_T"] = io::matrix_to_json(plan.final_covariance_m2);
  json["J"] = io::to_json(plan.cost);
  json["J_gamma"] = io::to_json(plan.cost_information);
  json["J_control"] = io::to_json(plan.cost_control);
  json["lower_bound"] = io::to_json(plan.lower_bound);
  json["relative_gap"] = io::to_json(plan.relative_gap());
  json["max_speed_mps"] = io::to_json(plan.max_speed_mps());
  json["sigma_x_m"] = io::to_json(std::sqrt(plan.final_covariance_m2(0, 0)));
  json["beta_per_s"] = io::to_json(limited.beta_per_s);
  json["wave_amplitude"] = io::to_json(plan.wave_amplitude);
  json["information_gain"] = io::to_json(plan.information_gain);
  json["evaluations"] = plan.evaluations;
  json["library_version"] = kVersion;
  return json;
}

std::string plan_summary(const io::ObserverInput& input, const observer::LimitedPlan& limited) {
  const observer::Plan& plan = limited.plan;
  std::string text = input.title.empty() ? "" : input.title + "\n";
  const double before = std::sqrt(input.problem.covariance_m2(0, 0));
  text += row("status", std::string(to_string(plan.status)),
              plan.status == observer::PlanStatus::kOptimal ? "proved by the lower bound"
                                                            : "best of several starts; see the lower bound");
  text += row("sigma of x at the end", rounded(std::sqrt(plan.final_covariance_m2(0, 0))) + " m",
              "from " + rounded(before) + " m at the start");
  text += row(
      "cost J", rounded(plan.cost) + " m^2/s",
      rounded(plan.cost_information) + " for the variances, " + rounded(plan.cost_control) + " for control");
  text += row("no path costs less than", rounded(plan.lower_bound) + " m^2/s");
  text += row("largest lateral speed", rounded(plan.max_speed_mps()) + " m/s");
  text += row("weights beta", vector_text(limited.beta_per_s) + " 1/s");
  text += row("frequency xi, epsilon", rounded(plan.xi) + ", " + rounded(plan.epsilon_m) + " m",
              "xi_1 = " + rounded(plan.xi_critical));
  text += row("centre B", vector_text(plan.wave_centre));
  return text;
}

std::string plan_csv(const io::ObserverInput& input, const observer::Plan& plan) {
  constexpr double kLargestTable = 100000.0;
  std::vector<std::vector<double>> rows;
  const double end = input.problem.time_to_go_s;
  const double step = std::max(std::min(input.problem.measurement_interval_s, end), end / kLargestTable);
  const auto last = static_cast<int>(std::floor(end / step * (1.0 + 1e-12)));
  const auto add = [&](double t) {
    const Eigen::Vector3d position = plan.position(t);
    const Eigen::Vector2d control = plan.control(t);
    rows.push_back({t, position.x(), position.y(), position.z(), control.x(), control.y()});
  };
  for (int i = 0; i <= last; ++i) {
    add(std::min(i * step, end));
  }
  if (rows.back().front() < end) {
    add(end);
  }
  return io::format_csv({"t_s", "x_m", "y_m", "z_m", "u1_mps", "u2_mps"}, rows);
}

Json simulation_json(const SimulationReport& report) {
  const observer::MonteCarloResult& result = report.result;
  Json json;
  json["title"] = report.input.title;
  json["runs"] = report.settings.runs;
  json["seed"] = report.settings.seed;
  json["mean_error_m"] = io::to_json(result.error.mean);
  json["sd_error_m"] = io::to_json(result.error.deviation);
  json["rms_predicted_m"] = io::to_json(result.rms_predicted_m);
  json["miss_mean_m"] = io::to_json(result.miss.mean);
  json["miss_sd_m"] = io::to_json(result.miss.deviation);
  json["effort_mean_m"] = io::to_json(result.effort.mean);
  json["effort_sd_m"] = io::to_json(result.effort.deviation);
  json["median_nees"] = io::to_json(result.median_nees);
  json["runs_moved_back"] = result.runs_moved_back;
  json["measurements_skipped"] = result.skipped;
  json["measurements_per_run"] = report.loop.measurements();
  json["spread"] = spread_json(result);
  const auto quantiles = [](const std::vector<double>& values) {
    Json json_values;
    for (const int percent : {5, 25, 50, 75, 95}) {
      json_values[std::to_string(percent)] = io::to_json(observer::quantile(values, percent / 100.0));
    }
    return json_values;
  };
  json["quantiles"] = {{"error_m", quantiles(result.error_x_m)},
                       {"miss_m", quantiles(result.miss_m)},
                       {"effort_m", quantiles(result.effort_m)}};
  json["library_version"] = kVersion;
  return json;
}

std::string simulation_summary(const SimulationReport& report) {
  const observer::MonteCarloResult& result = report.result;
  std::string text = report.input.title.empty() ? "" : report.input.title + "\n";
  text +=
      row("flights", std::to_string(report.settings.runs), "seed " + std::to_string(report.settings.seed));
  text += row("filter", filter_name(report.loop.settings()));
  text += row("error of x at the end",
              rounded(result.error.mean) + " m mean, " + rounded(result.error.deviation) + " m sd",
              "the filter states " + rounded(result.rms_predicted_m) + " m");
  text += row("miss", rounded(result.miss.mean) + " m mean, " + rounded(result.miss.deviation) + " m sd");
  text +=
      row("effort", rounded(result.effort.mean) + " m mean, " + rounded(result.effort.deviation) + " m sd",
          "total lateral travel");
  text += row("median normalised error^2", rounded(result.median_nees), "2.37 when the filter is consistent");
  text += row("estimates moved back", std::to_string(result.runs_moved_back) + " runs",
              "their estimate lay where no plan exists");
  text += row("measurements skipped", std::to_string(result.skipped),
              "predicted too close to the beacon's plane");
  return text;
}

std::string runs_csv(const observer::MonteCarloResult& result) {
  std::vector<std::vector<double>> rows;
  for (std::size_t i = 0; i < result.error_x_m.size(); ++i) {
    rows.push_back(
        {static_cast<double>(i), result.error_x_m[i], result.miss_m[i], result.effort_m[i], result.nees[i]});
  }
  return io::format_csv({"run", "error_x_m", "miss_m", "effort_m", "nees"}, rows);
}

std::string simulation_html(const SimulationReport& report) {
  const observer::MonteCarloResult& result = report.result;
  const observer::FlightSettings& settings = report.loop.settings();
  Json data;
  data["title"] = report.input.title;
  data["runs"] = report.settings.runs;
  data["seed"] = report.settings.seed;
  data["numbers"] = {{"mean_error", io::to_json(result.error.mean)},
                     {"sd_error", io::to_json(result.error.deviation)},
                     {"rms_predicted", io::to_json(result.rms_predicted_m)},
                     {"miss_mean", io::to_json(result.miss.mean)},
                     {"miss_sd", io::to_json(result.miss.deviation)},
                     {"effort_mean", io::to_json(result.effort.mean)},
                     {"effort_sd", io::to_json(result.effort.deviation)},
                     {"median_nees", io::to_json(result.median_nees)}};
  data["meaning"] = "The vehicle plans from its own estimate every " + rounded(settings.replan_interval_s) +
                    " s, flies the plan, measures the beacon's bearing every " +
                    rounded(report.input.problem.measurement_interval_s) + " s and filters. Starting with " +
                    rounded(std::sqrt(report.input.problem.covariance_m2(0, 0))) +
                    " m of standard deviation in x, it ends with " + rounded(result.error.deviation) + " m.";
  data["facts"] = Json::array({{"filter", filter_name(settings)},
                               {"weights beta", vector_text(report.input.problem.beta_per_s) + " 1/s"},
                               {"measurements per flight", std::to_string(report.loop.measurements())},
                               {"estimates moved back", std::to_string(result.runs_moved_back) + " runs"},
                               {"measurements skipped near the beacon", std::to_string(result.skipped)},
                               {"library", std::string(kVersion)}});
  data["paths"] = sample_paths(result);
  data["spread"] = spread_json(result);
  data["histograms"] = histograms(result);
  return render_page(assets::kObserverHtml, data, assets::kObserverScript);
}

Json comparison_json(const io::CompareInput& input, const observer::Comparison& comparison) {
  const auto rms = [](double value) { return std::isinf(value) ? Json("infinity") : io::to_json(value); };
  Json json;
  json["title"] = input.title;
  json["best"] = comparison.ranking.front().name;
  json["decided"] = comparison.decided;
  json["ranking"] = Json::array();
  for (const observer::CandidateResult& candidate : comparison.ranking) {
    json["ranking"].push_back({{"name", candidate.name},
                               {"status", describe(candidate.status).name},
                               {"guaranteed_rms_m", rms(candidate.guaranteed_rms_m)},
                               {"lower_bound_rms_m", rms(candidate.lower_bound_rms_m)}});
  }
  json["library_version"] = kVersion;
  json["inputs"] = Json::array();
  for (const io::InputFile& file : input.base.inputs) {
    json["inputs"].push_back({{"name", file.name}, {"sha256", file.sha256}});
  }
  return json;
}

std::string comparison_summary(const observer::Comparison& comparison) {
  std::string text = row("candidate", "guaranteed rms error");
  for (const observer::CandidateResult& candidate : comparison.ranking) {
    text += row(
        candidate.name,
        std::isfinite(candidate.guaranteed_rms_m) ? rounded(candidate.guaranteed_rms_m) + " m" : "unbounded",
        "status " + std::string(describe(candidate.status).name) + ", no estimator guarantees less than " +
            rounded(candidate.lower_bound_rms_m) + " m");
  }
  text += comparison.decided
              ? "\"" + comparison.ranking.front().name + "\" is proved to be the best of these.\n"
              : "The first candidates are too close together for a proof.\n";
  return text;
}

}  // namespace trammel::report
