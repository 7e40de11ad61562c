// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "../io/csv.hpp"
#include "../io/measurement_csv.hpp"
#include "report.hpp"
#include "result_files.hpp"
#include "trammel/core/status.hpp"

namespace trammel::report {

namespace {

using estimate::TrajectoryEstimate;
using io::Json;

/// Like to_json, with the word "infinity" for what is proved unbounded.
Json number_or_word(double value) { return std::isinf(value) ? Json("infinity") : io::to_json(value); }

Json numbers(const std::vector<double>& values) {
  return io::to_json(
      Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())));
}

/// Columns x, y, z, each an array over time; null for no rows.
Json columns(const Eigen::MatrixXd& matrix) {
  if (matrix.rows() == 0) {
    return nullptr;
  }
  Json array = Json::array();
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    array.push_back(io::to_json(matrix.col(j)));
  }
  return array;
}

std::string bound_text(const Eigen::Vector3d& bound, const std::string& unit) {
  const auto one = [](double value) { return std::isinf(value) ? "unbounded" : rounded(value); };
  if ((bound.array() == bound[0]).all()) {
    return std::isinf(bound[0]) ? "not bounded"
           : bound[0] == 0.0    ? "exactly as the reference"
                                : "within " + one(bound[0]) + " " + unit;
  }
  return "within the ellipsoid of semi-axes " + one(bound[0]) + ", " + one(bound[1]) + ", " + one(bound[2]) +
         " " + unit;
}

std::string acceleration_text(const std::vector<Eigen::Vector3d>& bounds) {
  const bool equal = std::all_of(bounds.begin(), bounds.end(),
                                 [&](const Eigen::Vector3d& b) { return b == bounds.front(); });
  return equal ? bound_text(bounds.front(), "m/s\u00b2") : "within the bound given for each segment";
}

/// What is stated about the nonlinear measurements, in a sentence; empty where nothing is.
std::string stated_meaning(const ReportInput& input) {
  if (input.statement == nullptr) {
    return "";
  }
  const localise::Statement& statement = *input.statement;
  if (statement.ambiguous) {
    return "The data are ambiguous: motions too far apart explain them nearly equally well, so no single "
           "error is stated. What follows holds only if the first of the solutions below is the true one. ";
  }
  if (!std::isfinite(statement.stated_rms_m)) {
    return "No error can be stated: what linearising the measurements leaves out could not be bounded. The "
           "linear guarantee alone is not honest here. ";
  }
  return "The position error of this estimate, " + describe_criterion(input.scenario.scenario) +
         ", is stated as at most " + rounded(statement.stated_rms_m) +
         " m rms: " + rounded(statement.linear_guarantee_rms_m) +
         " m guaranteed for measurements linearised about the " +
         (statement.independence == localise::Independence::kFixedReference ? "reference path"
                                                                            : "path fitted to them") +
         ", " + rounded(statement.curvature_rms_m) + " m for their curvature, " +
         rounded(statement.model_error_rms_m) + " m for the model error" +
         (statement.consistency == localise::Consistency::kSelfConsistent
              ? " (self-consistent: widening the tube by this value settles there). "
              : ". Curvature dominates: the tube around the path does not confirm itself. ");
}

std::string meaning(const ReportInput& input) {
  const TrajectoryEstimate& estimate = input.estimate;
  if (estimate.solution.status == SolveStatus::kUnbounded || !std::isfinite(estimate.guaranteed_rms_m)) {
    return "No finite error can be guaranteed: see the status above.";
  }
  std::string text = stated_meaning(input) +
                     (input.statement != nullptr ? "For the linearised measurements: whatever" : "Whatever") +
                     " the aircraft did within the bounds, the position error of this estimate, " +
                     describe_criterion(input.scenario.scenario) + ", is at most " +
                     rounded(estimate.guaranteed_rms_m) +
                     " m rms. No estimator that is linear in the "
                     "measurements can guarantee less than " +
                     rounded(estimate.lower_bound_rms_m) + " m";
  const double gap = estimate.solution.relative_gap();
  if (std::isfinite(gap) && estimate.solution.status == SolveStatus::kOptimal) {
    text += ", so this one is the best of its kind (relative gap " + rounded(std::max(gap, 0.0), 2) + ")";
  }
  text += ".";
  if (estimate.near_optimality) {
    text += " " + certify::describe(*estimate.near_optimality, estimate.solution.upper, "m");
  }
  return text;
}

Json assumptions(const ReportInput& input) {
  const Scenario& scenario = input.scenario.scenario;
  Json list = Json::array();
  list.push_back(
      "The true motion is the reference path plus a deviation whose acceleration is constant on each of "
      "the " +
      std::to_string(scenario.segments()) + " segments between the knots.");
  list.push_back("Deviation at the first knot: position " + bound_text(scenario.bounds.position_m, "m") +
                 ", velocity " + bound_text(scenario.bounds.velocity_mps, "m/s") +
                 "; acceleration in each segment " + acceleration_text(scenario.bounds.acceleration_mps2) +
                 ".");
  list.push_back(
      "Measurement errors have mean zero and the covariances stated, and are uncorrelated between "
      "measurements. Nothing else is assumed about their distribution.");
  if (input.statement != nullptr) {
    list.push_back(localise::describe_proved(*input.statement));
    for (std::string& sentence :
         localise::describe_assumed(*input.statement, input.scenario.settings.model_error)) {
      list.push_back(std::move(sentence));
    }
  } else {
    const auto& observed = input.estimate.observed;
    const bool fitted = observed && observed->linearisation.iterations > 0;
    list.push_back("Measurements are linear in the deviation (linearised about the " +
                   std::string(fitted ? "path fitted to them" : "reference") + ").");
  }
  list.push_back(
      "\u201crms\u201d is the root of the mean, over the measurement errors, of the squared distance in "
      "three "
      "axes, " +
      describe_criterion(scenario) + ", for the worst motion within the bounds.");
  switch (input.estimate.solution.claim) {
    case Claim::kVerified:
      list.push_back(
          std::string("Both bounds were verified with rounding errors enclosed. The proof is about ") +
          kClaimCovers + ".");
      break;
    case Claim::kApproximate:
      list.push_back(
          "Both bounds come from feasible points evaluated in double precision; rounding errors are not "
          "enclosed.");
      break;
    case Claim::kNone:
      list.push_back("Nothing is proved about the bounds of this result.");
      break;
  }
  if (input.estimate.near_optimality) {
    list.push_back(
        "The bound for estimators of any kind is that of Gaussian measurement errors with the covariances "
        "stated and of the linear measurement model.");
  }
  if (input.estimate.certificate.envelope.rows() > 0) {
    list.push_back(
        "Directions that no bound limits are confined in the proof to an envelope far wider than any "
        "physical motion (\u201cenvelope\u201d in result.json).");
  }
  return list;
}

Json grid(const ReportInput& input) {
  const TrajectoryEstimate& estimate = input.estimate;
  Json grid;
  grid["t"] = numbers(estimate.nominal.times_s);
  grid["nominal"] = columns(estimate.nominal.position_m);
  if (estimate.observed) {
    grid["estimate"] = columns(estimate.observed->path.position_m);
    if (estimate.observed->gauss_markov_path) {
      grid["gauss_markov"] = columns(estimate.observed->gauss_markov_path->position_m);
    }
  }
  if (input.truth != nullptr) {
    grid["truth"] = columns(input.truth->position_m);
  }
  grid["guaranteed_rms"] = numbers(estimate.guaranteed_rms_at_m);
  return grid;
}

Json residuals(const ReportInput& input) {
  Json list = Json::array();
  if (!input.estimate.observed) {
    return list;
  }
  const std::vector<Station>& stations = input.scenario.scenario.stations;
  for (std::size_t s = 0; s < stations.size(); ++s) {
    const SensorText& kind = describe(stations[s].kind);
    std::vector<const estimate::Residual*> mine;
    for (const estimate::Residual& residual : input.estimate.observed->residuals) {
      if (residual.station == s) {
        mine.push_back(&residual);
      }
    }
    std::stable_sort(mine.begin(), mine.end(), [](const auto* a, const auto* b) { return a->t_s < b->t_s; });
    for (Eigen::Index i = 0; i < components(stations[s].kind) && !mine.empty(); ++i) {
      Json times = Json::array();
      Json values = Json::array();
      for (const estimate::Residual* residual : mine) {
        times.push_back(io::to_json(residual->t_s));
        values.push_back(io::to_json(residual->whitened[i]));
      }
      list.push_back({{"station", stations[s].name},
                      {"component", kind.component[static_cast<std::size_t>(i)]},
                      {"t", std::move(times)},
                      {"values", std::move(values)}});
    }
  }
  return list;
}

/// Length of a vector in the direction of `a` at which it touches the ellipsoid; infinity if it never does.
double limit_along(const Eigen::Vector3d& a, const Eigen::Vector3d& semi_axes) {
  double squares = 0.0;
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    squares += semi_axes[i] > 0.0 ? std::pow(a[i] / semi_axes[i], 2) : 0.0;
  }
  return a.norm() > 0.0 ? a.norm() / std::sqrt(squares) : semi_axes.minCoeff();
}

Json segments(const ReportInput& input) {
  const Scenario& scenario = input.scenario.scenario;
  Json list = Json::array();
  const auto& observed = input.estimate.observed;
  const bool has_theta =
      observed && observed->theta.size() == static_cast<Eigen::Index>(3 * (scenario.segments() + 2));
  for (std::size_t i = 0; i < scenario.segments(); ++i) {
    const Eigen::Vector3d& bound = scenario.bounds.acceleration_mps2[i];
    const Eigen::Vector3d a =
        has_theta ? Eigen::Vector3d(observed->theta.segment<3>(3 * static_cast<Eigen::Index>(i + 2)))
                  : Eigen::Vector3d(Eigen::Vector3d::Zero());
    list.push_back({{"begin", scenario.knots_s[i]},
                    {"end", scenario.knots_s[i + 1]},
                    {"magnitude", has_theta ? io::to_json(a.norm()) : Json(nullptr)},
                    {"limit", io::to_json(limit_along(a, bound))}});
  }
  return list;
}

Json shares(const TrajectoryEstimate& estimate) {
  Json list = Json::array();
  const double total = estimate.solution.upper;
  if (!(total > 0.0) || !std::isfinite(total) || estimate.lambda_m2.size() < 2) {
    return list;
  }
  const Eigen::VectorXd& lambda = estimate.lambda_m2;
  const double accelerations = lambda.tail(lambda.size() - 2).sum();
  const double biases = estimate.lambda_stations_m2.sum();
  std::vector<std::pair<const char*, double>> parts{
      {"measurement noise", total - lambda.sum() - biases},
      {"bound on initial position", lambda[0]},
      {"bound on initial velocity", lambda[1]},
      {"bounds on accelerations", accelerations},
  };
  if (estimate.lambda_stations_m2.size() > 0) {
    parts.emplace_back("biases of stations", biases);
  }
  for (const auto& [name, part] : parts) {
    list.push_back({{"name", name}, {"share", std::clamp(part / total, 0.0, 1.0)}});
  }
  return list;
}

Eigen::Index count_components(const TrajectoryEstimate& estimate) {
  Eigen::Index count = 0;
  if (estimate.observed) {
    for (const estimate::Residual& residual : estimate.observed->residuals) {
      count += residual.value.size();
    }
  }
  return count;
}

/// What the page shows of the stated value; null where there is none.
Json statement(const ReportInput& input) {
  if (input.statement == nullptr) {
    return nullptr;
  }
  const localise::Statement& statement = *input.statement;
  Json json = {{"ambiguous", statement.ambiguous},
               {"consistency", to_string(statement.consistency)},
               {"stated_rms", number_or_word(statement.stated_rms_m)},
               {"conditional_rms", number_or_word(statement.conditional_rms_m)},
               {"linear", io::to_json(statement.linear_guarantee_rms_m)},
               {"curvature", io::to_json(statement.curvature_rms_m)},
               {"model_error", io::to_json(statement.model_error_rms_m)},
               {"solutions", Json::array()}};
  for (const localise::CompetingSolution& other : statement.competing) {
    json["solutions"].push_back({{"excess_cost", io::to_json(other.excess_cost)},
                                 {"distance", io::to_json(other.distance_m)},
                                 {"stated_rms", number_or_word(other.stated_rms_m)},
                                 {"path", columns(other.path.position_m)}});
  }
  return json;
}

Json facts(const ReportInput& input) {
  const TrajectoryEstimate& estimate = input.estimate;
  const Scenario& scenario = input.scenario.scenario;
  Json list = Json::array();
  const auto add = [&](const std::string& name, const std::string& value) { list.push_back({name, value}); };
  add("method", std::string(minimax::to_string(estimate.solution.method)) + ", " +
                    std::to_string(estimate.solution.iterations) + " iterations, " +
                    rounded(estimate.solution.solve_time_s, 3) + " s");
  add("certified interval", shortest(estimate.lower_bound_rms_m) + " to " +
                                shortest(estimate.guaranteed_rms_m) + " m, relative gap " +
                                rounded(estimate.solution.relative_gap(), 2));
  if (estimate.near_optimality && std::isfinite(estimate.near_optimality->attained_fraction)) {
    const certify::NearOptimality& near = *estimate.near_optimality;
    add("attained", rounded(near.attained_fraction, 8) +
                        " of the guaranteed squared error, by the motion in " + kWorstCaseFile);
    add("any estimator", "not below " + shortest(std::sqrt(near.best_any_estimator())) + " m (" +
                             std::string(to_string(near.best_kind())) + ")");
  }
  add("unknowns", std::to_string(estimate.parameters) + " parameters, " +
                      std::to_string(scenario.segments()) + " segments from " +
                      rounded(scenario.knots_s.front(), 6) + " to " + rounded(scenario.knots_s.back(), 6) +
                      " s");
  add("measurements", std::to_string(estimate.observations) + (estimate.observed ? " made" : " planned"));
  for (const Station& station : scenario.stations) {
    const bool moves = !station.track.positions_m.empty();
    const auto place = [](const Eigen::Vector3d& x) {
      return "(" + rounded(x[0], 7) + ", " + rounded(x[1], 7) + ", " + rounded(x[2], 7) + ")";
    };
    add("station " + station.name, std::string(describe(station.kind).name) +
                                       (moves ? ", moving from " + place(station.track.positions_m.front()) +
                                                    " to " + place(station.track.positions_m.back())
                                              : " at " + place(station.position_m)) +
                                       " m");
  }
  if (estimate.observed) {
    const estimate::ObservationResult& observed = *estimate.observed;
    for (std::size_t k = 0; k < observed.bias_parameters.size(); ++k) {
      const BiasParameter& bias = observed.bias_parameters[k];
      add("bias of station " + scenario.stations[bias.station].name,
          bias_name(scenario, bias) + " " + rounded(observed.biases(static_cast<Eigen::Index>(k)), 6) +
              " estimated, guaranteed rms error " +
              rounded(observed.biases_guaranteed_rms(static_cast<Eigen::Index>(k)), 6) + ", bounded by " +
              rounded(bias.semi_axis, 6));
    }
    const estimate::Linearisation& linearisation = estimate.observed->linearisation;
    add("linearisation ratio", rounded(linearisation.ratio, 3) + " sigma at most, " +
                                   (linearisation.iterations > 0 ? "about the path fitted to the data"
                                                                 : "about the reference path"));
  }
  if (input.statement != nullptr) {
    const localise::Statement& statement = *input.statement;
    add("stated value",
        shortest(statement.linear_guarantee_rms_m) + " m linear + " + shortest(statement.curvature_rms_m) +
            " m curvature + " + shortest(statement.model_error_rms_m) + " m model error, kappa " +
            rounded(statement.kappa, 6) + ", " + std::string(to_string(statement.consistency)));
    add("path linearised about", std::string(to_string(statement.independence)) + ", " +
                                     std::to_string(statement.starts) + " starts, " +
                                     std::to_string(statement.systems) + " linear systems");
  }
  add("library version", kVersion);
  return list;
}

}  // namespace

std::string describe_criterion(const Scenario& scenario) {
  const Criterion& criterion = scenario.criterion;
  switch (criterion.kind) {
    case CriterionKind::kTimes:
      return "averaged over " + std::to_string(criterion.times_s.size()) + " given times";
    case CriterionKind::kWindow:
      return "averaged over the window from " + rounded(criterion.window_s[0], 6) + " to " +
             rounded(criterion.window_s[1], 6) + " s";
    case CriterionKind::kFinal:
      return "at the end of the flight (" + rounded(scenario.knots_s.back(), 6) + " s)";
    case CriterionKind::kIntegral:
      break;
  }
  return "averaged over the whole flight (" + rounded(scenario.knots_s.front(), 6) + " to " +
         rounded(scenario.knots_s.back(), 6) + " s)";
}

std::vector<std::string> warnings(const ReportInput& input) {
  const TrajectoryEstimate& estimate = input.estimate;
  std::vector<std::string> list;
  if (!estimate.unbounded_directions.empty()) {
    std::string text = "Neither the bounds nor the measurements limit: ";
    for (std::size_t i = 0; i < estimate.unbounded_directions.size(); ++i) {
      text += (i == 0 ? "" : ", ") + estimate.unbounded_directions[i];
    }
    list.push_back(text + ".");
  }
  if (!estimate.observed) {
    list.push_back("No measured values: the numbers are those of the planned measurements.");
    return list;
  }
  if (input.statement != nullptr && !input.statement->ambiguous) {
    const localise::Statement& statement = *input.statement;
    switch (statement.consistency) {
      case localise::Consistency::kSelfConsistent:
        break;
      case localise::Consistency::kCurvatureDominated:
        list.push_back(
            "Curvature dominates the stated value (" + rounded(statement.kappa, 3) +
            " of the linear guarantee; self-consistent means at most 0.25): the linear guarantee alone "
            "is not honest, and the stated value rests on the search having found the right path.");
        break;
      case localise::Consistency::kNoBound:
        list.push_back(
            "No error is stated: the estimate may be so far from the path linearised about, compared with "
            "the distance to a station, that the remainder of a measurement cannot be bounded.");
        break;
    }
  }
  if (input.outliers != nullptr && !input.outliers->rejected.empty()) {
    const std::size_t count = input.outliers->rejected.size();
    list.push_back(std::to_string(count) + (count == 1 ? " measurement was" : " measurements were") +
                   " rejected, because no motion within the bounds explains " + (count == 1 ? "it" : "them") +
                   " beside the others: " + why_rejected(input, input.outliers->rejected.front()) +
                   (count == 1 ? "" : " The others are listed in result.json.") +
                   " The guarantee is that of the measurements kept, if those are sound.");
  }
  const auto components = static_cast<double>(count_components(estimate));
  constexpr double kUnlikely = 6.0;  // standard deviations of chi-squared above its mean
  if (estimate.observed->chi2 > components + kUnlikely * std::sqrt(2.0 * components)) {
    list.push_back(
        "The residuals are larger than the stated covariances explain (sum of squares " +
        rounded(estimate.observed->chi2) + " over " + rounded(components, 9) +
        " components): check covariances, bounds and segment length before trusting the guarantee.");
  }
  return list;
}

Json report_data(const ReportInput& input) {
  const TrajectoryEstimate& estimate = input.estimate;
  const Outcome status = outcome(input);
  const auto& observed = estimate.observed;
  Json data;
  data["title"] = input.scenario.scenario.title;
  data["status"] = {
      {"name", status.name}, {"cause", status.cause}, {"remedy", status.remedy}, {"solved", status.solved}};
  data["numbers"] = {{"guaranteed_rms", number_or_word(estimate.guaranteed_rms_m)},
                     {"lower_bound_rms", number_or_word(estimate.lower_bound_rms_m)},
                     {"gauss_markov_rms", number_or_word(estimate.gauss_markov_rms_m)},
                     {"prior_rms", number_or_word(estimate.prior_rms_m)},
                     {"actual_rms", io::to_json(input.truth != nullptr ? input.truth->estimate_rms_m : NAN)},
                     {"chi2", io::to_json(observed ? observed->chi2 : NAN)},
                     {"components", count_components(estimate)}};
  data["statement"] = statement(input);
  data["meaning"] = meaning(input);
  data["warnings"] = warnings(input);
  data["assumptions"] = assumptions(input);
  data["grid"] = grid(input);
  data["errors"] = nullptr;
  if (input.truth != nullptr && !input.truth->estimate_error_m.empty()) {
    data["errors"] = {{"estimate", numbers(input.truth->estimate_error_m)}};
    if (!input.truth->gauss_markov_error_m.empty()) {
      data["errors"]["gauss_markov"] = numbers(input.truth->gauss_markov_error_m);
    }
  }
  data["worst"] = columns(estimate.worst_case_motion.position_m);
  data["stations"] = Json::array();
  for (const Station& station : input.scenario.scenario.stations) {
    const std::vector<Eigen::Vector3d>& track = station.track.positions_m;
    data["stations"].push_back(
        {{"name", station.name},
         {"position", io::to_json(track.empty() ? station.position_m : track[track.size() / 2])}});
  }
  data["residuals"] = residuals(input);
  data["segments"] = segments(input);
  data["shares"] = shares(estimate);
  data["facts"] = facts(input);
  data["inputs"] = Json::array();
  for (const io::InputFile& file : input.scenario.inputs) {
    data["inputs"].push_back({{"name", file.name}, {"sha256", file.sha256}});
  }
  return data;
}

}  // namespace trammel::report
