// SPDX-License-Identifier: Apache-2.0
#include "filter_file.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <optional>

#include <nlohmann/json.hpp>

#include "filter_rules.hpp"
#include "trammel/core/error.hpp"
#include "trammel/filter/batch_bound.hpp"

namespace trammel::io {

namespace {

using filter::FilterMode;
using filter::FilterSpecification;
using filter::Polynomial;

int small_integer(const Node& node, int low, int high) {
  const std::int64_t value = node.integer();
  if (value < low || value > high) {
    node.fail(node.describe(), "a whole number from " + std::to_string(low) + " to " + std::to_string(high));
  }
  return static_cast<int>(value);
}

double positive(const Node& node) {
  const double value = node.number();
  if (!(value > 0.0)) {
    node.fail(node.describe(), "a positive number");
  }
  return value;
}

Polynomial polynomial(const Node& node) {
  const std::vector<double> values =
      node.kind() == Node::Kind::kNumber ? std::vector<double>{node.number()} : node.numbers();
  if (values.empty()) {
    node.fail("an empty list", "coefficients in ascending powers of z^-1");
  }
  return Eigen::Map<const Polynomial>(values.data(), static_cast<Eigen::Index>(values.size()));
}

std::vector<Polynomial> polynomials(const Node& node, int rows) {
  std::vector<Polynomial> list;
  for (const Node& item : node.items()) {
    list.push_back(polynomial(item));
  }
  if (static_cast<int>(list.size()) != rows) {
    node.fail(std::to_string(list.size()) + " polynomials", std::to_string(rows) + ", one per row");
  }
  return list;
}

/// Exactly one of the three ways to give the coefficients.
void require_one_way(const Node& root) {
  const bool gains = root.has("gains");
  const bool lists = root.has("a") || root.has("b");
  const bool rule = root.has("rule");
  const int ways = int{gains} + int{lists} + int{rule};
  if (ways != 1) {
    root.fail(ways == 0 ? "neither gains, nor a and b, nor rule" : "more than one of gains, a and b, rule",
              "exactly one way to give the coefficients: gains = [..], or a = [[..]..] and b = [[..]..], "
              "or rule = {name = ..}");
  }
}

FilterSpecification read_specification(const Node& root, FilterFile& file) {
  FilterSpecification specification;
  specification.order = small_integer(root.at("order"), 1, filter::kMaxOrder);
  specification.rows = specification.order;
  if (const Node* rows = root.find("rows")) {
    specification.rows = small_integer(*rows, 1, specification.order);
  }
  specification.sampling_s = positive(root.at("sampling_s"));
  if (const Node* mode = root.find("mode")) {
    specification.mode = mode->choice({"derivatives", "differences"}) == "derivatives"
                             ? FilterMode::kDerivatives
                             : FilterMode::kDifferences;
  }
  require_one_way(root);
  Eigen::VectorXd gains;
  if (const Node* list = root.find("gains")) {
    gains = list->vector(specification.rows);
  } else if (const Node* rule = root.find("rule")) {
    if (specification.rows != specification.order || specification.mode != FilterMode::kDerivatives) {
      rule->fail("a rule with rows below order or mode \"differences\"",
                 "rows = order and mode \"derivatives\": the rules are for these filters");
    }
    gains = apply_rule(*rule, specification.order, specification.sampling_s, file);
  } else {
    specification.a = root.has("a") ? polynomials(root.at("a"), specification.rows)
                                    : std::vector<Polynomial>(static_cast<std::size_t>(specification.rows),
                                                              filter::constant(1.0));
    specification.b = polynomials(root.at("b"), specification.rows);
    for (std::size_t i = 0; i < specification.a.size(); ++i) {
      if (specification.a[i][0] != 1.0) {
        const Node& given = root.at("a").items()[i];
        given.fail("a first coefficient of " + nlohmann::json(specification.a[i][0]).dump(),
                   "exactly 1: otherwise the prediction would need the present estimate");
      }
    }
    return specification;
  }
  const FilterMode mode = specification.mode;
  return filter::from_gains(specification.order, specification.sampling_s, gains, mode);
}

/// With a bound, the batch estimate of a window that is long enough, where that takes about a second.
void set_default_window(FilterFile& file) {
  constexpr int kLargestOrder = 3;
  constexpr int kMostSamples = 60;
  const FilterSpecification& s = file.specification;
  if (!file.bound || file.batch_samples || s.order > kLargestOrder) {
    return;
  }
  const double index =
      file.bound->derivative_bound * std::pow(s.sampling_s, s.order) / file.bound->measurement_std;
  if (index > 0.0 && std::isfinite(index)) {
    const int samples = filter::sufficient_samples(s.order, index);
    file.batch_samples = samples <= kMostSamples ? std::optional(samples) : std::nullopt;
  }
}

void read_run(const Node& run, FilterFile& file) {
  const auto not_negative = [](const Node& node) {
    const double value = node.number();
    if (value < 0.0) {
      node.fail(node.describe(), "zero or a positive number");
    }
    return value;
  };
  if (const Node* gate = run.find("gate")) {
    file.tracker.gate = not_negative(*gate);
  }
  if (const Node* count = run.find("max_rejections")) {
    constexpr int kMost = 1000000;
    file.tracker.max_rejections = small_integer(*count, 0, kMost);
  }
  if (const Node* memory = run.find("memory_s")) {
    file.tracker.memory_s = positive(*memory);
    file.use_fading_memory = true;
    file.memory_given = true;
  }
}

}  // namespace

std::string filter_file_help() {
  return "Design file (TOML, or the same as JSON):\n"
         "  order = v               order of astatism, 1 to 10: degree v - 1 is tracked without steady "
         "error\n"
         "  rows = k                estimated rows x, x', .., 1 to v; default v\n"
         "  sampling_s = T          interval between samples\n"
         "  mode = \"derivatives\"    (default) or \"differences\", the published diagonal form\n"
         "and exactly one of\n"
         "  gains = [k1, ..]        correction of row i is k_i/((i-1)! T^(i-1)) times the innovation:\n"
         "                          alpha, beta/T, gamma/(2 T^2), ..\n"
         "  a = [[1, ..], ..], b = [[..], ..]   polynomials in z^-1, one per row; a default 1\n"
         "  rule = {name = \"..\", ..}  (rows = order, mode derivatives)\n" +
         rules_help() +
         "optional\n"
         "  bound = {derivative_bound = w, measurement_std = s}   |x^(v)| <= w: guaranteed errors\n"
         "  batch = {samples = N}   with a bound: what any filter of the last N samples can reach; default "
         "a\n"
         "                          window that is long enough, up to order 3 and 60 samples\n"
         "  run = {gate = c, max_rejections = n, memory_s = tau}   for `filter run`\n";
}

FilterFile read_filter_file(const Document& document) {
  const Node& root = document.root();
  FilterFile file;
  if (const Node* bound = root.find("bound")) {
    file.bound =
        ManoeuvreBound{positive(bound->at("derivative_bound")), positive(bound->at("measurement_std"))};
  }
  file.specification = read_specification(root, file);
  file.tracker.sampling_s = file.specification.sampling_s;
  if (const Node* batch = root.find("batch")) {
    constexpr int kMostSamples = 2000;
    file.batch_samples = small_integer(batch->at("samples"), file.specification.order, kMostSamples);
    if (!file.bound) {
      batch->fail("a batch window without a bound",
                  "bound = {derivative_bound, measurement_std}, or the rule \"guaranteed\" with them");
    }
  }
  set_default_window(file);
  if (const Node* run = root.find("run")) {
    read_run(*run, file);
  }
  (void)root.find("title");
  document.reject_unknown();
  return file;
}

}  // namespace trammel::io
