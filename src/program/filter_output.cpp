// SPDX-License-Identifier: Apache-2.0
#include "filter_output.hpp"

#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "../io/csv.hpp"
#include "trammel/filter/batch_bound.hpp"
#include "trammel/filter/worst_case.hpp"

namespace trammel::program {

namespace {

using filter::FilterOutput;
using filter::WorstCaseBias;
using io::Json;
using io::to_json;

Json polynomials_json(const std::vector<filter::Polynomial>& list) {
  Json array = Json::array();
  for (const filter::Polynomial& p : list) {
    array.push_back(to_json(p));
  }
  return array;
}

Json bias_json(const WorstCaseBias& bias) {
  return {{"constant", to_json(bias.constant)},
          {"piecewise_constant", to_json(bias.piecewise_constant)},
          {"arbitrary", to_json(bias.arbitrary)}};
}

std::vector<FilterOutput> outputs(const FilterReport& report) {
  std::vector<FilterOutput> list;
  for (int row = 0; row < report.file.specification.rows; ++row) {
    list.push_back({row, false});
  }
  list.push_back({0, true});
  return list;
}

std::string output_name(FilterOutput output) {
  return output.predicted ? "prediction" : "row " + std::to_string(output.row);
}

double noise_of(const FilterReport& report, FilterOutput output) {
  return output.predicted ? report.analysis.prediction_noise_gain
                          : report.analysis.covariance(output.row, output.row);
}

/// Worst-case bias per unit bound, and with a bound the guaranteed errors and the batch estimate's.
Json guarantee_json(const FilterReport& report) {
  const auto& specification = report.file.specification;
  Json list = Json::array();
  for (const FilterOutput output : outputs(report)) {
    const WorstCaseBias bias = filter::worst_case_bias(report.design, output);
    Json entry = {{"output", output_name(output)}, {"bias_per_unit_bound", bias_json(bias)}};
    if (report.file.bound) {
      const double omega = report.file.bound->derivative_bound;
      const double variance = std::pow(report.file.bound->measurement_std, 2);
      const double mse = std::pow(omega * bias.arbitrary, 2) + variance * noise_of(report, output);
      entry["guaranteed_mse"] = to_json(mse);
      if (report.file.batch_samples) {
        const double index = omega * std::pow(specification.sampling_s, specification.order) /
                             report.file.bound->measurement_std;
        const auto solution = filter::batch_bound({.order = specification.order,
                                                   .samples = *report.file.batch_samples,
                                                   .index = index,
                                                   .output = output});
        const double unit = variance * std::pow(specification.sampling_s, -2.0 * output.row);
        entry["batch"] = {{"samples", *report.file.batch_samples},
                          {"status", std::string(describe(solution.status).name)},
                          {"lower_mse", to_json(solution.lower * unit)},
                          {"upper_mse", to_json(solution.upper * unit)},
                          {"ratio", to_json(mse / (solution.lower * unit))}};
      }
    }
    list.push_back(std::move(entry));
  }
  return list;
}

std::string join(const Json& values) {
  std::string text;
  for (const Json& value : values) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.9g", value.is_number() ? value.get<double>() : std::nan(""));
    text += (text.empty() ? "" : "  ") + (value.is_number() ? std::string(buffer) : std::string("-"));
  }
  return text;
}

std::string number_text(const Json& value) { return join(Json::array({value})); }

}  // namespace

FilterReport make_filter_report(io::FilterFile file) {
  FilterReport report;
  report.design = filter::synthesise(file.specification);
  report.analysis = filter::analyse(report.design);
  report.file = std::move(file);
  return report;
}

Json filter_report_json(const FilterReport& report) {
  const auto& specification = report.file.specification;
  const auto& analysis = report.analysis;
  Json poles = Json::array();
  for (const auto& pole : analysis.poles) {
    poles.push_back(Json::array({pole.real(), pole.imag()}));
  }
  const Eigen::VectorXd gains = filter::constant_gains(specification);
  Json correction = Json::array();
  for (Eigen::Index i = 0; i < gains.size(); ++i) {
    const int row = static_cast<int>(i);
    correction.push_back(gains[i] / (filter::factorial(row) * std::pow(specification.sampling_s, row)));
  }
  Json json = {
      {"order", specification.order},
      {"rows", specification.rows},
      {"sampling_s", specification.sampling_s},
      {"mode", std::string(to_string(specification.mode))},
      {"rule", report.file.rule.empty() ? Json(nullptr) : Json(report.file.rule)},
      {"gains", gains.size() > 0 ? to_json(gains) : Json(nullptr)},
      {"correction_gains", gains.size() > 0 ? correction : Json(nullptr)},
      {"denominator", to_json(report.design.denominator)},
      {"numerators", polynomials_json(report.design.numerators)},
      {"prediction_numerator", to_json(report.design.prediction_numerator)},
      {"poles", poles},
      {"stable", analysis.stable},
      {"astatism", analysis.astatism},
      {"prediction_astatism", analysis.prediction_astatism},
      {"noise_gain", to_json(analysis.covariance.diagonal())},
      {"noise_covariance", io::matrix_to_json(analysis.covariance)},
      {"prediction_noise_gain", to_json(analysis.prediction_noise_gain)},
      {"innovation_variance", to_json(analysis.innovation_variance)},
      {"error_coefficients", io::matrix_to_json(analysis.error_coefficients)},
      {"prediction_error_coefficients", to_json(analysis.prediction_error_coefficients)},
      {"guaranteed_mse", to_json(report.file.guaranteed_mse.value_or(std::nan("")))},
      {"guarantee", analysis.stable ? guarantee_json(report) : Json(nullptr)},
      {"library_version", kVersion},
  };
  return json;
}

std::string filter_report_text(const FilterReport& report) {
  const Json json = filter_report_json(report);
  const bool stable = json["stable"].get<bool>();
  std::string text = "Invariant filter of order " + std::to_string(report.file.specification.order) + ", " +
                     std::to_string(report.file.specification.rows) + " row(s), sampling " +
                     shortest(report.file.specification.sampling_s) + " s, mode " +
                     json["mode"].get<std::string>() + "\n";
  const auto line = [&](const std::string& name, const std::string& value) {
    text += "  " + name + std::string(name.size() < 26 ? 26 - name.size() : 1, ' ') + value + "\n";
  };
  if (json["rule"].is_string()) {
    line("rule", json["rule"].get<std::string>());
  }
  if (json["gains"].is_array()) {
    line("gains", join(json["gains"]));
    line("correction gains, s^-row", join(json["correction_gains"]));
  }
  line("stable", stable ? "yes" : "NO: do not use this filter");
  std::string poles;
  for (const Json& pole : json["poles"]) {
    const double imaginary = pole[1].get<double>();
    poles += (poles.empty() ? "" : "  ") + number_text(pole[0]);
    if (imaginary != 0.0) {
      poles += (imaginary > 0.0 ? "+" : "") + number_text(pole[1]) + "i";
    }
  }
  line("poles", poles);
  line("denominator (z^-1)", join(json["denominator"]));
  line("prediction numerator", join(json["prediction_numerator"]));
  for (std::size_t i = 0; i < json["numerators"].size(); ++i) {
    line("numerator, row " + std::to_string(i), join(json["numerators"][i]));
  }
  if (!stable) {
    return text + "  Errors and noise of an unstable filter have no steady state and are not given.\n";
  }
  line("astatism per row",
       join(json["astatism"]) + "   prediction " + std::to_string(json["prediction_astatism"].get<int>()));
  line("noise gain per row",
       join(json["noise_gain"]) + "   prediction " + number_text(json["prediction_noise_gain"]));
  text += "  Steady error = sum of coefficient times derivative of the coordinate, p = 0, 1, ..:\n";
  for (std::size_t i = 0; i < json["error_coefficients"].size(); ++i) {
    line("  row " + std::to_string(i), join(json["error_coefficients"][i]));
  }
  line("  prediction", join(json["prediction_error_coefficients"]));
  text += "  Largest bias per unit bound on derivative " + std::to_string(report.file.specification.order) +
          " (constant, piecewise constant, arbitrary):\n";
  for (const Json& entry : json["guarantee"]) {
    const Json& bias = entry["bias_per_unit_bound"];
    line("  " + entry["output"].get<std::string>(),
         join(Json::array({bias["constant"], bias["piecewise_constant"], bias["arbitrary"]})));
    if (entry.contains("guaranteed_mse") && entry["guaranteed_mse"].is_number()) {
      line("    guaranteed rms error", number_text(std::sqrt(entry["guaranteed_mse"].get<double>())));
    }
    if (entry.contains("batch") && entry["batch"]["lower_mse"].is_number()) {
      line("    no filter of " + std::to_string(entry["batch"]["samples"].get<int>()) + " samples below",
           number_text(std::sqrt(entry["batch"]["lower_mse"].get<double>())) + "   (mean-square ratio " +
               number_text(entry["batch"]["ratio"]) + ")");
    }
  }
  return text;
}

}  // namespace trammel::program
