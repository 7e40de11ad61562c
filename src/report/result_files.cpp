// SPDX-License-Identifier: Apache-2.0
#include "result_files.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "../io/csv.hpp"
#include "../io/measurement_wide.hpp"
#include "trammel/core/status.hpp"

namespace trammel::report {

namespace {

using estimate::TrajectoryEstimate;
using io::Json;

/// How much of the certified bounds is proved, in words.
std::string proof(const TrajectoryEstimate& estimate) {
  switch (estimate.solution.claim) {
    case Claim::kVerified:
      return "verified";
    case Claim::kApproximate:
      return "computed, rounding errors not enclosed";
    case Claim::kNone:
      break;
  }
  return "not proved";
}

void add_near_optimality(const TrajectoryEstimate& estimate, Json& json) {
  const certify::NearOptimality near = estimate.near_optimality.value_or(certify::NearOptimality{});
  json["attained_fraction"] = io::to_json(near.attained_fraction);
  json["any_estimator_lower_bound_rms_m"] = io::to_json(std::sqrt(near.best_any_estimator()));
  json["any_estimator_bound_kind"] = to_string(near.best_kind());
  if (near.monte_carlo) {
    json["any_estimator_proved_rms_m"] = io::to_json(std::sqrt(near.any_estimator));
    json["any_estimator_proved_kind"] = to_string(near.kind);
    json["monte_carlo_lower_bound_rms_m"] = io::to_json(std::sqrt(std::max(0.0, near.monte_carlo->bound)));
    json["monte_carlo_confidence"] = io::to_json(near.confidence);
  }
  if (estimate.worst_case_theta.size() > 0) {
    json["worst_case"] = {{"file", kWorstCaseFile}, {"theta", io::to_json(estimate.worst_case_theta)}};
  }
}

/// The stations' biases, one entry each.
Json biases_json(const ReportInput& input) {
  const estimate::ObservationResult& observed = *input.estimate.observed;
  Json list = Json::array();
  for (std::size_t k = 0; k < observed.bias_parameters.size(); ++k) {
    const BiasParameter& bias = observed.bias_parameters[k];
    list.push_back(
        {{"station", input.scenario.scenario.stations[bias.station].name},
         {"component", bias_name(input.scenario.scenario, bias)},
         {"estimate", io::to_json(observed.biases(static_cast<Eigen::Index>(k)))},
         {"guaranteed_rms", io::to_json(observed.biases_guaranteed_rms(static_cast<Eigen::Index>(k)))},
         {"semi_axis", io::to_json(bias.semi_axis)}});
  }
  return list;
}

/// Measurements that were rejected, and the test.
void add_outliers(const ReportInput& input, Json& json) {
  const localise::OutlierSearch& search = *input.outliers;
  json["outlier_test"] = {{"false_alarm", io::to_json(search.false_alarm)},
                          {"quantile", io::to_json(search.quantile)},
                          {"tested", search.tested},
                          {"rounds", search.rounds},
                          {"settled", search.settled}};
  json["rejected"] = Json::array();
  for (const localise::RejectedMeasurement& rejected : search.rejected) {
    const Station& station = input.scenario.scenario.stations[rejected.station];
    json["rejected"].push_back({{"station", station.name},
                                {"t_s", io::to_json(rejected.t_s)},
                                {"components", io::component_columns(station.kind)},
                                {"residual", io::to_json(rejected.residual)},
                                {"worst_case", io::to_json(rejected.allowed)},
                                {"reason", why_rejected(input, rejected)}});
  }
}

std::vector<std::vector<double>> path_rows(const std::vector<double>& times_s, const Eigen::MatrixXd& x,
                                           const Eigen::MatrixXd& v) {
  std::vector<std::vector<double>> rows;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    rows.push_back({times_s[i], x(row, 0), x(row, 1), x(row, 2), v(row, 0), v(row, 1), v(row, 2)});
  }
  return rows;
}

/// What the result states about nonlinear measurements.
void add_statement(const ReportInput& input, Json& json) {
  const localise::Statement& statement = *input.statement;
  const localise::FlightSettings& settings = input.scenario.settings;
  const localise::ModelError& model_error = settings.model_error;
  const bool fitted = statement.independence != localise::Independence::kFixedReference;
  const auto optional = [](const std::optional<double>& value) {
    return value ? Json(*value) : Json(nullptr);
  };
  json["stated_rms_m"] = io::to_json(statement.stated_rms_m);
  json["stated_rms_fixed_point_m"] =
      statement.ambiguous ? Json(nullptr) : optional(statement.fixed_point_rms_m);
  json["conditional_rms_m"] = io::to_json(statement.conditional_rms_m);
  json["linear_guarantee_rms_m"] = io::to_json(statement.linear_guarantee_rms_m);
  json["curvature_rms_m"] = io::to_json(statement.curvature_rms_m);
  json["curvature_lower_rms_m"] = io::to_json(statement.curvature_lower_rms_m);
  json["model_error_rms_m"] = io::to_json(statement.model_error_rms_m);
  json["kappa"] = io::to_json(statement.kappa);
  json["consistency"] = to_string(statement.consistency);
  json["independence"] = to_string(statement.independence);
  json["model_error"] = {
      {"position_m", model_error.position_m},
      {"velocity_mps", model_error.velocity_mps},
      {"kind", model_error.kind == localise::ModelError::Kind::kBox ? "box" : "ellipsoid"}};
  json["reference"] = {{"method", fitted ? "barrier_fit" : "given"},
                       {"observations", input.estimate.observations}};
  if (fitted) {
    json["reference"]["barrier_weight"] = localise::kStrongBarrier;
    json["reference"]["minimum_height_m"] = optional(settings.minimum_height_m);
    json["reference"]["starts"] = statement.starts;
    json["reference"]["linear_systems"] = statement.systems;
    json["reference"]["cost"] = io::to_json(statement.reference_cost);
    json["reference"]["chi2"] = io::to_json(statement.reference_chi2);
  }
  json["tube"] = {
      {"factor", localise::kTubeFactor},
      {"widening", io::to_json(statement.tube_widening)},
      {"rms_m", io::to_json(Eigen::Map<const Eigen::VectorXd>(
                    statement.tube_m.data(), static_cast<Eigen::Index>(statement.tube_m.size())))}};
  json["floor_test"] = Json::array();
  for (const localise::FloorTest& test : statement.floor_tests) {
    json["floor_test"].push_back({{"height_m", test.height_m},
                                  {"cost_difference", io::to_json(test.excess_cost)},
                                  {"distance_m", io::to_json(test.distance_m)},
                                  {"reference_cost_difference", io::to_json(test.reference_excess_cost)},
                                  {"reference_distance_m", io::to_json(test.reference_distance_m)}});
  }
  json["competing_solutions"] = Json::array();
  for (std::size_t k = 0; k < statement.competing.size(); ++k) {
    const localise::CompetingSolution& other = statement.competing[k];
    json["competing_solutions"].push_back(
        {{"cost_difference", io::to_json(other.excess_cost)},
         {"distance_m", io::to_json(other.distance_m)},
         {"chi2", io::to_json(other.chi2)},
         {"found_by", other.from_floor_test ? "floor_test" : "search"},
         {"linear_guarantee_rms_m", io::to_json(other.linear_guarantee_rms_m)},
         {"stated_rms_m", io::to_json(other.stated_rms_m)},
         {"file", competing_file(k)}});
  }
  json["proved"] = localise::describe_proved(statement);
  json["assumed"] = localise::describe_assumed(statement, model_error);
}

std::string rounded_metres(double value) { return std::isfinite(value) ? rounded(value) + " m" : "no bound"; }

std::string metres(double value) {
  return std::isnan(value) ? "not determined" : std::isinf(value) ? "unbounded" : shortest(value) + " m";
}

}  // namespace

std::string why_rejected(const ReportInput& input, const localise::RejectedMeasurement& rejected) {
  const Station& station = input.scenario.scenario.stations[rejected.station];
  Eigen::Index worst = 0;
  rejected.residual.cwiseAbs().cwiseQuotient(rejected.allowed).maxCoeff(&worst);
  return station.name + " at " + shortest(rejected.t_s) +
         " s: " + io::component_columns(station.kind)[static_cast<std::size_t>(worst)] + " is " +
         rounded(rejected.residual(worst)) + " off what the others predict; motions within the bounds and " +
         rounded(input.outliers->quantile, 3) + " sigma of noise account for " +
         rounded(rejected.allowed(worst)) + " at most.";
}

std::string bias_name(const Scenario& scenario, const BiasParameter& bias) {
  return bias.component == BiasParameter::kTimeOffset
             ? "time_s"
             : io::component_columns(
                   scenario.stations[bias.station].kind)[static_cast<std::size_t>(bias.component)];
}

Json result_json(const ReportInput& input) {
  const TrajectoryEstimate& estimate = input.estimate;
  Json json;
  json["title"] = input.scenario.scenario.title;
  json["status"] = outcome(input).name;
  json["claim"] = to_string(estimate.solution.claim);
  json["claim_covers"] = kClaimCovers;
  json["inflation"] = io::to_json(estimate.certificate.inflation);
  if (!estimate.certificate.remark.empty()) {
    json["remark"] = estimate.certificate.remark;
  }
  if (estimate.certificate.envelope.rows() > 0) {
    json["envelope"] = io::matrix_to_json(estimate.certificate.envelope);
  }
  json["parameters"] = estimate.parameters;
  json["observations"] = estimate.observations;
  json["method"] = minimax::to_string(estimate.solution.method);
  json["iterations"] = estimate.solution.iterations;
  json["guaranteed_rms_m"] = io::to_json(estimate.guaranteed_rms_m);
  json["lower_bound_rms_m"] = io::to_json(estimate.lower_bound_rms_m);
  json["relative_gap"] = io::to_json(estimate.solution.relative_gap());
  json["gauss_markov_rms_m"] = io::to_json(estimate.gauss_markov_rms_m);
  json["prior_rms_m"] = io::to_json(estimate.prior_rms_m);
  json["lambda_m2"] = io::to_json(estimate.lambda_m2);
  if (estimate.lambda_stations_m2.size() > 0) {
    json["lambda_stations_m2"] = io::to_json(estimate.lambda_stations_m2);
  }
  add_near_optimality(estimate, json);
  json["solve_time_s"] = io::to_json(estimate.solution.solve_time_s);
  json["library_version"] = kVersion;
  json["inputs"] = Json::array();
  for (const io::InputFile& file : input.scenario.inputs) {
    json["inputs"].push_back({{"name", file.name}, {"sha256", file.sha256}});
  }
  if (!estimate.unbounded_directions.empty()) {
    json["unbounded_directions"] = estimate.unbounded_directions;
  }
  if (estimate.observed) {
    const estimate::ObservationResult& observed = *estimate.observed;
    json["chi2"] = io::to_json(observed.chi2);
    json["estimate"] = {{"theta", io::to_json(observed.theta)},
                        {"knots_s", input.scenario.scenario.knots_s},
                        {"position_m", io::matrix_to_json(observed.knot_position_m)},
                        {"velocity_mps", io::matrix_to_json(observed.knot_velocity_mps)}};
    if (!observed.bias_parameters.empty()) {
      json["estimate"]["biases"] = biases_json(input);
    }
    json["linearisation"] = {{"ratio", io::to_json(observed.linearisation.ratio)},
                             {"iterations", observed.linearisation.iterations},
                             {"converged", observed.linearisation.converged}};
  }
  if (input.statement != nullptr) {
    add_statement(input, json);
  }
  if (input.outliers != nullptr) {
    add_outliers(input, json);
  }
  if (input.truth != nullptr) {
    json["truth"] = {{"actual_rms_error_m", io::to_json(input.truth->estimate_rms_m)},
                     {"actual_gauss_markov_rms_error_m", io::to_json(input.truth->gauss_markov_rms_m)}};
  }
  return json;
}

std::string trajectory_csv(const TrajectoryEstimate& estimate) {
  const estimate::PathTable& path = estimate.observed ? estimate.observed->path : estimate.nominal;
  std::vector<std::vector<double>> rows = path_rows(path.times_s, path.position_m, path.velocity_mps);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].push_back(i < estimate.guaranteed_rms_at_m.size() ? estimate.guaranteed_rms_at_m[i]
                                                              : std::nan(""));
  }
  return io::format_csv({"t_s", "x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps", "guaranteed_rms_m"}, rows);
}

std::string worst_case_csv(const TrajectoryEstimate& estimate) {
  const estimate::PathTable& deviation = estimate.worst_case_motion;
  std::vector<std::vector<double>> rows;
  if (!deviation.times_s.empty()) {
    rows = path_rows(deviation.times_s, estimate.nominal.position_m + deviation.position_m,
                     estimate.nominal.velocity_mps + deviation.velocity_mps);
  }
  return io::format_csv({"t_s", "x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps"}, rows);
}

std::string competing_csv(const localise::CompetingSolution& solution) {
  return io::format_csv(
      {"t_s", "x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps"},
      path_rows(solution.path.times_s, solution.path.position_m, solution.path.velocity_mps));
}

std::string competing_file(std::size_t index) { return "competing_" + std::to_string(index + 2) + ".csv"; }

namespace {

/// "16.5 m = 16.1 m linear guarantee + 0.1 m curvature + 0.3 m model error".
std::string stated(double value, const localise::Statement& statement) {
  std::string text = rounded_metres(value) + " (" + rounded_metres(statement.linear_guarantee_rms_m) +
                     " linear + " + rounded_metres(statement.curvature_rms_m) + " curvature + " +
                     rounded_metres(statement.model_error_rms_m) + " model error";
  if (statement.consistency == localise::Consistency::kSelfConsistent) {
    text += ", settled";
  }
  return text + ")";
}

std::string consistency_words(const localise::Statement& statement) {
  switch (statement.consistency) {
    case localise::Consistency::kSelfConsistent:
      return "self-consistent";
    case localise::Consistency::kCurvatureDominated:
      return "dominated by curvature";
    case localise::Consistency::kNoBound:
      break;
  }
  return "no bound";
}

}  // namespace

std::string summary(const ReportInput& input) {
  const TrajectoryEstimate& estimate = input.estimate;
  const Outcome status = outcome(input);
  std::string text = input.scenario.scenario.title + (input.scenario.scenario.title.empty() ? "" : "\n");
  const auto line = [&](std::string name, const std::string& value) {
    constexpr std::size_t kNameWidth = 24;
    name.resize(std::max(kNameWidth, name.size() + 1), ' ');
    text += name + value + "\n";
  };
  line("status", std::string(status.name) + ": " + std::string(status.cause));
  if (!status.solved) {
    line("what to do", std::string(status.remedy));
  }
  if (const localise::Statement* statement = input.statement; statement != nullptr) {
    if (statement->ambiguous) {
      line("stated rms error", "none: the data are ambiguous");
      line("if solution 1 is true", stated(statement->conditional_rms_m, *statement));
      for (std::size_t k = 0; k < statement->competing.size(); ++k) {
        const localise::CompetingSolution& other = statement->competing[k];
        line("if solution " + std::to_string(k + 2) + " is true",
             rounded_metres(other.stated_rms_m) + "; " + rounded_metres(other.distance_m) +
                 " rms away, twice the log likelihood lower by " + rounded(other.excess_cost));
      }
    } else {
      line("stated rms error", stated(statement->stated_rms_m, *statement) + ", " +
                                   consistency_words(*statement) + " (kappa " + rounded(statement->kappa, 3) +
                                   ")");
    }
  }
  line(input.statement != nullptr ? "linear guarantee" : "guaranteed rms error",
       metres(estimate.guaranteed_rms_m) + " (" + proof(estimate) + "), " +
           describe_criterion(input.scenario.scenario));
  line("lower bound", metres(estimate.lower_bound_rms_m) + " (" + proof(estimate) +
                          ": no linear estimator guarantees less)");
  if (!estimate.certificate.remark.empty()) {
    line("remark", estimate.certificate.remark);
  }
  if (estimate.near_optimality) {
    line("in words", certify::describe(*estimate.near_optimality, estimate.solution.upper, "m"));
  }
  line("Gauss-Markov rms error", metres(estimate.gauss_markov_rms_m) + " (measurements alone)");
  line("prior rms error", metres(estimate.prior_rms_m) + " (bounds alone)");
  if (estimate.observed) {
    if (input.statement != nullptr && input.statement->starts > 0) {
      line("linearised about", "the path fitted to the data (" + std::to_string(input.statement->starts) +
                                   " starts, " + std::to_string(input.statement->systems) +
                                   " linear systems)");
    }
    line("linearisation ratio", shortest(estimate.observed->linearisation.ratio) + " sigma");
    line("chi2", shortest(estimate.observed->chi2));
    const estimate::ObservationResult& observed = *estimate.observed;
    for (std::size_t k = 0; k < observed.bias_parameters.size(); ++k) {
      const BiasParameter& bias = observed.bias_parameters[k];
      const auto at = static_cast<Eigen::Index>(k);
      line("bias of " + input.scenario.scenario.stations[bias.station].name,
           bias_name(input.scenario.scenario, bias) + " " + rounded(observed.biases(at)) +
               ", guaranteed rms error " + rounded(observed.biases_guaranteed_rms(at)) + ", bounded by " +
               rounded(bias.semi_axis));
    }
  }
  if (input.truth != nullptr) {
    line("actual rms error", metres(input.truth->estimate_rms_m) + " (estimate against the true path)");
  }
  line("size", std::to_string(estimate.parameters) + " parameters, " + std::to_string(estimate.observations) +
                   " measurements, " + std::string(minimax::to_string(estimate.solution.method)) + ", " +
                   std::to_string(estimate.solution.iterations) + " iterations, " +
                   shortest(estimate.solution.solve_time_s) + " s");
  for (const std::string& warning : warnings(input)) {
    line("note", warning);
  }
  return text;
}

}  // namespace trammel::report
