// SPDX-License-Identifier: Apache-2.0
#include "region_result.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/region/loop_experiment.hpp"
#include "trammel/region/lscr.hpp"
#include "trammel/region/planar.hpp"
#include "trammel/region/self_normalised.hpp"
#include "trammel/region/sps.hpp"
#include "trammel/region/support.hpp"

namespace trammel::program {

namespace {

using io::Json;
using io::RegionMethod;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What a region was found to be, in its own parameters.
struct Findings {
  std::vector<std::string> names;
  region::Guarantee guarantee;
  region::InstrumentalEstimate estimate;
  Eigen::VectorXd lower;
  Eigen::VectorXd upper;
  bool box_exact = false;
  bool box_tight = true;
  bool empty = false;
  std::optional<region::PlanarRegion> polygon;
  std::vector<region::IntervalList> sections;  ///< through the estimate, along each parameter
  std::optional<bool> contains_truth;
};

Json interval_json(double lower, double upper) {
  return Json::array({io::to_json(lower), io::to_json(upper)});
}

Json named(const std::vector<std::string>& names, const Eigen::VectorXd& values) {
  Json object = Json::object();
  for (std::size_t k = 0; k < names.size(); ++k) {
    object[names[k]] = io::to_json(values(static_cast<Eigen::Index>(k)));
  }
  return object;
}

Json named_intervals(const std::vector<std::string>& names, const Eigen::VectorXd& lower,
                     const Eigen::VectorXd& upper) {
  Json object = Json::object();
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto index = static_cast<Eigen::Index>(k);
    object[names[k]] = interval_json(lower(index), upper(index));
  }
  return object;
}

Json polygon_json(const region::PlanarRegion& polygon) {
  Json components = Json::array();
  for (int c = 0; c < polygon.components(); ++c) {
    Json vertices = Json::array();
    for (int k = polygon.first_vertex[static_cast<std::size_t>(c)];
         k < polygon.first_vertex[static_cast<std::size_t>(c) + 1]; ++k) {
      const Eigen::Vector2d& vertex = polygon.vertices[static_cast<std::size_t>(k)];
      vertices.push_back(Json::array({vertex(0), vertex(1)}));
    }
    components.push_back(std::move(vertices));
  }
  return components;
}

/// Size of the sums at the estimate: root of the sum of squares of the largest channel.
double spread_of(const region::ProbedResiduals& residuals, const region::InstrumentalEstimate& estimate) {
  if (!estimate.parameters.allFinite()) {
    return 1.0;
  }
  Eigen::VectorXd point(residuals.width());
  point << 1.0, -estimate.parameters;
  double largest = 0.0;
  for (int i = 0; i < residuals.channels; ++i) {
    const auto columns = residuals.values.middleCols(i * residuals.width(), residuals.width());
    largest = std::max(largest, (columns * point).norm());
  }
  return largest > 0.0 ? largest : 1.0;
}

/// Box and polygon of any region.
template <region::ConfidenceRegion Region>
void summarise(const Region& item, double spread, Findings& out) {
  const Eigen::Index d = item.dimension();
  out.guarantee = item.guarantee();
  out.lower.setConstant(d, -kInfinity);
  out.upper.setConstant(d, kInfinity);
  const Eigen::VectorXd centre = out.estimate.parameters.allFinite()
                                     ? out.estimate.parameters
                                     : Eigen::VectorXd(Eigen::VectorXd::Zero(d));
  for (Eigen::Index k = 0; k < d; ++k) {
    region::IntervalList list;
    item.section(centre, Eigen::VectorXd::Unit(d, k), list);
    for (region::Interval& interval : list) {
      interval.lower += centre(k);
      interval.upper += centre(k);
    }
    out.sections.push_back(std::move(list));
  }
  if (d == 1) {  // the section is the region
    const region::IntervalList& list = out.sections.front();
    out.box_exact = true;
    out.empty = list.empty();
    out.lower(0) = list.empty() ? kInfinity : list.front().lower;
    out.upper(0) = list.empty() ? -kInfinity : list.back().upper;
    return;
  }
  if constexpr (std::is_same_v<Region, region::LscrRegion>) {
    region::PlanarWork work;
    region::PlanarRegion polygon;
    if (d == 2 && region::exact_polygon(item, work, polygon)) {
      out.lower = polygon.lower;
      out.upper = polygon.upper;
      out.empty = polygon.bounded && polygon.components() == 0;
      out.box_exact = true;
      out.polygon = std::move(polygon);
      return;
    }
  }
  if constexpr (std::is_same_v<Region, region::EllipsoidRegion>) {
    out.lower = item.centre() - item.half_widths();
    out.upper = item.centre() + item.half_widths();
    out.box_exact = true;
  }
  const region::SearchFrame frame = region::search_frame(out.estimate, spread);
  if (d == 2) {
    out.polygon = region::outer_polygon(item, frame);
    out.empty = out.polygon->bounded && out.polygon->components() == 0;
  }
  if (!out.box_exact) {
    const region::OuterBox box = region::outer_box(item, frame);
    out.lower = box.lower;
    out.upper = box.upper;
    out.box_tight = box.tight;
    out.empty = out.empty || (box.upper.array() < box.lower.array()).any();
  }
}

/// Strings and tie order from the seed, as for run 0 of an experiment.
struct Randomisation {
  Randomisation(std::uint64_t seed, int members, int length, bool distinct) {
    RandomStream random =
        region::run_stream(seed, 0, distinct ? region::DrawPurpose::kStrings : region::DrawPurpose::kSigns);
    RandomStream ties = region::run_stream(seed, 0, region::DrawPurpose::kTies);
    strings.resize(members - 1, length);
    if (distinct) {
      region::draw_distinct_strings(random, strings);
    } else {
      region::draw_strings(random, strings);
    }
    region::draw_tie_flags(ties, members, after_reference);
  }
  region::BinaryStrings strings;
  std::vector<char> after_reference;
};

struct RegionOutcome {
  Findings findings;
  std::optional<region::EllipsoidRegion> ellipsoid;
};

RegionOutcome build(const io::RegionSpec& spec, const region::ProbedRecord& record) {
  RegionOutcome outcome;
  Findings& out = outcome.findings;
  region::ProbedResiduals residuals;
  const bool published = spec.method == RegionMethod::kPaper;
  std::optional<Eigen::VectorXd> truth = spec.truth;
  if (published) {
    region::prediction_residuals(spec.model, record, spec.known_terms, residuals);
    for (int k = 1; k <= residuals.dimension; ++k) {
      out.names.push_back("theta" + std::to_string(k));
    }
    if (truth) {
      truth = region::impulse_parameters(region::complete(spec.model, *truth), spec.period);
    }
  } else {
    region::plant_residuals(spec.model, record, spec.channels, spec.filter, residuals);
    out.names = region::unknown_names(spec.model);
  }
  out.estimate = region::instrumental_estimate(residuals.values.colwise().sum(), residuals.channels,
                                               residuals.dimension);
  const double spread = spread_of(residuals, out.estimate);
  const auto length = static_cast<int>(residuals.probes());
  const auto finish = [&](const auto& item) {
    summarise(item, spread, out);
    if (truth) {
      out.contains_truth = item.contains(*truth);
    }
  };
  switch (spec.method) {
    case RegionMethod::kFullResidual:
    case RegionMethod::kPaper: {
      const Randomisation random(spec.seed, spec.members, length, true);
      region::LscrRegion item;
      item.assign(residuals, random.strings, random.after_reference, spec.excluded,
                  published ? region::ResidualForm::kPrediction : region::ResidualForm::kPlant);
      finish(item);
      break;
    }
    case RegionMethod::kSps:
    case RegionMethod::kEllipsoid: {
      const Randomisation random(spec.seed, spec.members, length, false);
      region::SpsRegion item;
      item.assign(residuals, random.strings, random.after_reference, spec.excluded);
      if (item.channels() == item.dimension()) {
        outcome.ellipsoid = region::outer_ellipsoid(item);
      }
      if (spec.method == RegionMethod::kSps) {
        finish(item);
      } else {
        finish(*outcome.ellipsoid);
      }
      break;
    }
    case RegionMethod::kSelfNormalised: {
      region::SelfNormalisedRegion item;
      item.assign(residuals, (1.0 - spec.level) / residuals.channels,
                  spec.rho2.value_or(static_cast<double>(length)));
      finish(item);
      break;
    }
  }
  return outcome;
}

/// Image of a region of impulse parameters among the unknown coefficients, where the map is square.
void add_plant_image(const io::RegionSpec& spec, const Findings& found, Json& result) {
  const std::vector<std::string> names = region::unknown_names(spec.model);
  const auto d = static_cast<Eigen::Index>(names.size());
  Eigen::VectorXd lower = Eigen::VectorXd::Constant(d, -kInfinity);
  Eigen::VectorXd upper = Eigen::VectorXd::Constant(d, kInfinity);
  const region::PlantFromImpulse point =
      found.estimate.parameters.allFinite() && found.estimate.parameters.size() >= d
          ? region::plant_from_impulse(spec.model, found.estimate.parameters)
          : region::PlantFromImpulse{Eigen::VectorXd::Constant(d, std::nan("")), kInfinity, std::nan("")};
  result["parameters"] = names;
  result["estimate"] = named(names, point.parameters);
  result["estimate_condition"] = io::to_json(point.condition);
  result["polygon"] = nullptr;
  result["polygon_is"] = nullptr;
  result["area"] = nullptr;
  bool exact = false;
  if (d == 2 && found.polygon && found.names.size() == 2 && std::isfinite(point.condition)) {
    const region::PlantImage image = region::plant_image(*found.polygon, spec.model);
    lower = image.outline.lower;
    upper = image.outline.upper;
    exact = found.polygon->exact;
    result["polygon"] = image.outline.bounded ? polygon_json(image.outline) : Json(nullptr);
    result["polygon_is"] = exact ? "exact_vertices" : "outer_vertices";
    result["area"] = io::to_json(image.area);
  } else if (d == 1 && found.names.size() == 1 && std::isfinite(point.condition)) {
    // One parameter: b_l = theta_1, apart from known terms an affine map.
    const auto at = [&](double theta) {
      return std::isinf(theta)
                 ? theta
                 : region::plant_from_impulse(spec.model, Eigen::VectorXd::Constant(1, theta)).parameters(0);
    };
    lower(0) = at(found.lower(0));
    upper(0) = at(found.upper(0));
    exact = true;
  }
  result["box"] = named_intervals(names, lower, upper);
  result["box_is"] = exact ? "exact" : "outer";
}

Json guarantee_json(const region::Guarantee& guarantee) {
  Json json;
  json["method"] = guarantee.method;
  json["source"] = guarantee.source;
  json["level"] = guarantee.level;
  json["level_is"] = region::to_string(guarantee.level_kind);
  const bool channels = std::isfinite(guarantee.channel_level);
  json["channel_level"] = io::to_json(guarantee.channel_level);
  json["channel_level_is"] = channels ? Json(region::to_string(guarantee.channel_kind)) : Json(nullptr);
  const region::LevelKind kind = channels ? guarantee.channel_kind : guarantee.level_kind;
  json["exact"] = kind == region::LevelKind::kExact;
  json["assumptions"] = Json::array();
  for (const region::Assumption& assumption : guarantee.assumptions) {
    json["assumptions"].push_back({{"name", assumption.name}, {"text", assumption.text}});
  }
  return json;
}

Json findings_json(const Findings& found) {
  Json json;
  json["parameters"] = found.names;
  json["estimate"] = named(found.names, found.estimate.parameters);
  json["estimate_condition"] = io::to_json(found.estimate.condition);
  json["box"] = named_intervals(found.names, found.lower, found.upper);
  json["box_is"] = found.box_exact ? "exact" : "outer";
  json["box_tight"] = found.box_tight;
  const bool drawn = found.polygon && found.polygon->bounded;
  json["polygon"] = drawn ? polygon_json(*found.polygon) : Json(nullptr);
  json["polygon_is"] = found.polygon ? Json(found.polygon->exact ? "exact" : "outer") : Json(nullptr);
  json["area"] = found.polygon ? io::to_json(found.polygon->area) : Json(nullptr);
  json["sections"] = Json::object();
  for (std::size_t k = 0; k < found.names.size(); ++k) {
    Json list = Json::array();
    for (const region::Interval& interval : found.sections[k]) {
      list.push_back(interval_json(interval.lower, interval.upper));
    }
    json["sections"][found.names[k]] = std::move(list);
  }
  return json;
}

}  // namespace

Json region_result(const io::RegionSpec& spec, const region::ProbedRecord& record) {
  const RegionOutcome outcome = build(spec, record);
  const Findings& found = outcome.findings;
  Json result;
  const bool bounded = found.lower.allFinite() && found.upper.allFinite();
  result["status"] = found.empty ? "empty" : (bounded ? "bounded" : "unbounded");
  result["title"] = spec.title;
  result.update(guarantee_json(found.guarantee));
  const bool strings = spec.method != RegionMethod::kSelfNormalised;
  result["M"] = strings ? Json(spec.members) : Json(nullptr);
  result["q"] = strings ? Json(spec.excluded) : Json(nullptr);
  result["seed"] = strings ? Json(spec.seed) : Json(nullptr);
  result["period"] = spec.period;
  result["channels"] = spec.channels;
  result["probes"] = record.probe.size();
  const Json own = findings_json(found);
  result.update(own);
  if (spec.method == RegionMethod::kPaper) {
    add_plant_image(spec, found, result);
    result["theta"] = own;
    result.erase("sections");
    result.erase("box_tight");
    for (const auto& [name, interval] : result["box"].items()) {
      if (!found.empty && (interval[0].is_null() || interval[1].is_null())) {
        result["status"] = "unbounded";
      }
    }
  }
  if (outcome.ellipsoid) {
    const region::EllipsoidRegion& ellipsoid = *outcome.ellipsoid;
    result["ellipsoid"] = {{"centre", io::to_json(ellipsoid.centre())},
                           {"matrix", io::matrix_to_json(ellipsoid.matrix())},
                           {"gamma", io::to_json(ellipsoid.gamma())},
                           {"half_widths", io::to_json(ellipsoid.half_widths())},
                           {"volume", io::to_json(ellipsoid.volume())}};
  } else {
    result["ellipsoid"] = nullptr;
  }
  result["contains_truth"] = found.contains_truth ? Json(*found.contains_truth) : Json(nullptr);
  return result;
}

std::string region_text(const Json& result) {
  const auto number = [](const Json& value, const char* missing) {
    return value.is_null() ? std::string(missing) : io::Json(value).dump();
  };
  std::string text;
  text += "method       " + result["method"].get<std::string>() + " (" + result["source"].get<std::string>() +
          ")\n";
  text += "level        " + number(result["level"], "-") + " (" + result["level_is"].get<std::string>() + ")";
  if (!result["channel_level"].is_null()) {
    text += ", each channel " + number(result["channel_level"], "-") + " (" +
            result["channel_level_is"].get<std::string>() + ")";
  }
  text += "\n";
  for (const Json& assumption : result["assumptions"]) {
    text += "assumes      " + assumption["text"].get<std::string>() + "\n";
  }
  text += "probes       " + number(result["probes"], "-") + "\n";
  text += "region       " + result["status"].get<std::string>() + ", box " +
          result["box_is"].get<std::string>() + "\n";
  for (const auto& [name, interval] : result["box"].items()) {
    text += "  " + name + " in (" + number(interval[0], "-infinity") + ", " +
            number(interval[1], "infinity") + "), estimate " + number(result["estimate"][name], "none") +
            "\n";
  }
  if (!result["area"].is_null()) {
    text += "area         " + number(result["area"], "-") + "\n";
  }
  if (!result["contains_truth"].is_null()) {
    text +=
        std::string("truth        ") + (result["contains_truth"].get<bool>() ? "inside" : "outside") + "\n";
  }
  return text;
}

}  // namespace trammel::program
