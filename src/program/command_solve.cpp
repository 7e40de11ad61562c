// SPDX-License-Identifier: Apache-2.0
// trammel solve: the guaranteed problem of a user's own linear model.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

#include "../io/csv.hpp"
#include "../io/json_output.hpp"
#include "../io/raw_problem.hpp"
#include "commands.hpp"
#include "phase_profile.hpp"
#include "trammel/certify/certificate.hpp"
#include "trammel/certify/near_optimality.hpp"
#include "trammel/core/settings.hpp"
#include "trammel/minimax/methods.hpp"

namespace trammel::program {

namespace {

/// What a claim of "verified" is about.
constexpr const char* kCoversInput = "the problem as given, its numbers rounded to binary64";
constexpr const char* kCoversFactors =
    "the problem as computed in floating point from the inputs: factors stand for the matrices given, and "
    "reproduce them to rounding errors only";

struct SolveOptions {
  std::string problem;
  bool json = false;
  bool estimator = false;
  bool bounds_only = false;
  certify::NearOptimalitySettings near_settings;
  std::string method = "structured";
  minimax::SolverSettings settings;
  bool profile = false;
};

struct Answer {
  minimax::Solution solution;
  certify::Certificate certificate;
  std::optional<certify::NearOptimality> near;
};

Answer solve_and_verify(const GuaranteedProblem& problem, const SolveOptions& options,
                        PhaseProfile& profile) {
  Answer answer;
  profile.enter("solving");
  answer.solution =
      minimax::solve_with({.method = minimax::method_of(options.method)}, problem, options.settings);
  profile.enter("proving the bounds");
  answer.certificate = certify::certify(problem, options.settings, answer.solution);
  if (!options.bounds_only && answer.solution.status != SolveStatus::kUnbounded) {
    profile.enter("near-optimality");
    answer.near = certify::assess_near_optimality(problem, answer.solution, options.near_settings);
  }
  return answer;
}

void add_near_optimality(const certify::NearOptimality& near, io::Json& json) {
  json["attained_fraction"] = io::to_json(near.attained_fraction);
  if (near.worst_case.size() > 0) {
    json["worst_case"] = io::to_json(near.worst_case);
  }
  json["any_estimator_lower_bound"] = io::to_json(near.best_any_estimator());
  json["any_estimator_bound_kind"] = to_string(near.best_kind());
  if (near.monte_carlo) {
    json["any_estimator_proved"] = io::to_json(near.any_estimator);
    json["any_estimator_proved_kind"] = to_string(near.kind);
    json["monte_carlo_lower_bound"] = io::to_json(near.monte_carlo->bound);
    json["monte_carlo_confidence"] = io::to_json(near.confidence);
  }
}

io::Json to_json(const io::RawProblem& raw, const SolveOptions& options, const Answer& answer) {
  const minimax::Solution& solution = answer.solution;
  const certify::Certificate& certificate = answer.certificate;
  io::Json json;
  json["title"] = raw.title;
  json["status"] = describe(solution.status).name;
  json["claim"] = to_string(solution.claim);
  json["claim_covers"] = raw.factored ? kCoversFactors : kCoversInput;
  json["upper"] = io::to_json(solution.upper);
  json["lower"] = io::to_json(solution.lower);
  json["relative_gap"] = io::to_json(solution.relative_gap());
  json["inflation"] = io::to_json(certificate.inflation);
  json["parameters"] = raw.problem.parameters();
  json["observations"] = raw.problem.information_factor.rows();
  json["method"] = minimax::to_string(solution.method);
  json["iterations"] = solution.iterations;
  json["lambda"] = io::to_json(solution.multipliers);
  if (certificate.envelope.rows() > 0) {
    json["envelope"] = io::matrix_to_json(certificate.envelope);
  }
  if (solution.unbounded_directions.cols() > 0) {
    json["unbounded_directions"] = io::matrix_to_json(solution.unbounded_directions.transpose());
  }
  if (!certificate.remark.empty()) {
    json["remark"] = certificate.remark;
  }
  add_near_optimality(answer.near.value_or(certify::NearOptimality{}), json);
  json["solve_time_s"] = io::to_json(solution.solve_time_s);
  json["library_version"] = kVersion;
  json["inputs"] = io::Json::array({io::Json{
      {"name", std::filesystem::path(options.problem).filename().string()}, {"sha256", raw.sha256}}});
  if (options.estimator) {
    json["estimator"] = io::matrix_to_json(solution.gain);
  }
  return json;
}

std::string direction_text(const Eigen::VectorXd& direction) {
  constexpr double kShown = 1e-6;  // relative to the largest entry
  const double largest = direction.cwiseAbs().maxCoeff();
  std::string text;
  for (Eigen::Index i = 0; i < direction.size(); ++i) {
    if (std::abs(direction(i)) > kShown * largest) {
      text += (text.empty() ? "" : " + ") + shortest(direction(i)) + " theta[" + std::to_string(i) + "]";
    }
  }
  return text;
}

std::string summary(const io::RawProblem& raw, const SolveOptions& options, const Answer& answer) {
  const minimax::Solution& solution = answer.solution;
  const StatusText& status = describe(solution.status);
  std::string text = raw.title.empty() ? "" : raw.title + "\n";
  const auto line = [&text](std::string name, const std::string& value) {
    constexpr std::size_t kNameWidth = 24;
    name.resize(std::max(kNameWidth, name.size() + 1), ' ');
    text += name + value + "\n";
  };
  line("status", std::string(status.name) + ": " + std::string(status.cause));
  if (solution.status != SolveStatus::kOptimal) {
    line("what to do", std::string(status.remedy));
  }
  for (Eigen::Index j = 0; j < solution.unbounded_directions.cols(); ++j) {
    line("unbounded direction", direction_text(solution.unbounded_directions.col(j)));
  }
  line("squared error, upper", shortest(solution.upper) + " (guaranteed by the estimator K F'y)");
  line("squared error, lower", shortest(solution.lower) + " (no linear estimator guarantees less)");
  const double asked = options.settings.relative_gap;
  line("relative gap",
       shortest(solution.relative_gap()) +
           (solution.relative_gap() > asked ? " (asked for " + shortest(asked) + ", as narrow as was reached)"
                                            : ""));
  line("claim", std::string(to_string(solution.claim)) +
                    (answer.certificate.remark.empty() ? "" : ": " + answer.certificate.remark));
  if (solution.claim == Claim::kVerified) {
    line("claim covers", raw.factored ? kCoversFactors : kCoversInput);
  }
  if (answer.near) {
    line("in words", certify::describe(*answer.near, solution.upper, ""));
  }
  line("size", std::to_string(raw.problem.parameters()) + " parameters, " +
                   std::to_string(raw.problem.information_factor.rows()) + " measurements, " +
                   std::to_string(raw.problem.ellipsoids.size()) + " ellipsoids, " +
                   std::string(minimax::to_string(solution.method)) + ", " +
                   std::to_string(solution.iterations) + " iterations, " + shortest(solution.solve_time_s) +
                   " s");
  return text;
}

int run(const SolveOptions& options) {
  validate(options.settings, "solver");
  PhaseProfile profile;
  profile.enter("reading the problem");
  const io::RawProblem raw = io::read_raw_problem(options.problem);
  const Answer answer = solve_and_verify(raw.problem, options, profile);
  profile.enter("writing the result");
  std::cout << (options.json ? io::dump(to_json(raw, options, answer)) : summary(raw, options, answer))
            << std::flush;
  if (options.profile) {
    std::cerr << profile.table();
  }
  switch (answer.solution.status) {
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

}  // namespace

void add_solve(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("solve", "guaranteed linear estimator of a linear model of your own");
  const auto options = std::make_shared<SolveOptions>();
  command->add_option("problem", options->problem, "problem file (.json or .toml)")->required();
  command->add_flag("--json", options->json, "print the result as JSON");
  command->add_flag("--estimator", options->estimator,
                    "with --json: also the matrix K, estimate theta = K F'y");
  CLI::Option* const bounds_only =
      command->add_flag("--bounds-only", options->bounds_only,
                        "neither the worst admissible parameters nor the bound over all estimators (most of "
                        "the time)");
  command
      ->add_flag("--monte-carlo", options->near_settings.monte_carlo,
                 "sharpen the bound over all estimators by Monte Carlo (99.9 % confidence; up to a minute)")
      ->excludes(bounds_only);
  command->add_flag("--profile", options->profile, "print to standard error where the time went, by phase");
  command->add_option("--method", options->method, "structured, sdp or conditional-gradient")
      ->check(CLI::IsMember({"structured", "sdp", "conditional-gradient"}))
      ->capture_default_str();
  visit_fields(options->settings, [command](const FieldDoc& doc, auto& field) {
    std::string name = "--" + std::string(doc.name);
    std::replace(name.begin(), name.end(), '_', '-');
    command->add_option(name, field, std::string(doc.meaning))->capture_default_str();
  });
  command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace trammel::program
