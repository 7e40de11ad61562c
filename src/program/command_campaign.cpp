// SPDX-License-Identifier: Apache-2.0
// trammel campaign plan | run | merge | report: archives of flights and Monte Carlo studies in shards.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "../io/campaign_files.hpp"
#include "../io/csv.hpp"
#include "../io/file.hpp"
#include "../report/campaign_summary.hpp"
#include "../report/report.hpp"
#include "commands.hpp"
#include "flight_of.hpp"
#include "in_file.hpp"
#include "terminal_progress.hpp"
#include "trammel/campaign/motion_study.hpp"
#include "trammel/core/error.hpp"
#include "trammel/core/parallel.hpp"
#include "trammel/estimate/trajectory_estimate.hpp"

namespace trammel::program {

namespace {

struct CampaignOptions {
  std::string folder;
  std::vector<std::string> scenarios;
  std::size_t runs = 0;  ///< 0: an archive
  std::uint64_t seed = 1;
  std::string motion = "boundary";
  std::size_t parts = 0;  ///< 0: chosen here
  std::string shard;      ///< empty: everything
  int threads = -1;       ///< -1: chosen here
  std::string output;
  bool json = false;
};

/// Parts of a Monte Carlo study: what is lost when a process dies is at most one of them per thread.
constexpr std::size_t kMostStudyParts = 64;

/// The settings of an estimate whose certified values alone are asked for.
estimate::EstimateSettings bounds_only(estimate::EstimateSettings settings) {
  settings.near_optimality.reset();
  return settings;
}

int run_plan(const CampaignOptions& options) {
  io::CampaignManifest manifest;
  const bool monte_carlo = options.runs > 0;
  manifest.kind = monte_carlo ? io::CampaignKind::kMonteCarlo : io::CampaignKind::kArchive;
  manifest.runs = std::max<std::size_t>(options.runs, 1);
  manifest.seed = options.seed;
  manifest.motion = io::motion_of(options.motion);
  const std::filesystem::path folder(options.folder);
  io::create_folder(folder);
  TerminalProgress progress;
  for (const std::string& file : options.scenarios) {
    require(file.find_first_of(",\n\r#") == std::string::npos, file, "a comma, '#' or line break in the name",
            "a name that can stand in a table");
    const io::ScenarioInput input =
        io::read_scenario(file, monte_carlo ? io::Observations::kIfUnplanned : io::Observations::kRead);
    io::CampaignScenario& scenario = manifest.scenarios.emplace_back();
    scenario.file = std::filesystem::proximate(file, folder).generic_string();
    scenario.inputs = input.inputs;
    if (monte_carlo) {
      require(!input.windows, file + ": solver.method", "\"windows\"",
              "method \"structured\" for a Monte Carlo study: it keeps the whole gain");
      const estimate::TrajectoryEstimate estimate = in_file(file, [&] {
        return estimate::estimate_trajectory(input.scenario, bounds_only(input.settings.estimate),
                                             progress.observer());
      });
      if (estimate.solution.status == SolveStatus::kUnbounded) {
        std::cerr << "trammel: " << file << ": no finite error can be guaranteed, nothing to try out\n";
        return kUnbounded;
      }
      scenario.guaranteed_rms_m = estimate.guaranteed_rms_m;
      scenario.estimator_sha256 =
          io::CampaignFolder::write_gain(folder, manifest.scenarios.size() - 1, estimate.solution.gain);
    }
  }
  const std::size_t most = monte_carlo ? kMostStudyParts : manifest.items();
  manifest.parts = std::min(manifest.items(), options.parts > 0 ? options.parts : most);
  (void)io::CampaignFolder::create(folder, manifest);
  std::cout << manifest.items() << (monte_carlo ? " runs" : " flights") << " in " << manifest.parts
            << " parts; next: trammel campaign run " << options.folder << std::endl;
  return kSolved;
}

/// "2/7" as the shard 1 (from 0) of 7.
std::pair<std::size_t, std::size_t> shard_of(const std::string& text) {
  std::size_t shard = 0;
  std::size_t count = 0;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, shard);
  const bool divided = first.ec == std::errc() && first.ptr != end && *first.ptr == '/';
  const auto second = divided ? std::from_chars(first.ptr + 1, end, count) : first;
  require(divided && second.ec == std::errc() && second.ptr == end && shard >= 1 && shard <= count, "--shard",
          text, "i/N, i from 1 to N");
  return {shard - 1, count};
}

/// What the items of a campaign are computed from; each scenario is read once, by whoever needs it first.
class CampaignWork {
 public:
  explicit CampaignWork(const io::CampaignFolder& folder)
      : folder_(folder), studies_(folder.manifest().scenarios.size()) {}

  /// The row of an item. Safe to call from several threads.
  [[nodiscard]] std::string row(std::size_t item) {
    const auto [scenario, run] = folder_.manifest().place_of(item);
    return folder_.manifest().kind == io::CampaignKind::kMonteCarlo ? study_row(scenario, run)
                                                                    : flight_row(scenario);
  }

 private:
  struct Study {
    std::once_flag made;
    std::optional<campaign::MotionStudy> study;
  };

  std::string study_row(std::size_t index, std::size_t run) {
    const io::CampaignManifest& manifest = folder_.manifest();
    const io::CampaignScenario& scenario = manifest.scenarios[index];
    Study& entry = studies_[index];
    std::call_once(entry.made, [&] {
      entry.study.emplace(folder_.scenario(index).scenario, folder_.gain(index), manifest.motion);
    });
    const campaign::RunErrors errors =
        in_file(scenario.file, [&] { return entry.study->run(manifest.seed, run); });
    return scenario.file + "," + std::to_string(run) + "," + shortest(errors.linear_m) + "," +
           shortest(scenario.guaranteed_rms_m) + "," + shortest(errors.linear_m / scenario.guaranteed_rms_m) +
           "," + shortest(errors.nonlinear_m);
  }

  [[nodiscard]] std::string flight_row(std::size_t index) const {
    const std::string& file = folder_.manifest().scenarios[index].file;
    io::ScenarioInput input = folder_.scenario(index);
    input.settings.estimate = bounds_only(input.settings.estimate);
    const auto number = [](double value) { return std::isnan(value) ? "" : shortest(value); };
    try {
      const localise::FlightEstimate flight = flight_of(input);
      const estimate::TrajectoryEstimate& estimate = flight.estimate;
      const minimax::Solution& solution = estimate.solution;
      const report::ReportInput result{input, estimate, nullptr,
                                       flight.statement ? &*flight.statement : nullptr};
      return file + "," + std::string(report::outcome(result).name) + "," +
             std::string(to_string(solution.claim)) + "," + std::to_string(estimate.parameters) + "," +
             std::to_string(estimate.observations) + "," + number(estimate.guaranteed_rms_m) + "," +
             number(estimate.lower_bound_rms_m) + "," + number(solution.relative_gap()) + "," +
             number(estimate.gauss_markov_rms_m) + "," +
             (estimate.observed ? number(estimate.observed->chi2) : "") + ",";
    } catch (const Error& error) {  // one flight that cannot be must not stop the archive
      std::string message = error.what();
      std::replace_if(
          message.begin(), message.end(), [](char c) { return c == ',' || c == '\n' || c == '#'; }, ';');
      return file + ",bad_input,none,,,,,,,," + message;
    }
  }

  const io::CampaignFolder& folder_;
  std::vector<Study> studies_;
};

int run_run(const CampaignOptions& options) {
  const io::CampaignFolder folder = io::CampaignFolder::open(options.folder);
  const auto [shard, shards] =
      options.shard.empty() ? std::pair<std::size_t, std::size_t>(0, 1) : shard_of(options.shard);
  require(options.threads >= -1, "--threads", std::to_string(options.threads), "at least 0");
  std::vector<std::size_t> parts;
  for (std::size_t part = shard; part < folder.manifest().parts; part += shards) {
    if (!folder.has_part(part)) {
      parts.push_back(part);
    }
  }
  CampaignWork work(folder);
  std::mutex writing;  // one unfinished file at a time is what an interrupt can remove
  const auto compute = [&](std::size_t i) {
    const auto [first, end] = folder.manifest().items_of(parts[i]);
    std::vector<std::string> rows;
    for (std::size_t item = first; item < end; ++item) {
      rows.push_back(work.row(item));
    }
    const std::scoped_lock lock(writing);
    folder.write_part(parts[i], rows);
  };
  // A shard is one task of several on this machine or another: one core, unless told otherwise.
  const unsigned threads =
      options.threads >= 0 ? static_cast<unsigned>(options.threads) : (options.shard.empty() ? 0U : 1U);
  {
    TerminalProgress progress;
    const ProgressObserver observe = progress.observer();
    for_each_in_parallel(parts.size(), threads, compute, [&](std::size_t done) {
      if (observe) {
        observe({"campaign", static_cast<double>(done) / static_cast<double>(parts.size())});
      }
    });
  }
  const std::size_t missing = folder.missing_parts().size();
  std::cout << parts.size() << " parts computed, " << missing << " of " << folder.manifest().parts
            << " missing" << (missing == 0 ? "; next: trammel campaign report " + options.folder : "")
            << std::endl;
  return kSolved;
}

std::filesystem::path merge(const io::CampaignFolder& folder, const std::string& output) {
  const std::filesystem::path file =
      output.empty() ? folder.path() / "merged.csv" : std::filesystem::path(output);
  io::write_atomically(file, folder.merge());
  return file;
}

int run_merge(const CampaignOptions& options) {
  const io::CampaignFolder folder = io::CampaignFolder::open(options.folder);
  std::cout << "written " << merge(folder, options.output).string() << std::endl;
  return kSolved;
}

int run_report(const CampaignOptions& options) {
  const io::CampaignFolder folder = io::CampaignFolder::open(options.folder);
  const io::CsvTable merged = io::read_csv(merge(folder, options.output));
  const io::Json json = report::campaign_json(folder.manifest(), merged);
  io::write_atomically(folder.path() / "report.json", io::dump(json));
  std::cout << (options.json ? io::dump(json) : report::campaign_text(json)) << std::flush;
  return kSolved;
}

}  // namespace

void add_campaign(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "campaign", "archives of flights and Monte Carlo studies, in shards that survive being killed");
  command->require_subcommand(1);
  const auto options = std::make_shared<CampaignOptions>();
  const auto add = [&](const char* name, const char* description, int (*run)(const CampaignOptions&)) {
    CLI::App* sub = command->add_subcommand(name, description);
    sub->callback([options, &action, run] { action = [options, run] { return run(*options); }; });
    return sub;
  };
  CLI::App* plan =
      add("plan",
          "writes the manifest: an estimate of each scenario, or with --runs a Monte Carlo study "
          "of the estimator of each",
          run_plan);
  plan->add_option("scenarios", options->scenarios, "scenario files (.toml or .json)")->required();
  plan->add_option("--out", options->folder, "folder of the campaign")->required();
  plan->add_option("--runs", options->runs, "random motions and measurements to try out per scenario")
      ->check(CLI::PositiveNumber);
  plan->add_option("--seed", options->seed, "of the study; run k depends on seed and k only")
      ->capture_default_str();
  plan->add_option(
          "--motion", options->motion,
          "true motions of a study: \"boundary\", on the surface of every bound, or \"uniform\" within")
      ->capture_default_str();
  plan->add_option("--parts", options->parts,
                   "result files; a killed process loses at most one for each of its threads "
                   "(default: one per flight, 64 per study)")
      ->check(CLI::PositiveNumber);
  CLI::App* run = add("run", "computes what is missing; any number of processes at the same time", run_run);
  run->add_option("folder", options->folder, "folder of the campaign")->required();
  run->add_option("--shard", options->shard, "i/N, i from 1 to N: only the i-th of N shares of the parts");
  run->add_option("--threads", options->threads,
                  "threads; 0: all cores (default: all cores, with --shard one)");
  CLI::App* merge_command = add("merge", "joins the parts; the same bytes for any N", run_merge);
  CLI::App* report = add("report",
                         "merges, and writes report.json: actual errors against the guarantee, or "
                         "how the flights fared",
                         run_report);
  for (CLI::App* sub : {merge_command, report}) {
    sub->add_option("folder", options->folder, "folder of the campaign")->required();
    sub->add_option("--out", options->output, "merged table (default: FOLDER/merged.csv)");
  }
  report->add_flag("--json", options->json, "print report.json to the standard output");
}

}  // namespace trammel::program
