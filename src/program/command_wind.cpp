// SPDX-License-Identifier: Apache-2.0
// trammel wind simulate: course correction of a light aircraft in a drifting wind.
#include <cmath>
#include <cstdint>
#include <iostream>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "../io/csv.hpp"
#include "../io/file.hpp"
#include "../io/json_output.hpp"
#include "commands.hpp"
#include "terminal_progress.hpp"
#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/region/wind_drift.hpp"

namespace trammel::program {

namespace {

struct WindOptions {
  std::string correction = "all";
  std::string noise = "all";
  std::string variant = "printed";
  std::string wind_unit = "degree";
  int flights = 1000;
  int steps = 0;  ///< 0: 250 as printed, 260 for the dwell variant
  std::uint64_t seed = 1;
  bool json = false;
  std::string path;
};

template <class Kind>
std::vector<Kind> chosen(const std::string& name, const std::vector<Kind>& kinds, const char* option) {
  std::vector<Kind> result;
  std::string names = "all";
  for (const Kind kind : kinds) {
    if (name == "all" || name == region::to_string(kind)) {
      result.push_back(kind);
    }
    names += ", " + std::string(region::to_string(kind));
  }
  require(!result.empty(), option, name, names);
  return result;
}

/// Flies once.
region::WindResult fly(bool dwell, region::WindCorrection kind, const region::WindFlight& flight,
                       const region::WindDraws& draws, std::vector<region::WindStep>* path) {
  if (dwell) {
    region::DwellCorrection correction;
    correction.kind = kind;
    return region::fly_with_dwell(flight, correction, draws, path);
  }
  region::PrintedCorrection correction;
  correction.kind = kind;
  return region::fly_as_printed(flight, correction, draws, path);
}

void write_path(const std::string& file, const std::vector<region::WindStep>& path) {
  std::vector<std::vector<double>> rows;
  rows.reserve(path.size());
  for (const region::WindStep& step : path) {
    rows.push_back({step.time_s, step.x_m, step.y_m, step.course_rad, step.residual, step.estimate});
  }
  io::write_atomically(file,
                       io::format_csv({"t_s", "x_m", "y_m", "course_rad", "residual", "estimate"}, rows));
}

int run(const WindOptions& options) {
  using region::WindCorrection;
  using region::WindNoise;
  require(options.flights >= 1, "--flights", std::to_string(options.flights), "at least 1");
  require(options.steps >= 0, "--steps", std::to_string(options.steps), "at least 1");
  require(options.variant == "printed" || options.variant == "dwell", "--variant", options.variant,
          "printed or dwell");
  require(options.wind_unit == "degree" || options.wind_unit == "radian", "--wind-unit", options.wind_unit,
          "degree or radian");
  const std::vector<WindCorrection> corrections = chosen<WindCorrection>(
      options.correction,
      {WindCorrection::kNone, WindCorrection::kRandomised, WindCorrection::kKalman, WindCorrection::kLms},
      "--correction");
  const std::vector<WindNoise> noises = chosen<WindNoise>(
      options.noise, {WindNoise::kUniform, WindNoise::kSwitching, WindNoise::kConstant}, "--noise");
  require(options.path.empty() || (corrections.size() == 1 && noises.size() == 1), "--path",
          "several flights to write", "one --correction and one --noise");
  const bool dwell = options.variant == "dwell";
  region::WindFlight flight;
  constexpr double kWindStep = 8.0;
  constexpr int kDwellSteps = 260;
  flight.wind_step_rad = options.wind_unit == "degree" ? kWindStep * std::numbers::pi / 180.0 : kWindStep;
  flight.max_steps = options.steps > 0 ? options.steps : (dwell ? kDwellSteps : flight.max_steps);

  TerminalProgress progress;
  const ProgressObserver observer = progress.observer();
  io::Json result;
  result["variant"] = options.variant;
  result["wind_unit"] = options.wind_unit;
  result["flights"] = options.flights;
  result["seed"] = options.seed;
  result["note"] = dwell ? "randomised dwell time: the probe multiplies the wind"
                         : "the randomised correction (14) as printed carries no information about the wind";
  result["results"] = io::Json::array();
  region::WindDraws draws;
  double done = 0.0;
  const double total = static_cast<double>(corrections.size() * noises.size());
  for (const WindNoise noise : noises) {
    for (const WindCorrection correction : corrections) {
      double sum = 0.0;
      double squares = 0.0;
      int arrived = 0;
      for (int k = 0; k < options.flights; ++k) {
        RandomStream random(options.seed, static_cast<std::uint64_t>(k));
        region::draw_wind(random, flight, noise, draws);
        std::vector<region::WindStep> path;
        const bool keep = k == 0 && !options.path.empty();
        const region::WindResult one = fly(dwell, correction, flight, draws, keep ? &path : nullptr);
        if (keep) {
          write_path(options.path, path);
        }
        sum += one.mean_deviation_m;
        squares += one.mean_deviation_m * one.mean_deviation_m;
        arrived += one.arrived ? 1 : 0;
      }
      const double n = options.flights;
      const double mean = sum / n;
      const double variance = n > 1.0 ? std::max(0.0, (squares - n * mean * mean) / (n - 1.0)) : std::nan("");
      result["results"].push_back({{"correction", region::to_string(correction)},
                                   {"noise", region::to_string(noise)},
                                   {"mean_deviation_m", mean},
                                   {"deviation_sd_m", io::to_json(std::sqrt(variance))},
                                   {"arrived", arrived}});
      done += 1.0;
      if (observer) {
        observer({"flights", done / total});
      }
    }
  }
  result["library_version"] = kVersion;
  if (options.json) {
    std::cout << io::dump(result) << std::flush;
    return kSolved;
  }
  std::cout << "mean deviation from the straight line over " << options.flights
            << " flights, m (standard deviation)\n"
            << result["note"].get<std::string>() << "\n";
  for (const io::Json& row : result["results"]) {
    std::cout << row["noise"].get<std::string>() << " noise, " << row["correction"].get<std::string>() << ": "
              << row["mean_deviation_m"] << " (" << row["deviation_sd_m"] << ")\n";
  }
  return kSolved;
}

}  // namespace

void add_wind(CLI::App& app, Action& action) {
  CLI::App* wind = app.add_subcommand("wind", "course correction of a light aircraft in a drifting wind");
  wind->require_subcommand(1);
  CLI::App* command = wind->add_subcommand(
      "simulate",
      "fly to a target under three measurement noises with randomised, Kalman and LMS corrections");
  const auto options = std::make_shared<WindOptions>();
  command->add_option("--correction", options->correction, "none, randomised, kalman, lms or all")
      ->capture_default_str();
  command->add_option("--noise", options->noise, "uniform, switching, constant or all")
      ->capture_default_str();
  command
      ->add_option("--variant", options->variant,
                   "printed: as published, where the randomised correction carries no information about the "
                   "wind; dwell: random dwell time, which does")
      ->capture_default_str();
  command
      ->add_option(
          "--wind-unit", options->wind_unit,
          "unit of the wind's steps of +-8: degree, or radian, with which the published table agrees")
      ->capture_default_str();
  command->add_option("--flights", options->flights, "flights per row")->capture_default_str();
  command->add_option("--steps", options->steps, "longest flight (default 250, 260 with --variant dwell)");
  command->add_option("--seed", options->seed, "flight k uses stream k of this seed")->capture_default_str();
  command->add_option("--path", options->path, "write the first flight to this CSV file");
  command->add_flag("--json", options->json, "print the result as JSON");
  command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace trammel::program
