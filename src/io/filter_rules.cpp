// SPDX-License-Identifier: Apache-2.0
#include "filter_rules.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <string_view>

#include "trammel/core/error.hpp"
#include "trammel/filter/guaranteed_rule.hpp"
#include "trammel/filter/rules.hpp"

namespace trammel::io {

namespace {

using filter::ProcessNoise;

/// What a rule reads from and where it leaves what the gains alone do not tell.
struct RuleInput {
  const Node& node;
  int order;
  double sampling_s;
  FilterFile& file;
};

double positive(const Node& node) {
  const double value = node.number();
  if (!(value > 0.0)) {
    node.fail(node.describe(), "a positive number");
  }
  return value;
}

/// Dimensionless index: `tracking_index`, or `strength` T^power / measurement_std.
double index(const RuleInput& rule, std::string_view strength, double power) {
  const Node* given = rule.node.find("tracking_index");
  if (given != nullptr) {
    if (rule.node.has(strength)) {
      rule.node.fail("both tracking_index and " + std::string(strength), "one of them");
    }
    return positive(*given);
  }
  if (!rule.node.has(strength)) {
    rule.node.fail("neither tracking_index nor " + std::string(strength),
                   "tracking_index, or " + std::string(strength) + " and measurement_std");
  }
  return positive(rule.node.at(strength)) * std::pow(rule.sampling_s, power) /
         positive(rule.node.at("measurement_std"));
}

int samples(const RuleInput& rule) {
  const Node& node = rule.node.at("samples");
  constexpr std::int64_t kMost = 1000000;
  if (node.integer() < 1 || node.integer() > kMost) {
    node.fail(node.describe(), "a whole number from 1 to 1000000");
  }
  return static_cast<int>(node.integer());
}

Eigen::VectorXd poles_rule(const RuleInput& rule) {
  const std::vector<Node>& items = rule.node.at("poles").items();
  Eigen::VectorXcd poles(static_cast<Eigen::Index>(items.size()));
  if (poles.size() != rule.order) {
    rule.node.at("poles").fail(std::to_string(poles.size()) + " poles",
                               std::to_string(rule.order) + ", as many as the order");
  }
  for (Eigen::Index i = 0; i < poles.size(); ++i) {
    const Node& item = items[static_cast<std::size_t>(i)];
    if (item.kind() == Node::Kind::kNumber) {
      poles[i] = item.number();
    } else {
      const Eigen::VectorXd parts = item.vector(2);
      poles[i] = {parts[0], parts[1]};
    }
  }
  return filter::pole_placement(poles);
}

Eigen::VectorXd fading_memory_rule(const RuleInput& rule) {
  const double theta = rule.node.at("theta").number();
  Eigen::VectorXd gains = filter::fading_memory(rule.order, theta);
  if (theta > 0.0) {
    rule.file.tracker.memory_s = -rule.sampling_s / std::log(theta);
    rule.file.use_fading_memory = true;
  }
  return gains;
}

Eigen::VectorXd expanding_memory_rule(const RuleInput& rule) {
  return filter::expanding_memory(rule.order, samples(rule));
}

Eigen::VectorXd finite_fading_memory_rule(const RuleInput& rule) {
  return filter::finite_fading_memory(rule.order, samples(rule), rule.node.at("theta").number());
}

Eigen::VectorXd kalata_rule(const RuleInput& rule) {
  return filter::kalata(rule.order, index(rule, "process_std", 2.0));
}

Eigen::VectorXd kalman_rule(const RuleInput& rule) {
  if (const Node* matrix = rule.node.find("process_noise")) {
    Eigen::MatrixXd noise = matrix->matrix();
    if (noise.rows() != rule.order || noise.cols() != rule.order) {
      matrix->fail(std::to_string(noise.rows()) + " x " + std::to_string(noise.cols()),
                   "an order x order matrix for the state x, x', ..");
    }
    const double deviation = positive(rule.node.at("measurement_std"));
    for (int i = 0; i < rule.order; ++i) {
      noise.row(i) *= std::pow(rule.sampling_s, i) / deviation;
      noise.col(i) *= std::pow(rule.sampling_s, i) / deviation;
    }
    return filter::kalman(noise);
  }
  const Node* model = rule.node.find("model");
  const std::string name =
      model == nullptr ? "discrete" : model->choice({"discrete", "continuous", "increments"});
  if (name == "continuous") {
    return filter::kalman(rule.order, ProcessNoise::kContinuous,
                          index(rule, "process_density_root", rule.order - 0.5));
  }
  if (name == "increments") {
    return filter::kalman(rule.order, ProcessNoise::kIncrements, index(rule, "process_std", rule.order - 1));
  }
  return filter::kalman(rule.order, ProcessNoise::kDiscrete, index(rule, "process_std", rule.order));
}

Eigen::VectorXd benedict_bordner_rule(const RuleInput& rule) {
  if (rule.order != 2) {
    rule.node.fail("order " + std::to_string(rule.order), "order 2 for this rule");
  }
  if (const Node* alpha = rule.node.find("alpha")) {
    return filter::benedict_bordner(alpha->number());
  }
  return filter::benedict_bordner_from_index(index(rule, "process_std", 1.0));
}

Eigen::VectorXd minimum_noise_rule(const RuleInput& rule) {
  const Node* target = rule.node.find("target");
  const bool predicted = target == nullptr || target->choice({"predicted", "filtered"}) == "predicted";
  const double unit = std::pow(rule.sampling_s, rule.order);
  if (predicted) {
    const Node* given = rule.node.find("b");
    const double b = given != nullptr ? positive(*given)
                                      : std::pow(unit / positive(rule.node.at("lag")), 1.0 / rule.order);
    return filter::minimum_noise_prediction(rule.order, b);
  }
  return filter::minimum_noise_estimate(rule.order, rule.node.at("lag").number() / unit);
}

Eigen::VectorXd guaranteed_rule(const RuleInput& rule) {
  filter::GuaranteedGoal goal;
  goal.order = rule.order;
  goal.index = index(rule, "derivative_bound", rule.order);
  const bool physical = rule.node.has("derivative_bound");
  if (const Node* target = rule.node.find("target")) {
    const std::string name = target->choice({"filtered", "predicted", "velocity", "acceleration"});
    goal.output.predicted = name == "predicted";
    goal.output.row = name == "velocity" ? 1 : name == "acceleration" ? 2 : 0;
    if (goal.output.row >= rule.order) {
      target->fail(target->describe(), "a row below the order");
    }
  }
  if (const Node* manoeuvre = rule.node.find("manoeuvre")) {
    const std::string name = manoeuvre->choice({"arbitrary", "piecewise_constant", "constant"});
    goal.manoeuvre = name == "arbitrary"  ? filter::Manoeuvre::kArbitrary
                     : name == "constant" ? filter::Manoeuvre::kConstant
                                          : filter::Manoeuvre::kPiecewiseConstant;
  }
  if (const Node* family = rule.node.find("family")) {
    const std::string name = family->choice({"free", "critically_damped", "kalata", "benedict_bordner"});
    goal.family = name == "free"                ? filter::GainFamily::kFree
                  : name == "critically_damped" ? filter::GainFamily::kCriticallyDamped
                  : name == "kalata"            ? filter::GainFamily::kKalata
                                                : filter::GainFamily::kBenedictBordner;
  }
  const filter::GuaranteedGains choice = filter::guaranteed_gains(goal);
  double unit = std::pow(rule.sampling_s, -2.0 * goal.output.row);
  ManoeuvreBound bound{goal.index / std::pow(rule.sampling_s, rule.order), 1.0};
  if (physical) {
    bound = {rule.node.at("derivative_bound").number(), rule.node.at("measurement_std").number()};
    unit *= bound.measurement_std * bound.measurement_std;
  }
  rule.file.goal = goal.output;
  rule.file.guaranteed_mse = choice.mean_square_error * unit;
  rule.file.bound = bound;
  return choice.gains;
}

struct RuleEntry {
  std::string_view name;
  Eigen::VectorXd (*apply)(const RuleInput&);
  std::string_view help;
};

constexpr std::array<RuleEntry, 10> kRules{{
    {"fading_memory", fading_memory_rule,
     "theta (0 to below 1): all poles at theta, least squares with weight theta^age"},
    {"critically_damped", fading_memory_rule, "theta: the same under its other name"},
    {"poles", poles_rule, "poles = [p1, [re, im], ..]: poles at these places"},
    {"expanding_memory", expanding_memory_rule, "samples = n: gains of the n-th sample at start-up"},
    {"finite_fading_memory", finite_fading_memory_rule,
     "theta, samples = n: gains of the n-th sample of fading memory"},
    {"kalata", kalata_rule,
     "tracking_index = s_w T^2/s, or process_std (acceleration) and measurement_std; order 1 to 3"},
    {"kalman", kalman_rule,
     "model = \"discrete\" (default; index s_w T^v/s), \"increments\" (s_w T^(v-1)/s), \"continuous\"\n"
     "      (sqrt(q_c T^(2v-1))/s): tracking_index, or process_std (continuous: process_density_root =\n"
     "      sqrt q_c) and measurement_std; or process_noise = [[..]..] for x, x', .. and measurement_std"},
    {"benedict_bordner", benedict_bordner_rule,
     "alpha, or tracking_index = s_dv T/s, or process_std (velocity step) and measurement_std; order 2"},
    {"minimum_noise", minimum_noise_rule,
     "target = \"predicted\" (default) or \"filtered\"; lag = steady error of the\n"
     "      coordinate per unit x^(v), s^v (predicted: or b, lag = (T/b)^v, 0 < b < 2): least noise for it"},
    {"guaranteed", guaranteed_rule,
     "tracking_index = w T^v/s, or derivative_bound = w and measurement_std = s; order 1 to 3;\n"
     "      target = \"filtered\" (default), \"predicted\", \"velocity\", \"acceleration\"; manoeuvre =\n"
     "      \"arbitrary\" (default), \"piecewise_constant\", \"constant\"; family = \"free\" (default),\n"
     "      \"critically_damped\", \"kalata\", \"benedict_bordner\": least worst-case mean-square error"},
}};

}  // namespace

Eigen::VectorXd apply_rule(const Node& rule, int order, double sampling_s, FilterFile& file) {
  const Node& name = rule.at("name");
  std::string wanted = name.text();
  std::replace(wanted.begin(), wanted.end(), '-', '_');
  std::string known;
  for (const RuleEntry& entry : kRules) {
    if (wanted == entry.name) {
      try {
        file.rule = wanted;
        return entry.apply({rule, order, sampling_s, file});
      } catch (const Error& error) {
        // A rule names its argument; say which file it stands in.
        if (error.detail().where.starts_with(rule.where())) {
          throw;
        }
        rule.fail(error.detail().where + " = " + error.detail().found, error.detail().expected);
      }
    }
    known += (known.empty() ? "\"" : ", \"") + std::string(entry.name) + "\"";
  }
  name.fail(name.describe(), "one of " + known);
}

std::string rules_help() {
  std::string text;
  for (const RuleEntry& entry : kRules) {
    text += "    " + std::string(entry.name) + ": " + std::string(entry.help) + "\n";
  }
  return text;
}

}  // namespace trammel::io
