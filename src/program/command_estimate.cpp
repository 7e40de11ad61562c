// SPDX-License-Identifier: Apache-2.0
// trammel estimate, trammel design: the guaranteed problem of a scenario.
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include <CLI/App.hpp>

#include "../io/file.hpp"
#include "../io/scenario_reader.hpp"
#include "../report/result_files.hpp"
#include "commands.hpp"
#include "flight_of.hpp"
#include "phase_profile.hpp"
#include "terminal_progress.hpp"
#include "trammel/estimate/trajectory_estimate.hpp"
#include "trammel/localise/outliers.hpp"

namespace trammel::program {

namespace {

struct EstimateOptions {
  std::string scenario;
  std::string folder;  ///< empty: no files
  std::string truth;   ///< empty: not given
  bool json = false;
  bool design_only = false;
  bool bounds_only = false;  ///< no search for the worst motion, no bound over all estimators
  bool monte_carlo = false;
  bool profile = false;
};

ExitCode exit_code(const report::ReportInput& result) {
  return result.estimate.solution.status == SolveStatus::kUnbounded ? kUnbounded
         : report::outcome(result).solved                           ? kSolved
                                                                    : kNotConverged;
}

int run(const EstimateOptions& options) {
  PhaseProfile profile;
  profile.enter("reading the scenario");
  io::ScenarioInput input = io::read_scenario(
      options.scenario, options.design_only ? io::Observations::kIfUnplanned : io::Observations::kRead);
  std::optional<io::PathSamples> truth;
  if (!options.truth.empty()) {
    truth = io::read_path(options.truth, input.scenario.knots_s.front(), input.scenario.knots_s.back());
    input.inputs.push_back(
        {std::filesystem::path(options.truth).filename().string(), io::sha256(io::read_text(options.truth))});
  }
  require(!(input.windows && options.monte_carlo), "--monte-carlo", "it with solver.method \"windows\"",
          "method \"structured\": windows give no bound over all estimators");
  if (!options.folder.empty()) {
    io::create_folder(options.folder);  // before the work, so that a wrong folder does not waste it
  }
  if (options.bounds_only) {
    input.settings.estimate.near_optimality.reset();
  } else {
    input.settings.estimate.near_optimality->monte_carlo = options.monte_carlo;
  }
  std::optional<localise::OutlierSearch> outliers;
  profile.enter("looking for outliers");
  if (input.reject_outliers && !options.design_only && !input.scenario.observations.empty()) {
    outliers = localise::find_outliers(input.scenario, {.minimum_height_m = input.settings.minimum_height_m,
                                                        .model_error = input.settings.model_error,
                                                        .fit = input.settings.fit});
    input.scenario = localise::without(std::move(input.scenario), *outliers);
    require(!input.scenario.observations.empty(), "observations", "none that the bounds allow",
            "measurements of a motion within the bounds (reject_outliers = false keeps them all)");
  }
  localise::FlightEstimate flight;
  {
    TerminalProgress progress;
    const ProgressObserver observe = profile.observer(progress.observer());
    profile.enter("preparing");
    if (options.design_only && !input.windows) {
      flight.estimate = estimate::estimate_trajectory(input.scenario, input.settings.estimate, observe);
    } else {
      input.settings.relinearise = input.settings.relinearise && !options.design_only;
      flight = flight_of(input, observe);
    }
  }
  if (options.design_only) {
    flight.estimate.observed.reset();
  }
  profile.enter("writing the result");
  const estimate::TrajectoryEstimate& estimate = flight.estimate;
  std::optional<report::TruthComparison> comparison;
  if (truth) {
    comparison = report::compare_with_truth(input.scenario, estimate, *truth);
  }
  const report::ReportInput result{input, estimate, comparison ? &*comparison : nullptr,
                                   flight.statement ? &*flight.statement : nullptr,
                                   outliers ? &*outliers : nullptr};
  const std::string json = io::dump(report::result_json(result));
  const std::filesystem::path folder(options.folder);
  if (!options.folder.empty()) {
    io::write_atomically(folder / "result.json", json);
    io::write_atomically(folder / "trajectory.csv", report::trajectory_csv(estimate));
    if (estimate.worst_case_theta.size() > 0) {
      io::write_atomically(folder / report::kWorstCaseFile, report::worst_case_csv(estimate));
    }
    if (flight.statement) {
      for (std::size_t k = 0; k < flight.statement->competing.size(); ++k) {
        io::write_atomically(folder / report::competing_file(k),
                             report::competing_csv(flight.statement->competing[k]));
      }
    }
    io::write_atomically(folder / "report.html", report::report_html(result));
  }
  if (options.json) {
    std::cout << json;
  } else {
    std::cout << report::summary(result);
    if (!options.folder.empty()) {
      std::cout << "written                 " << (folder / "result.json").string() << ", trajectory.csv, "
                << (estimate.worst_case_theta.size() > 0 ? report::kWorstCaseFile + std::string(", ") : "")
                << "report.html\n";
    }
  }
  std::cout.flush();
  if (options.profile) {
    std::cerr << profile.table();
  }
  return exit_code(result);
}

void add(CLI::App& app, Action& action, bool design_only) {
  CLI::App* command =
      design_only
          ? app.add_subcommand("design", "certified error of a planned measurement, without measured values")
          : app.add_subcommand("estimate", "guaranteed trajectory estimate of a scenario");
  const auto options = std::make_shared<EstimateOptions>();
  options->design_only = design_only;
  command->add_option("scenario", options->scenario, "scenario file (.toml or .json)")->required();
  command->add_option("--out", options->folder,
                      "folder to write result.json, trajectory.csv, worst_case.csv and report.html to");
  command->add_option("--truth", options->truth, "true path (t_s,x_m,y_m,z_m) to compare with in the report");
  command->add_flag("--json", options->json, "print result.json to the standard output");
  command->add_flag("--profile", options->profile, "print to standard error where the time went, by phase");
  CLI::Option* const bounds_only = command->add_flag(
      "--bounds-only", options->bounds_only,
      "neither the worst admissible motion nor the bound over all estimators (saves some seconds)");
  command
      ->add_flag("--monte-carlo", options->monte_carlo,
                 "sharpen the bound over all estimators by Monte Carlo (99.9 % confidence; up to a minute)")
      ->excludes(bounds_only);
  command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace

void add_estimate(CLI::App& app, Action& action) { add(app, action, false); }

void add_design(CLI::App& app, Action& action) { add(app, action, true); }

}  // namespace trammel::program
