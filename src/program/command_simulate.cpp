// SPDX-License-Identifier: Apache-2.0
// trammel simulate: measurements drawn along a given true path.
#include <cstdint>
#include <iostream>
#include <memory>
#include <string>

#include <CLI/App.hpp>

#include "../io/file.hpp"
#include "../io/measurement_csv.hpp"
#include "../io/scenario_reader.hpp"
#include "commands.hpp"
#include "trammel/estimate/simulate_measurements.hpp"
#include "trammel/trajectory/nominal_trajectory.hpp"

namespace trammel::program {

namespace {

struct SimulateOptions {
  std::string scenario;
  std::string truth;
  std::string output;  ///< empty: standard output
  std::uint64_t seed = 0;
};

int run(const SimulateOptions& options) {
  const Scenario scenario = io::read_scenario(options.scenario, io::Observations::kIgnore).scenario;
  const io::PathSamples truth =
      io::read_path(options.truth, scenario.knots_s.front(), scenario.knots_s.back());
  const auto path = trajectory::NominalTrajectory::through(truth.times_s, truth.positions_m);
  const std::string text = io::format_measurements(
      estimate::simulate_measurements(scenario, path, options.seed), scenario.stations);
  if (options.output.empty()) {
    std::cout << text << std::flush;
  } else {
    io::write_atomically(options.output, text);
  }
  return kSolved;
}

}  // namespace

void add_simulate(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "simulate", "draw measurements at the planned times along a true path, with the stations' covariances");
  const auto options = std::make_shared<SimulateOptions>();
  command->add_option("scenario", options->scenario, "scenario file (.toml or .json)")->required();
  command->add_option("truth", options->truth, "true path (t_s,x_m,y_m,z_m)")->required();
  command->add_option("--seed", options->seed, "the same seed gives the same measurements everywhere")
      ->capture_default_str();
  command->add_option("--out", options->output, "file to write instead of the standard output");
  command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace trammel::program
