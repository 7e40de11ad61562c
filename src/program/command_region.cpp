// SPDX-License-Identifier: Apache-2.0
// trammel region: confidence regions of a plant's coefficients from a probed record; region simulate: such
// records, and how often regions contain the truth.
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include <CLI/App.hpp>

#include "../io/file.hpp"
#include "../io/json_output.hpp"
#include "../io/region_spec.hpp"
#include "commands.hpp"
#include "in_file.hpp"
#include "region_result.hpp"
#include "terminal_progress.hpp"
#include "trammel/core/error.hpp"
#include "trammel/region/coverage.hpp"
#include "trammel/region/lscr.hpp"
#include "trammel/region/sps.hpp"

namespace trammel::program {

namespace {

struct RegionOptions {
  std::string spec;
  std::string data;
  std::string output;
  std::string picture;
  bool json = false;
};

struct RegionSimulateOptions {
  std::string spec;
  std::string output;
  std::uint64_t seed = 1;
  std::uint64_t run = 0;
  int runs = 0;  ///< 0: write one record
  int threads = 1;
  bool json = false;
};

io::Json file_json(const std::string& file) {
  return {{"name", std::filesystem::path(file).filename().string()},
          {"sha256", io::sha256(io::read_text(file))}};
}

/// More distinct strings than probes have subsets cannot be drawn.
void require_enough_probes(const std::string& file, const io::RegionSpec& spec, Eigen::Index probes) {
  constexpr Eigen::Index kMostBits = 30;
  const bool distinct =
      spec.method == io::RegionMethod::kFullResidual || spec.method == io::RegionMethod::kPaper;
  require(
      !distinct || probes > kMostBits || spec.members <= (1 << probes), file + ": method.M",
      std::to_string(spec.members),
      "at most 2^" + std::to_string(probes) + ", as the record has " + std::to_string(probes) + " probes");
}

int run_region(const RegionOptions& options) {
  require(!options.spec.empty() && !options.data.empty(), "trammel region", "no file",
          "a region file and a data file (or the sub-command simulate)");
  const io::RegionSpec spec = io::read_region_spec(options.spec);
  const region::ProbedRecord record = io::read_probed_record(options.data, spec);
  require_enough_probes(options.spec, spec, record.probe.size());
  io::Json result = in_file(options.spec, [&] { return region_result(spec, record); });
  result["inputs"] = io::Json::array({file_json(options.spec), file_json(options.data)});
  result["library_version"] = kVersion;
  if (!options.picture.empty()) {
    io::write_atomically(options.picture, region_picture(spec, record));
  }
  if (!options.output.empty()) {
    io::write_atomically(options.output, io::dump(result));
  }
  std::cout << (options.json ? io::dump(result) : region_text(result)) << std::flush;
  return result["status"] == "unbounded" ? kUnbounded : kSolved;
}

int run_coverage(const io::RegionSpec& spec, const RegionSimulateOptions& options) {
  region::CoverageSettings settings;
  settings.runs = options.runs;
  settings.seed = options.seed;
  settings.threads = options.threads;
  settings.members = spec.members;
  const bool lscr = spec.method == io::RegionMethod::kFullResidual || spec.method == io::RegionMethod::kPaper;
  if (lscr) {
    settings.excluded = spec.excluded;
  } else {
    settings.excluded = std::max(1, region::excluded_for_level(spec.level, spec.members, spec.period));
  }
  const double level = 1.0 - 2.0 * spec.period * settings.excluded / settings.members;
  settings.sps_members = spec.members;
  settings.sps_excluded = spec.method == io::RegionMethod::kSps
                              ? spec.excluded
                              : std::max(1, region::excluded_for_joint_level(level, spec.members));
  settings.delta = (1.0 - level) / spec.period;
  TerminalProgress progress;
  const region::CoverageCounts counts = in_file(
      options.spec, [&] { return region::study_coverage(spec.experiment(), settings, progress.observer()); });
  io::Json result;
  result["runs"] = counts.runs;
  result["M"] = settings.members;
  result["q"] = settings.excluded;
  result["sps_q"] = settings.sps_excluded;
  result["lscr_channel_level"] = 1.0 - 2.0 * settings.excluded / settings.members;
  result["lscr_joint_level"] = level;
  result["sps_level"] = 1.0 - static_cast<double>(settings.sps_excluded) / settings.sps_members;
  result["coverage"] = io::Json::object();
  for (int row = 0; row < region::kCoverageRows; ++row) {
    if (spec.period < 2 && (row == static_cast<int>(region::CoverageRow::kPredictionSecond) ||
                            row == static_cast<int>(region::CoverageRow::kPlantSecond))) {
      continue;
    }
    result["coverage"][std::string(region::kCoverageNames[row])] =
        counts.share(static_cast<region::CoverageRow>(row));
  }
  result["seed"] = options.seed;
  result["library_version"] = kVersion;
  if (options.json) {
    std::cout << io::dump(result) << std::flush;
    return kSolved;
  }
  std::cout << counts.runs << " runs; levels: LSCR channel " << result["lscr_channel_level"]
            << ", LSCR joint at least " << level << ", SPS " << result["sps_level"] << "\n";
  for (const auto& [name, share] : result["coverage"].items()) {
    std::cout << name << std::string(28 - name.size(), ' ') << share << "\n";
  }
  return kSolved;
}

int run_simulate(const RegionSimulateOptions& options) {
  const io::RegionSpec spec = io::read_region_spec(options.spec);
  require(options.runs >= 0, "--runs", std::to_string(options.runs), "at least 0");
  require(options.threads >= 1, "--threads", std::to_string(options.threads), "at least 1");
  if (options.runs > 0) {
    return run_coverage(spec, options);
  }
  region::ProbedRecord record;
  in_file(options.spec, [&] {
    region::LoopSimulator simulator(spec.experiment());
    simulator.simulate(options.seed, options.run, record);
  });
  const std::string text = io::format_probed_record(record);
  if (options.output.empty()) {
    std::cout << text << std::flush;
  } else {
    io::write_atomically(options.output, text);
  }
  return kSolved;
}

}  // namespace

void add_region(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "region", "confidence regions of a plant's coefficients under arbitrary noise, from a probed record");
  command->footer(io::region_spec_help());
  const auto options = std::make_shared<RegionOptions>();
  command->add_option("spec", options->spec, "region file (.toml or .json), see below");
  command->add_option("data", options->data, "data file (.csv), see below");
  command->add_flag("--json", options->json, "print the result as JSON");
  command->add_option("--out", options->output, "also write the JSON result to this file");
  command->add_option("--picture", options->picture,
                      "write a page (.html) with the regions of published form, full residuals and full "
                      "residuals without mean; two unknown coefficients only");
  command->require_subcommand(0, 1);

  CLI::App* simulate = command->add_subcommand(
      "simulate",
      "a record of the loop described by [plant], [truth] and [simulation], or, with --runs, how "
      "often the regions contain the truth");
  const auto simulate_options = std::make_shared<RegionSimulateOptions>();
  simulate->add_option("spec", simulate_options->spec, "region file (.toml or .json)")->required();
  simulate->add_option("--out", simulate_options->output, "file to write instead of the standard output");
  simulate->add_option("--seed", simulate_options->seed, "seed of probes and noise")->capture_default_str();
  simulate->add_option("--run", simulate_options->run, "number of the run; each is independent")
      ->capture_default_str();
  simulate->add_option("--runs", simulate_options->runs, "study the coverage in this many runs instead");
  simulate->add_option("--threads", simulate_options->threads, "for --runs; does not change the result")
      ->capture_default_str();
  simulate->add_flag("--json", simulate_options->json, "print the study as JSON");
  simulate->callback([simulate_options, &action] {
    action = [simulate_options] { return run_simulate(*simulate_options); };
  });
  command->callback([options, command, &action] {
    if (command->get_subcommands().empty()) {
      action = [options] { return run_region(*options); };
    }
  });
}

}  // namespace trammel::program
