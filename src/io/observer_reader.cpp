// SPDX-License-Identifier: Apache-2.0
#include "observer_reader.hpp"

#include <algorithm>
#include <cmath>

#include "document.hpp"
#include "file.hpp"
#include "measurement_csv.hpp"
#include "trammel/core/error.hpp"
#include "trammel/trajectory/nominal_trajectory.hpp"

namespace trammel::io {

namespace {

double number_or(const Node& root, std::string_view key, double otherwise) {
  const Node* node = root.find(key);
  return node == nullptr ? otherwise : node->number();
}

std::optional<double> optional_number(const Node& root, std::string_view key) {
  const Node* node = root.find(key);
  return node == nullptr ? std::nullopt : std::optional<double>(node->number());
}

Eigen::Matrix3d matrix3(const Node& node) {
  const Eigen::MatrixXd matrix = node.matrix();
  if (matrix.rows() != 3 || matrix.cols() != 3) {
    node.fail("a matrix of " + std::to_string(matrix.rows()) + " x " + std::to_string(matrix.cols()),
              "3 rows of 3 numbers");
  }
  return matrix;
}

/// Runs `check`; an Error about a field becomes one about the key of the same name in the file.
template <class Check>
void at_key(const Node& root, const Check& check) {
  try {
    check();
  } catch (const Error& error) {
    const Node* node = root.find(error.detail().where);
    if (node == nullptr) {
      throw Error({root.where() + " " + error.detail().where, error.detail().found, error.detail().expected});
    }
    node->fail(error.detail().found, error.detail().expected);
  }
}

void read_flight(const Node& root, ObserverInput& input) {
  // The published example plans after every fifth measurement.
  constexpr double kIntervalsPerPlan = 5.0;
  observer::FlightSettings& flight = input.flight;
  flight.replan_interval_s = kIntervalsPerPlan * input.problem.measurement_interval_s;
  if (const Node* node = root.find("replan_interval_s")) {
    flight.replan_interval_s = node->number_or_infinity();
  }
  flight.min_final_distance_m = number_or(root, "min_final_distance_m", flight.min_final_distance_m);
  flight.gate_m = number_or(root, "gate_m", flight.gate_m);
  flight.max_lateral_speed_mps = number_or(root, "max_lateral_speed_mps", flight.max_lateral_speed_mps);
  if (const Node* node = root.find("measured")) {
    flight.measured = node->choice({"tangents", "angles"}) == "angles" ? observer::BearingKind::kAngles
                                                                       : observer::BearingKind::kTangents;
  }
  if (const Node* node = root.find("filter")) {
    flight.filter = node->choice({"kalman", "range_grid"}) == "range_grid"
                        ? observer::FilterKind::kRangeGrid
                        : observer::FilterKind::kExtendedKalman;
  }
  if (const Node* node = root.find("max_start_x_m")) {
    input.max_start_x_m = node->number_or_infinity();
  }
}

void check_goals(const Node& root, const ObserverInput& input, ObserverUse use) {
  const bool scales = input.target_sigma_x_m || input.energy_budget_m2ps;
  if (use == ObserverUse::kSimulate) {
    const Node* node = root.find(input.target_sigma_x_m ? "target_sigma_x_m" : "energy_budget_m2ps");
    if (scales && node != nullptr) {
      node->fail("a goal that only a single plan can have", "beta_per_s alone (take it from observer plan)");
    }
  } else if ((input.target_sigma_x_m && input.energy_budget_m2ps) ||
             (scales && root.has("max_lateral_speed_mps"))) {
    throw Error({root.where(), "several of max_lateral_speed_mps, target_sigma_x_m, energy_budget_m2ps",
                 "at most one of them"});
  }
}

std::size_t station_index(const Scenario& scenario, const Node& node) {
  const std::string& name = node.text();
  std::string known;
  for (std::size_t i = 0; i < scenario.stations.size(); ++i) {
    if (scenario.stations[i].name == name) {
      return i;
    }
    known += (known.empty() ? "" : ", ") + scenario.stations[i].name;
  }
  node.fail("\"" + name + "\"", "a station of the scenario: " + known);
}

observer::Candidate read_candidate(const Document& document, const Node& node, CompareInput& input) {
  const Scenario& scenario = input.base.scenario;
  observer::Candidate candidate;
  candidate.name = node.at("name").text();
  if (std::any_of(input.candidates.begin(), input.candidates.end(),
                  [&](const observer::Candidate& other) { return other.name == candidate.name; })) {
    node.at("name").fail("\"" + candidate.name + "\" a second time", "a name of its own for every candidate");
  }
  const std::size_t station = station_index(scenario, node.at("station"));
  if (node.has("position_m") == node.has("path")) {
    node.fail(node.has("path") ? "both position_m and path" : "neither position_m nor path", "one of them");
  }
  if (const Node* site = node.find("position_m")) {
    candidate.scenario = observer::with_station_at(scenario, station, site->vector(3));
    return candidate;
  }
  const std::string& named = node.at("path").text();
  const std::filesystem::path file = document.resolve(named);
  const auto& times = scenario.stations[station].times_s;
  const auto [first, last] = std::minmax_element(times.begin(), times.end());
  candidate.scenario = observer::with_station_along(scenario, station, read_path(file, *first, *last));
  input.base.inputs.push_back({named, sha256(read_text(file))});
  return candidate;
}

}  // namespace

ObserverInput read_observer(const std::filesystem::path& file, ObserverUse use) {
  const Document document = Document::load(file);
  const Node& root = document.root();
  ObserverInput input;
  if (const Node* title = root.find("title")) {
    input.title = title->text();
  }
  observer::PlanProblem& problem = input.problem;
  problem.position_m = root.at("position_m").vector(3);
  problem.covariance_m2 = matrix3(root.at("covariance_m2"));
  problem.speed_mps = root.at("speed_mps").number();
  problem.time_to_go_s = root.at("time_to_go_s").number();
  problem.sigma0 = root.at("sigma0").number();
  problem.measurement_interval_s = root.at("measurement_interval_s").number();
  problem.beta_per_s = root.at("beta_per_s").vector(3);
  if (const Node* node = root.find("terminal_m")) {
    problem.terminal_m = node->vector(2);
  }
  if (const Node* node = root.find("beacon_velocity_mps")) {
    problem.beacon_velocity_mps = node->vector(3);
  }
  read_flight(root, input);
  input.target_sigma_x_m = optional_number(root, "target_sigma_x_m");
  input.energy_budget_m2ps = optional_number(root, "energy_budget_m2ps");
  document.reject_unknown();
  check_goals(root, input, use);
  at_key(root, [&] { require_valid(problem); });
  if (use == ObserverUse::kSimulate) {
    at_key(root, [&] { (void)observer::FlightLoop(problem, input.flight); });
  }
  return input;
}

CompareInput read_comparison(const std::filesystem::path& file) {
  const Document document = Document::load(file);
  const Node& root = document.root();
  CompareInput input;
  if (const Node* title = root.find("title")) {
    input.title = title->text();
  }
  input.base = read_scenario(document.resolve(root.at("scenario").text()), Observations::kIgnore);
  const Node& candidates = root.at("candidate");
  for (const Node& node : candidates.items()) {
    input.candidates.push_back(read_candidate(document, node, input));
  }
  if (input.candidates.empty()) {
    candidates.fail("an empty list", "at least one candidate");
  }
  document.reject_unknown();
  input.base.inputs.insert(input.base.inputs.begin(), {file.filename().string(), sha256(read_text(file))});
  return input;
}

}  // namespace trammel::io
