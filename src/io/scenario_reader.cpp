// SPDX-License-Identifier: Apache-2.0
#include "scenario_reader.hpp"

#include <algorithm>
#include <limits>

#include "csv.hpp"
#include "document.hpp"
#include "file.hpp"
#include "measurement_csv.hpp"
#include "measurement_wide.hpp"
#include "trammel/core/error.hpp"
#include "trammel/problem/noise.hpp"

namespace trammel::io {

namespace {

constexpr Eigen::Index kAxes = 3;

std::vector<double> read_knots(const Node& node) {
  std::vector<double> knots = node.range_or_numbers();
  if (knots.size() < 2) {
    node.fail(std::to_string(knots.size()) + " knots", "at least two");
  }
  for (std::size_t i = 1; i < knots.size(); ++i) {
    if (!(knots[i] > knots[i - 1])) {
      node.fail(shortest(knots[i]) + " after " + shortest(knots[i - 1]), "strictly increasing knots");
    }
  }
  return knots;
}

NominalPath read_nominal(const Document& document, const Node& node, const std::vector<double>& knots_s,
                         std::vector<InputFile>& inputs) {
  NominalPath nominal;
  if (const Node* file = node.find("file")) {
    if (node.has("position_m") || node.has("velocity_mps")) {
      node.fail("both a file and a straight line", "either file, or position_m and velocity_mps");
    }
    const std::filesystem::path path = document.resolve(file->text());
    PathSamples samples = read_path(path, knots_s.front(), knots_s.back());
    nominal.sample_times_s = std::move(samples.times_s);
    nominal.sample_positions_m = std::move(samples.positions_m);
    inputs.push_back({file->text(), sha256(read_text(path))});
    return nominal;
  }
  nominal.position_m = node.at("position_m").vector(kAxes);
  nominal.velocity_mps = node.at("velocity_mps").vector(kAxes);
  return nominal;
}

double read_semi_axis(const Node& node) {
  const double value = node.number_or_infinity();
  if (value < 0.0) {
    node.fail(node.describe(), "a bound of at least 0 (inf: unbounded)");
  }
  return value;
}

/// A radius or three semi-axes.
Eigen::Vector3d read_bound(const Node& node) {
  if (node.kind() != Node::Kind::kArray) {
    return Eigen::Vector3d::Constant(read_semi_axis(node));
  }
  const std::vector<Node>& axes = node.items();
  if (axes.size() != static_cast<std::size_t>(kAxes)) {
    node.fail(node.describe(), "a radius or 3 semi-axes");
  }
  return {read_semi_axis(axes[0]), read_semi_axis(axes[1]), read_semi_axis(axes[2])};
}

std::vector<Eigen::Vector3d> read_acceleration_bounds(const Node& node, std::size_t segments) {
  const bool is_array = node.kind() == Node::Kind::kArray;
  const bool has_nested =
      is_array && std::any_of(node.items().begin(), node.items().end(),
                              [](const Node& item) { return item.kind() == Node::Kind::kArray; });
  if (!is_array || (!has_nested && node.items().size() == static_cast<std::size_t>(kAxes))) {
    return std::vector<Eigen::Vector3d>(segments, read_bound(node));
  }
  if (node.items().size() != segments) {
    node.fail(node.describe(), "a radius, 3 semi-axes, or one of these for each of the " +
                                   std::to_string(segments) + " segments");
  }
  std::vector<Eigen::Vector3d> bounds;
  for (const Node& item : node.items()) {
    bounds.push_back(read_bound(item));
  }
  return bounds;
}

Criterion read_criterion(const Node& node, const std::vector<double>& knots_s) {
  Criterion criterion;
  const Node* kind = node.find("kind");
  const std::string name = kind ? kind->choice({"integral", "times", "window", "final"}) : "integral";
  for (const auto& [key, needed] : {std::pair{"times_s", "times"}, std::pair{"window_s", "window"}}) {
    if (const Node* extra = node.find(key); extra != nullptr && name != needed) {
      extra->fail("it with kind \"" + name + "\"", "it only with kind \"" + std::string(needed) + "\"");
    }
  }
  if (name == "times") {
    const Node& times = node.at("times_s");
    criterion.kind = CriterionKind::kTimes;
    criterion.times_s = times.range_or_numbers();
    if (criterion.times_s.empty()) {
      times.fail("no times", "at least one");
    }
    for (const double t : criterion.times_s) {
      require_within_knots(t, knots_s, times.where());
    }
  } else if (name == "window") {
    const Node& window = node.at("window_s");
    criterion.kind = CriterionKind::kWindow;
    criterion.window_s = window.vector(2);
    if (!(criterion.window_s[0] < criterion.window_s[1])) {
      window.fail(shortest(criterion.window_s[0]) + " to " + shortest(criterion.window_s[1]),
                  "[begin, end] with begin before end");
    }
    require_within_knots(criterion.window_s[0], knots_s, window.where());
    require_within_knots(criterion.window_s[1], knots_s, window.where());
  } else if (name == "final") {
    criterion.kind = CriterionKind::kFinal;
  }
  return criterion;
}

SensorKind read_kind(const Node& node) {
  const auto& table = kSensorTable;
  static_assert(kSensorKinds == 7, "list every kind below");
  return *find_sensor_kind(node.choice({table[0].name, table[1].name, table[2].name, table[3].name,
                                        table[4].name, table[5].name, table[6].name}));
}

/// Rows [t_s, x_m, y_m, z_m].
PathSamples read_track(const Node& node) {
  PathSamples track;
  const Eigen::MatrixXd rows = node.matrix();
  if (rows.rows() < 2 || rows.cols() != 1 + kAxes) {
    node.fail(std::to_string(rows.rows()) + " rows of " + std::to_string(rows.cols()) + " numbers",
              "at least two rows [t_s, x_m, y_m, z_m]");
  }
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    if (i > 0 && !(rows(i, 0) > rows(i - 1, 0))) {
      node.fail(shortest(rows(i, 0)) + " s after " + shortest(rows(i - 1, 0)) + " s",
                "strictly increasing times");
    }
    track.times_s.push_back(rows(i, 0));
    track.positions_m.emplace_back(rows(i, 1), rows(i, 2), rows(i, 3));
  }
  return track;
}

/// Where a station is: one of position_m, file, track.
void read_place(const Document& document, const Node& node, Station& station,
                std::vector<InputFile>& inputs) {
  const Node* position = node.find("position_m");
  const Node* file = node.find("file");
  const Node* track = node.find("track");
  const int given = static_cast<int>(position != nullptr) + static_cast<int>(file != nullptr) +
                    static_cast<int>(track != nullptr);
  if (given > 1) {
    node.fail("more than one of position_m, file and track", "one of them");
  }
  if (file != nullptr) {
    const std::filesystem::path path = document.resolve(file->text());
    // The times it must cover are those of the measurements, which are not known yet.
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    station.track = read_path(path, kInfinity, -kInfinity);
    inputs.push_back({file->text(), sha256(read_text(path))});
  } else if (track != nullptr) {
    station.track = read_track(*track);
  } else if (station.kind != SensorKind::kPosition || position != nullptr) {
    station.position_m = node.at("position_m").vector(kAxes);
  }
}

/// Semi-axes by name of component, and time_s.
StationBias read_bias(const Node& node, SensorKind kind) {
  StationBias bias;
  const std::vector<std::string> names = component_columns(kind);
  bias.components = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(names.size()));
  for (const auto& [name, value] : node.members()) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found != names.end()) {
      bias.components(found - names.begin()) = read_semi_axis(value);
    } else if (name == "time_s") {
      bias.time_s = read_semi_axis(value);
    } else {
      std::string known;
      for (const std::string& component : names) {
        known += component + ", ";
      }
      value.fail("a bias of something else", known + "time_s");
    }
  }
  return bias;
}

Station read_station(const Document& document, const Node& node, const std::vector<double>& knots_s,
                     const std::vector<Station>& before, bool has_observations,
                     std::vector<InputFile>& inputs) {
  Station station;
  const Node& name = node.at("name");
  station.name = name.text();
  if (station.name.empty() || station.name.find_first_of(",\n\r#") != std::string::npos) {
    name.fail(name.describe(), "a name without comma, '#' or line break");
  }
  for (const Station& other : before) {
    if (other.name == station.name) {
      name.fail(name.describe() + " a second time", "names that differ");
    }
  }
  station.kind = read_kind(node.at("kind"));
  read_place(document, node, station, inputs);
  if (const Node* bias = node.find("bias")) {
    station.bias = read_bias(*bias, station.kind);
  }
  const Node& covariance = node.at("covariance");
  station.covariance = covariance.matrix();
  const std::string where = covariance.where();
  (void)noise_factor(station.covariance, components(station.kind), where.substr(0, where.rfind('.')));
  const Node* times = node.find("times_s");
  if (times == nullptr && !has_observations) {
    node.fail("no times_s and no observations", "planned times, or measurements to read");
  }
  if (times != nullptr) {
    station.times_s = times->range_or_numbers();
    for (const double t : station.times_s) {
      require_within_knots(t, knots_s, times->where());
    }
  }
  return station;
}

double read_size(const Node& node) {
  const double value = node.number();
  if (value < 0.0) {
    node.fail(node.describe(), "a number of at least 0");
  }
  return value;
}

/// How far the true motion may be from the class of motions that the bounds describe.
localise::ModelError read_model_error(const Node& bounds, const std::vector<double>& knots_s) {
  using localise::ModelError;
  ModelError error;
  const Node* jerk = bounds.find("jerk_mps3");
  const Node* position = bounds.find("model_error_m");
  const Node* velocity = bounds.find("model_error_mps");
  const Node* kind = bounds.find("model_error_kind");
  if (jerk != nullptr) {
    for (const Node* other : {position, velocity}) {
      if (other != nullptr) {
        other->fail("it beside jerk_mps3", "one of the two");
      }
    }
    double longest = 0.0;
    for (std::size_t i = 1; i < knots_s.size(); ++i) {
      longest = std::max(longest, knots_s[i] - knots_s[i - 1]);
    }
    error = localise::model_error_from_jerk(read_size(*jerk), longest);
  }
  error.position_m = position != nullptr ? read_size(*position) : error.position_m;
  error.velocity_mps = velocity != nullptr ? read_size(*velocity) : error.velocity_mps;
  if (kind != nullptr) {
    if (jerk == nullptr && position == nullptr && velocity == nullptr) {
      kind->fail("a kind of no model error", "jerk_mps3 or model_error_m beside it");
    }
    error.kind =
        kind->choice({"ellipsoid", "box"}) == "box" ? ModelError::Kind::kBox : ModelError::Kind::kEllipsoid;
  }
  return error;
}

int whole_number(const Node& node, std::int64_t smallest, std::int64_t largest) {
  const std::int64_t value = node.integer();
  if (value < smallest || value > largest) {
    node.fail(node.describe(),
              "a whole number from " + std::to_string(smallest) + " to " + std::to_string(largest));
  }
  return static_cast<int>(value);
}

/// Keys of the method "windows", and what does not go with it.
void read_windows(const Node& node, ScenarioInput& input) {
  constexpr std::int64_t kMostSegments = 1000;
  const Node* segments = node.find("window_segments");
  const Node* overlap = node.find("window_overlap");
  if (!input.windows) {
    for (const Node* key : {segments, overlap}) {
      if (key != nullptr) {
        key->fail("it with another method", "method = \"windows\" beside it");
      }
    }
    return;
  }
  input.windows->core = segments != nullptr ? whole_number(*segments, 1, kMostSegments) : input.windows->core;
  input.windows->overlap =
      overlap != nullptr ? whole_number(*overlap, 1, kMostSegments) : input.windows->overlap;
  if (node.has("relative_gap")) {
    input.windows->relative_gap = input.settings.estimate.solver.relative_gap;
  }
  if (input.settings.cross_fit || input.reject_outliers || input.settings.minimum_height_m ||
      input.settings.model_error.position_m > 0.0 || input.settings.model_error.velocity_mps > 0.0) {
    node.at("method").fail(
        "\"windows\" beside cross_fit, reject_outliers, minimum_height_m, or a model error",
        "method \"structured\", which states the error of nonlinear measurements, or none of these");
  }
}

void read_solver(const Node& node, ScenarioInput& input) {
  minimax::SolverSettings& solver = input.settings.estimate.solver;
  if (const Node* method = node.find("method")) {
    const std::string name = method->choice({"structured", "sdp", "conditional-gradient", "windows"});
    if (name == "windows") {
      input.windows.emplace();
    } else {
      input.settings.estimate.method.method = minimax::method_of(name);
    }
  }
  if (const Node* variant = node.find("variant")) {
    using minimax::ConditionalGradientVariant;
    if (input.settings.estimate.method.method != minimax::RequestedMethod::kConditionalGradient) {
      variant->fail("a variant of another method", "method = \"conditional-gradient\" beside it");
    }
    input.settings.estimate.method.variant = variant->choice({"fully-corrective", "plain"}) == "plain"
                                                 ? ConditionalGradientVariant::kPlain
                                                 : ConditionalGradientVariant::kFullyCorrective;
  }
  if (const Node* gap = node.find("relative_gap")) {
    solver.relative_gap = gap->number();
    if (!(solver.relative_gap > 0.0 && solver.relative_gap < 1.0)) {
      gap->fail(gap->describe(), "a number between 0 and 1");
    }
  }
  if (const Node* iterations = node.find("max_iterations")) {
    constexpr std::int64_t kMostIterations = 1000000000;
    solver.max_iterations = whole_number(*iterations, 1, kMostIterations);
  }
  if (const Node* threads = node.find("threads")) {
    constexpr std::int64_t kMostThreads = 10000;
    solver.threads = whole_number(*threads, 0, kMostThreads);
  }
  if (const Node* relinearise = node.find("relinearise")) {
    input.settings.relinearise = relinearise->boolean();
  }
  if (const Node* cross_fit = node.find("cross_fit")) {
    input.settings.cross_fit = cross_fit->boolean();
    if (input.settings.cross_fit && !input.settings.relinearise) {
      cross_fit->fail("true beside relinearise = false", "one of the two");
    }
  }
  read_windows(node, input);
}

}  // namespace

ScenarioInput read_scenario(const Document& document, Observations wanted) {
  ScenarioInput input;
  Scenario& scenario = input.scenario;
  const Node& root = document.root();
  if (const Node* title = root.find("title")) {
    scenario.title = title->text();
  }
  scenario.knots_s = read_knots(root.at("model").at("knots_s"));
  scenario.nominal = read_nominal(document, root.at("nominal"), scenario.knots_s, input.inputs);
  const Node& bounds = root.at("bounds");
  scenario.bounds.position_m = read_bound(bounds.at("position_m"));
  scenario.bounds.velocity_mps = read_bound(bounds.at("velocity_mps"));
  scenario.bounds.acceleration_mps2 =
      read_acceleration_bounds(bounds.at("acceleration_mps2"), scenario.segments());
  if (const Node* height = bounds.find("minimum_height_m")) {
    input.settings.minimum_height_m = height->number();
  }
  input.settings.model_error = read_model_error(bounds, scenario.knots_s);
  if (const Node* criterion = root.find("criterion")) {
    scenario.criterion = read_criterion(*criterion, scenario.knots_s);
  }
  const Node* observations = root.find("observations");
  const std::string observations_file = observations != nullptr ? observations->at("file").text() : "";
  if (observations != nullptr && observations->has("reject_outliers")) {
    input.reject_outliers = observations->at("reject_outliers").boolean();
  }
  const bool may_read = observations != nullptr && wanted != Observations::kIgnore;
  bool planned = false;
  if (const Node* stations = root.find("station")) {
    for (const Node& node : stations->items()) {
      scenario.stations.push_back(
          read_station(document, node, scenario.knots_s, scenario.stations, may_read, input.inputs));
      planned = planned || !scenario.stations.back().times_s.empty();
    }
  }
  if (const Node* solver = root.find("solver")) {
    read_solver(*solver, input);
  }
  document.reject_unknown();  // before the measurements: a misspelt key explains what they then miss
  if (may_read && !(planned && wanted == Observations::kIfUnplanned)) {
    const std::filesystem::path path = document.resolve(observations_file);
    scenario.observations = read_measurements(path, scenario);
    input.inputs.push_back({observations_file, sha256(read_text(path))});
  }
  return input;
}

ScenarioInput read_scenario(const std::filesystem::path& file, Observations observations) {
  ScenarioInput input = read_scenario(Document::load(file), observations);
  input.inputs.insert(input.inputs.begin(), {file.filename().string(), sha256(read_text(file))});
  return input;
}

}  // namespace trammel::io
