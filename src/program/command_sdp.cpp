// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include <CLI/App.hpp>

#include "../io/file.hpp"
#include "../io/json_output.hpp"
#include "commands.hpp"
#include "trammel/sdp/sdpa_format.hpp"
#include "trammel/sdp/solve.hpp"

namespace trammel::program {

namespace {

struct Options {
  std::string file;
  bool json = false;
  sdp::Settings settings;
};

io::Json result_of(const sdp::Solution& solution) {
  io::Json json;
  json["status"] = sdp::describe(solution.status).name;
  json["primal_objective"] = io::to_json(solution.primal_objective);
  json["dual_objective"] = io::to_json(solution.dual_objective);
  json["dimacs"] = io::to_json(Eigen::Map<const Eigen::VectorXd>(
      solution.dimacs.data(), static_cast<Eigen::Index>(solution.dimacs.size())));
  json["iterations"] = solution.iterations;
  json["solve_time_s"] = io::to_json(solution.timings.total_s);
  json["ray_violation"] = io::to_json(solution.ray_violation);
  json["precision"] = to_string(solution.precision);
  json["library_version"] = kVersion;
  return json;
}

void print(const sdp::Problem& problem, const sdp::Solution& solution) {
  constexpr std::array<const char*, 6> kMeanings{"dual equations",   "negative part of Y",
                                                 "primal equations", "negative part of X",
                                                 "objectives' gap",  "complementarity <X, Y>"};
  const sdp::StatusText& text = sdp::describe(solution.status);
  std::printf("%s: %s\n", std::string(text.name).c_str(), std::string(text.cause).c_str());
  std::printf("  problem            %ld variables, %zu blocks\n", static_cast<long>(problem.cost.size()),
              problem.blocks.size());
  std::printf("  primal objective   %.12e   min c'x\n", solution.primal_objective);
  std::printf("  dual objective     %.12e   max <F_0, Y>\n", solution.dual_objective);
  for (std::size_t k = 0; k < kMeanings.size(); ++k) {
    std::printf("  DIMACS error %zu     %10.2e   %s\n", k + 1, solution.dimacs[k], kMeanings[k]);
  }
  if (std::isfinite(solution.ray_violation)) {
    std::printf("  ray's violation    %10.2e   the ray that proves infeasibility\n", solution.ray_violation);
  }
  std::printf("  iterations         %d in %s numbers, %.3f s\n", solution.iterations,
              std::string(to_string(solution.precision)).c_str(), solution.timings.total_s);
  if (solution.status != sdp::Status::kOptimal) {
    std::printf("What to do: %s\n", std::string(text.remedy).c_str());
  }
}

int run(const Options& options) {
  const std::filesystem::path file = options.file;
  const sdp::Problem problem = sdp::parse_sdpa(io::read_text(file), file.string());
  const sdp::Solution solution = sdp::solve(problem, options.settings);
  if (options.json) {
    std::cout << io::dump(result_of(solution));
  } else {
    print(problem, solution);
  }
  const bool answered =
      solution.status != sdp::Status::kIterationLimit && solution.status != sdp::Status::kNumericalTrouble;
  return answered ? ExitCode::kSolved : ExitCode::kNotConverged;
}

}  // namespace

void add_sdp_command(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "sdp",
      "Solve a semidefinite program in SDPA sparse format (.dat-s): min c'x with sum x_i F_i - F_0 positive "
      "semidefinite. Infeasible problems, proved by a ray, count as solved.");
  const auto options = std::make_shared<Options>();
  command->add_option("file", options->file, "problem in SDPA sparse format")->required();
  command->add_flag("--json", options->json, "print the result as JSON");
  visit_fields(options->settings, [&](const FieldDoc& doc, auto& value) {
    using Value = std::decay_t<decltype(value)>;
    if constexpr (std::is_arithmetic_v<Value>) {
      std::string flag = "--" + std::string(doc.name);
      std::replace(flag.begin(), flag.end(), '_', '-');
      command->add_option(flag, value, std::string(doc.meaning))->capture_default_str();
    }
  });
  command->callback([&action, options] { action = [options] { return run(*options); }; });
}

}  // namespace trammel::program
