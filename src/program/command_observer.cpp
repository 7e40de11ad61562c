// SPDX-License-Identifier: Apache-2.0
// trammel observer plan | simulate | compare: paths of a bearings-only observer.
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include <CLI/App.hpp>

#include "../io/file.hpp"
#include "../io/observer_reader.hpp"
#include "../report/observer_files.hpp"
#include "commands.hpp"
#include "in_file.hpp"
#include "terminal_progress.hpp"
#include "trammel/core/error.hpp"
#include "trammel/observer/compare.hpp"
#include "trammel/observer/monte_carlo.hpp"
#include "trammel/observer/plan_limits.hpp"

namespace trammel::program {

namespace {

struct ObserverOptions {
  std::string file;
  std::string folder;  ///< empty: no files
  bool json = false;
  std::int64_t runs = observer::MonteCarloSettings{}.runs;
  std::uint64_t seed = observer::MonteCarloSettings{}.seed;
  unsigned threads = 0;
};

observer::LimitedPlan planned(const io::ObserverInput& input) {
  if (input.target_sigma_x_m) {
    return observer::plan_for_accuracy(input.problem, *input.target_sigma_x_m);
  }
  if (input.energy_budget_m2ps) {
    return observer::plan_for_energy(input.problem, *input.energy_budget_m2ps);
  }
  return observer::plan_with_speed_limit(input.problem, input.flight.max_lateral_speed_mps);
}

/// Prints the JSON or the summary.
void print(const ObserverOptions& options, const io::Json& json, const std::string& summary) {
  std::cout << (options.json ? io::dump(json) : summary) << std::flush;
}

int run_plan(const ObserverOptions& options) {
  const io::ObserverInput input = io::read_observer(options.file, io::ObserverUse::kPlan);
  const observer::LimitedPlan plan = in_file(options.file, [&] { return planned(input); });
  const io::Json json = report::plan_json(input, plan);
  if (!options.folder.empty()) {
    const std::filesystem::path folder(options.folder);
    io::create_folder(folder);
    io::write_atomically(folder / "plan.json", io::dump(json));
    io::write_atomically(folder / "path.csv", report::plan_csv(input, plan.plan));
  }
  print(options, json, report::plan_summary(input, plan));
  return kSolved;
}

int run_simulate(const ObserverOptions& options) {
  const io::ObserverInput input = io::read_observer(options.file, io::ObserverUse::kSimulate);
  if (!options.folder.empty()) {
    io::create_folder(options.folder);  // before the work, so that a wrong folder does not waste it
  }
  const observer::FlightLoop loop(input.problem, input.flight);
  require(options.runs >= 1, "--runs", std::to_string(options.runs), "at least 1");
  observer::MonteCarloSettings settings;
  settings.runs = options.runs;
  settings.seed = options.seed;
  settings.threads = options.threads;
  settings.max_start_x_m = input.max_start_x_m;
  observer::MonteCarloResult result;
  {
    TerminalProgress progress;
    result = in_file(options.file, [&] { return observer::simulate(loop, settings, progress.observer()); });
  }
  const report::SimulationReport simulation{input, loop, settings, result};
  const io::Json json = report::simulation_json(simulation);
  if (!options.folder.empty()) {
    const std::filesystem::path folder(options.folder);
    io::write_atomically(folder / "simulation.json", io::dump(json));
    io::write_atomically(folder / "runs.csv", report::runs_csv(result));
    io::write_atomically(folder / "report.html", report::simulation_html(simulation));
  }
  print(options, json, report::simulation_summary(simulation));
  return kSolved;
}

int run_compare(const ObserverOptions& options) {
  const io::CompareInput input = io::read_comparison(options.file);
  observer::Comparison comparison;
  {
    TerminalProgress progress;
    comparison = in_file(options.file, [&] {
      return observer::compare(input.candidates, input.base.settings.estimate, progress.observer());
    });
  }
  const io::Json json = report::comparison_json(input, comparison);
  if (!options.folder.empty()) {
    io::create_folder(options.folder);
    io::write_atomically(std::filesystem::path(options.folder) / "comparison.json", io::dump(json));
  }
  print(options, json, report::comparison_summary(comparison));
  switch (comparison.ranking.front().status) {
    case SolveStatus::kOptimal:
      return kSolved;
    case SolveStatus::kUnbounded:
      return kUnbounded;
    case SolveStatus::kIterationLimit:
    case SolveStatus::kNumericalTrouble:
      break;
  }
  return kNotConverged;
}

CLI::App* add(CLI::App& parent, Action& action, const char* name, const char* description,
              const std::shared_ptr<ObserverOptions>& options, int (*run)(const ObserverOptions&)) {
  CLI::App* command = parent.add_subcommand(name, description);
  command->add_option("spec", options->file, "input file (.toml or .json)")->required();
  command->add_flag("--json", options->json, "print the result as JSON to the standard output");
  command->callback([options, &action, run] { action = [options, run] { return run(*options); }; });
  return command;
}

}  // namespace

void add_observer(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "observer", "paths of a vehicle that finds its own position from bearings of a beacon");
  command->require_subcommand(1);
  const auto options = std::make_shared<ObserverOptions>();
  CLI::App* plan = add(*command, action, "plan", "the optimal path, with a proved lower bound of its cost",
                       options, run_plan);
  plan->add_option("--out", options->folder, "folder to write plan.json and path.csv to");
  CLI::App* simulate =
      add(*command, action, "simulate", "many random flights that plan, measure, filter and plan again",
          options, run_simulate);
  simulate->add_option("--runs", options->runs, "number of flights")->capture_default_str();
  simulate->add_option("--seed", options->seed, "the same seed gives the same flights on any number of cores")
      ->capture_default_str();
  simulate->add_option("--threads", options->threads, "threads to use; 0: all cores")->capture_default_str();
  simulate->add_option("--out", options->folder,
                       "folder to write simulation.json, runs.csv and report.html to");
  CLI::App* compare =
      add(*command, action, "compare",
          "sites or paths of a station, ranked by the guaranteed error of a scenario", options, run_compare);
  compare->add_option("--out", options->folder, "folder to write comparison.json to");
}

}  // namespace trammel::program
