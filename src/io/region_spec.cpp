// SPDX-License-Identifier: Apache-2.0
#include "region_spec.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "csv.hpp"
#include "document.hpp"
#include "trammel/core/error.hpp"
#include "trammel/region/lscr.hpp"
#include "trammel/region/sps.hpp"

namespace trammel::io {

namespace {

constexpr std::array<std::string_view, 5> kMethodNames{"full_residual_lscr", "paper_lscr", "sps", "ellipsoid",
                                                       "self_normalised"};
constexpr int kMaxOrder = 1000;
constexpr int kMaxCount = 100000000;
constexpr int kMaxMembers = 100000;  // each string is compared with all before it

int bounded_integer(const Node& node, int least, int most) {
  const std::int64_t value = node.integer();
  if (value < least || value > most) {
    node.fail(std::to_string(value),
              "a whole number from " + std::to_string(least) + " to " + std::to_string(most));
  }
  return static_cast<int>(value);
}

/// Position of the text among names; Error at the node otherwise.
template <class Names>
int position(const Node& node, const Names& names) {
  const std::string& text = node.text();
  std::string expected = "one of";
  int index = 0;
  for (const std::string_view name : names) {
    if (text == name) {
      return index;
    }
    expected += (index++ == 0 ? " " : ", ") + std::string(name);
  }
  node.fail("\"" + text + "\"", expected);
}

/// The coefficient that a key like "a2" names.
std::optional<double>& coefficient(region::PlantModel& model, const std::string& key, const Node& node) {
  double index = 0.0;
  const bool is_a = !key.empty() && key[0] == 'a';
  const bool numbered = key.size() > 1 && (is_a || key[0] == 'b') &&
                        key.find_first_not_of("0123456789", 1) == std::string::npos &&
                        parse_number(std::string_view(key).substr(1), index);
  auto& list = is_a ? model.a : model.b;
  const double first = is_a ? 1.0 : model.delay;
  if (!numbered || index < first || index >= first + static_cast<double>(list.size())) {
    std::string names;
    for (std::size_t k = 1; k <= model.a.size(); ++k) {
      names += "a" + std::to_string(k) + " ";
    }
    for (std::size_t k = 0; k < model.b.size(); ++k) {
      names += "b" + std::to_string(static_cast<std::size_t>(model.delay) + k) + " ";
    }
    node.fail("the coefficient \"" + key + "\"", "one of " + names);
  }
  return list[static_cast<std::size_t>(index - first)];
}

void read_plant(const Node& plant, region::PlantModel& model) {
  const int na = bounded_integer(plant.at("na"), 0, kMaxOrder);
  const Node* delay = plant.find("delay");
  model.delay = delay != nullptr ? bounded_integer(*delay, 1, kMaxOrder) : 1;
  const int nb = bounded_integer(plant.at("nb"), model.delay, kMaxOrder);
  model.a.resize(static_cast<std::size_t>(na));
  model.b.resize(static_cast<std::size_t>(nb - model.delay + 1));
  if (const Node* known = plant.find("known")) {
    for (const auto& [key, value] : known->members()) {
      coefficient(model, key, value) = value.number();
    }
  }
  if (region::unknown_count(model) == 0) {
    plant.fail("every coefficient known", "at least one coefficient that is not in plant.known");
  }
}

void read_truth(const Node& node, RegionSpec& spec) {
  region::PlantModel given = spec.model;
  for (const auto& [key, value] : node.members()) {
    if (coefficient(spec.model, key, value)) {
      value.fail("a value for \"" + key + "\"", "only coefficients that are not in plant.known");
    }
    coefficient(given, key, value) = value.number();
  }
  const std::vector<std::string> names = region::unknown_names(spec.model);
  if (node.members().size() != names.size()) {
    node.fail(std::to_string(node.members().size()) + " coefficients",
              "every unknown one, " + std::to_string(names.size()));
  }
  region::Plant plant;
  plant.delay = given.delay;
  plant.a.resize(static_cast<Eigen::Index>(given.a.size()));
  plant.b.resize(static_cast<Eigen::Index>(given.b.size()));
  std::transform(given.a.begin(), given.a.end(), plant.a.begin(), [](const auto& value) { return *value; });
  std::transform(given.b.begin(), given.b.end(), plant.b.begin(), [](const auto& value) { return *value; });
  spec.truth = region::unknown_of(spec.model, plant);
}

void read_probe(const Node* probe, RegionSpec& spec) {
  spec.period = static_cast<int>(region::unknown_count(spec.model));
  spec.first_time = -spec.model.delay;
  if (probe == nullptr) {
    return;
  }
  if (const Node* node = probe->find("period")) {
    spec.period = bounded_integer(*node, 1, kMaxOrder);
  }
  if (const Node* node = probe->find("first_time")) {
    spec.first_time = bounded_integer(*node, -kMaxCount, kMaxCount);
  }
  if (const Node* node = probe->find("gain")) {
    spec.gain = node->number();
    if (!(spec.gain > 0.0)) {
      node->fail(shortest(spec.gain), "a positive number");
    }
  }
  if (const Node* node = probe->find("first")) {
    spec.first_probe = bounded_integer(*node, 0, kMaxCount);
  }
  if (const Node* node = probe->find("count")) {
    spec.probe_count = bounded_integer(*node, 1, kMaxCount);
  }
}

void read_filter(const Node& method, RegionSpec& spec) {
  using Kind = region::ResidualFilter::Kind;
  if (const Node* node = method.find("filter")) {
    constexpr std::array<std::string_view, 5> kNames{"none", "mean", "trend", "periodic", "fir"};
    spec.filter.kind = static_cast<Kind>(position(*node, kNames));
    if (spec.filter.kind != Kind::kNone && spec.method == RegionMethod::kPaper) {
      node->fail(node->text(), "\"none\" with the method paper_lscr");
    }
  }
  if (spec.filter.kind == Kind::kPeriodic) {
    spec.filter.period = bounded_integer(method.at("filter_period"), 1, kMaxCount);
  }
  if (spec.filter.kind == Kind::kFir) {
    spec.filter.taps = method.at("filter_taps").numbers();
    const auto& taps = spec.filter.taps;
    if (std::all_of(taps.begin(), taps.end(), [](double tap) { return tap == 0.0; })) {
      method.at("filter_taps").fail(taps.empty() ? "no number" : "only zeros", "at least one that is not 0");
    }
  }
}

/// q from q or level.
void read_level(const Node* method, RegionSpec& spec) {
  const Node* q = method != nullptr ? method->find("q") : nullptr;
  const Node* level = method != nullptr ? method->find("level") : nullptr;
  if (q != nullptr && level != nullptr) {
    q->fail("both q and level", "one of them");
  }
  if (level != nullptr) {
    spec.level = level->number();
    if (!(spec.level > 0.0 && spec.level < 1.0)) {
      level->fail(shortest(spec.level), "a number between 0 and 1");
    }
  }
  if (spec.method == RegionMethod::kSelfNormalised) {
    if (q != nullptr) {
      q->fail("q", "level: the method self_normalised has no strings");
    }
    return;
  }
  const bool lscr = spec.method == RegionMethod::kFullResidual || spec.method == RegionMethod::kPaper;
  const int most = lscr ? spec.members / (2 * spec.channels) : spec.members - 1;
  if (q != nullptr) {
    spec.excluded = bounded_integer(*q, 1, kMaxCount);
    if (spec.excluded > most) {
      q->fail(std::to_string(spec.excluded),
              "1 to " + std::to_string(most) + (lscr ? " = M / (2 channels)" : " = M - 1"));
    }
    spec.level = lscr ? 1.0 - 2.0 * spec.channels * spec.excluded / spec.members
                      : 1.0 - static_cast<double>(spec.excluded) / spec.members;
    return;
  }
  spec.excluded = lscr ? region::excluded_for_level(spec.level, spec.members, spec.channels)
                       : region::excluded_for_joint_level(spec.level, spec.members);
  if (spec.excluded < 1) {
    const std::string found = "level " + shortest(spec.level) + " with M = " + std::to_string(spec.members);
    const std::string expected = "a larger M or a lower level, so that q is at least 1";
    if (level != nullptr) {
      level->fail(found, expected);
    }
    throw Error({"method.level", found, expected});
  }
}

void read_method(const Node* method, RegionSpec& spec) {
  spec.channels = spec.period;
  if (method != nullptr) {
    if (const Node* node = method->find("name")) {
      spec.method = static_cast<RegionMethod>(position(*node, kMethodNames));
    }
    if (const Node* node = method->find("M")) {
      spec.members = bounded_integer(*node, 2, kMaxMembers);
    }
    if (const Node* node = method->find("channels")) {
      spec.channels = bounded_integer(*node, 1, kMaxOrder);
      if (spec.method == RegionMethod::kPaper && spec.channels != spec.period) {
        node->fail(std::to_string(spec.channels),
                   "the period, " + std::to_string(spec.period) + ", with the method paper_lscr");
      }
    }
    if (const Node* node = method->find("rho2")) {
      spec.rho2 = node->number();
      if (!(*spec.rho2 > 0.0)) {
        node->fail(shortest(*spec.rho2), "a positive number");
      }
    }
    if (const Node* node = method->find("psi")) {
      constexpr std::array<std::string_view, 2> kNames{"corrected", "printed"};
      spec.known_terms =
          position(*node, kNames) == 0 ? region::KnownTerms::kOnce : region::KnownTerms::kPrinted;
    }
    if (const Node* node = method->find("seed")) {
      const std::int64_t seed = node->integer();
      if (seed < 0) {
        node->fail(std::to_string(seed), "a whole number, at least 0");
      }
      spec.seed = static_cast<std::uint64_t>(seed);
    }
    read_filter(*method, spec);
    const auto unknowns = static_cast<int>(region::unknown_count(spec.model));
    if (spec.method == RegionMethod::kEllipsoid && spec.channels != unknowns) {
      method->fail(
          std::to_string(spec.channels) + " channels",
          "as many as unknown coefficients, " + std::to_string(unknowns) + ", with the method ellipsoid");
    }
  }
  read_level(method, spec);
}

void read_simulation(const Node& node, RegionSpec& spec) {
  if (const Node* item = node.find("feedback")) {
    spec.feedback = static_cast<region::LoopFeedback>(position(*item, region::kFeedbackNames));
  }
  if (const Node* item = node.find("noise")) {
    spec.noise = static_cast<region::LoopNoise>(position(*item, region::kNoiseNames));
  }
  if (const Node* item = node.find("probe")) {
    spec.probe_law = static_cast<region::ProbeLaw>(position(*item, region::kProbeNames));
  }
  if (const Node* item = node.find("probes")) {
    spec.simulated_probes = bounded_integer(*item, 1, kMaxCount);
  }
  if (const Node* item = node.find("pole")) {
    spec.pole = item->number();
  }
}

/// A cell that is there.
bool filled(const CsvTable& table, std::size_t row, std::size_t column) {
  return column < table.rows[row].size() && !table.rows[row][column].empty();
}

}  // namespace

std::string_view to_string(RegionMethod method) { return kMethodNames[static_cast<std::size_t>(method)]; }

region::LoopExperiment RegionSpec::experiment() const {
  require(truth.has_value(), "truth", "no table", "the unknown coefficients, to simulate with");
  region::LoopExperiment result;
  result.plant = region::complete(model, *truth);
  result.model = model;
  result.feedback = feedback;
  result.noise = noise;
  result.probe = probe_law;
  result.period = period;
  result.probes = simulated_probes;
  result.gain = gain;
  result.pole = pole;
  return result;
}

const char* region_spec_help() {
  return R"(Region file (TOML, or the same tree as JSON):
  title = "..."
  [plant]    y_t + a1 y_(t-1) + ... = b_delay u_(t-delay) + ... + b_nb u_(t-nb) + v_t
    na, nb      orders: highest index of a and of b
    delay       l, samples (default 1)
    known       table of known coefficients, { a2 = 1.0, b2 = 1.6 }; all others are estimated
  [probe]
    period      s, samples from probe to probe (default: number of unknown coefficients)
    first_time  time of the input that carries the first probe (default -delay)
    gain        beta: the input contains gain * probe (default 1; matters for psi = "printed" and simulate)
    first       first probe used, from 0 (default 0)
    count       number of probes used (default: all with a complete group of outputs)
  [columns]  t, u, y, probe: names of the columns of the data file (default: the same)
  [method]
    name        full_residual_lscr (default), paper_lscr, sps, ellipsoid, self_normalised
    M           members: strings + 1 (default 480); m of sps
    q or level  members left out, or the joint level wanted (default level = 0.95)
    channels    residual channels (default: period)
    filter      none (default), mean, trend, periodic (with filter_period), fir (with filter_taps)
    psi         paper_lscr only: corrected (default) or printed
    rho2        self_normalised only: scale fixed beforehand (default: number of probes)
    seed        of the strings and of the order that breaks ties (default 1)
  [truth]    optional: every unknown coefficient, { a1 = -2.0, b1 = 1.0 }; gives contains_truth
  [simulation]  for `region simulate`
    feedback    none, dead_beat (default), placed, self_tuning, adversarial
    pole        of placed and self_tuning (default 0.5)
    noise       gaussian_bias (default), constant, half, deterministic, cauchy, cauchy_cubed, growing, ramp,
                reacting, zero
    probe       signs (default), uniform
    probes      number (default 480)
Data file (CSV with a header): t consecutive whole numbers; u inputs as applied; y outputs (may be empty before
the first group); probe: Delta_n in the row of the input it was added to, empty or 0 in all others.)";
}

RegionSpec read_region_spec(const std::filesystem::path& file) {
  const Document document = Document::load(file);
  const Node& root = document.root();
  RegionSpec spec;
  if (const Node* title = root.find("title")) {
    spec.title = title->text();
  }
  read_plant(root.at("plant"), spec.model);
  read_probe(root.find("probe"), spec);
  if (const Node* columns = root.find("columns")) {
    const auto read = [&](const char* key, std::string& name) {
      if (const Node* node = columns->find(key)) {
        name = node->text();
      }
    };
    read("t", spec.column_t);
    read("u", spec.column_u);
    read("y", spec.column_y);
    read("probe", spec.column_probe);
  }
  read_method(root.find("method"), spec);
  if (const Node* truth = root.find("truth")) {
    read_truth(*truth, spec);
  }
  if (const Node* simulation = root.find("simulation")) {
    read_simulation(*simulation, spec);
  }
  document.reject_unknown();
  return spec;
}

region::ProbedRecord read_probed_record(const std::filesystem::path& file, const RegionSpec& spec) {
  const CsvTable table = read_csv(file);
  const std::size_t t = table.column(spec.column_t);
  const std::size_t u = table.column(spec.column_u);
  const std::size_t y = table.column(spec.column_y);
  const std::size_t probe = table.column(spec.column_probe);
  const std::size_t rows = table.rows.size();
  require(rows > 0, table.file, "no row of data", "at least one");
  const double first = table.number(0, t);
  require(first == std::floor(first) && std::abs(first) <= kMaxCount, table.where(0) + ": " + spec.column_t,
          shortest(first), "a whole number");
  region::ProbedRecord record;
  record.first_time = static_cast<int>(first);
  record.period = spec.period;
  record.gain = spec.gain;
  record.first_probe_time = spec.first_time + spec.first_probe * spec.period;
  record.y.setZero(static_cast<Eigen::Index>(rows));
  record.u.setZero(static_cast<Eigen::Index>(rows));
  const int last = record.first_time + static_cast<int>(rows) - 1;
  const int group = spec.model.delay + std::max(spec.period, spec.channels) - 1;
  std::vector<double> probes;
  for (std::size_t row = 0; row < rows; ++row) {
    const int time = record.first_time + static_cast<int>(row);
    require(table.number(row, t) == time, table.where(row) + ": " + spec.column_t,
            shortest(table.number(row, t)), std::to_string(time) + " (consecutive whole numbers)");
    if (filled(table, row, y) || time >= spec.first_time + spec.model.delay) {
      record.y(static_cast<Eigen::Index>(row)) = table.number(row, y);
    }
    if (filled(table, row, u) || time <= last - spec.model.delay) {
      record.u(static_cast<Eigen::Index>(row)) = table.number(row, u);
    }
    const bool due = time >= spec.first_time && (time - spec.first_time) % spec.period == 0;
    if (!due) {
      require(!filled(table, row, probe) || table.number(row, probe) == 0.0,
              table.where(row) + ": " + spec.column_probe,
              filled(table, row, probe) ? table.rows[row][probe] : "",
              "empty or 0: probes are due at times " + std::to_string(spec.first_time) + " + " +
                  std::to_string(spec.period) + " n");
    } else if (time + group <= last && time >= record.first_probe_time &&
               (!spec.probe_count || static_cast<int>(probes.size()) < *spec.probe_count)) {
      probes.push_back(table.number(row, probe));
    }
  }
  require(record.first_time <= record.first_probe_time, table.where(0) + ": " + spec.column_t,
          "the first time " + std::to_string(record.first_time),
          "a record from the first probe on, time " + std::to_string(record.first_probe_time) +
              " (see probe.first_time)");
  require(!probes.empty(), table.file, "no probe with a complete group of outputs",
          "at least one: the first is due at time " + std::to_string(record.first_probe_time));
  require(!spec.probe_count || static_cast<int>(probes.size()) == *spec.probe_count, table.file,
          std::to_string(probes.size()) + " probes",
          "probe.count = " + std::to_string(spec.probe_count.value_or(0)));
  record.probe = Eigen::Map<const Eigen::VectorXd>(probes.data(), static_cast<Eigen::Index>(probes.size()));
  return record;
}

std::string format_probed_record(const region::ProbedRecord& record) {
  std::string text = "t,u,y,probe\n";
  for (Eigen::Index k = 0; k < record.y.size(); ++k) {
    const int time = record.first_time + static_cast<int>(k);
    const int since = time - record.first_probe_time;
    text += std::to_string(time) + "," + shortest(record.u(k)) + "," + shortest(record.y(k)) + ",";
    if (since >= 0 && since % record.period == 0 && since / record.period < record.probe.size()) {
      text += shortest(record.probe(since / record.period));
    }
    text += "\n";
  }
  return text;
}

}  // namespace trammel::io
