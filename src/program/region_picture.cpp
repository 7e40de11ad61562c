// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "region_result.hpp"
#include "trammel/core/error.hpp"
#include "trammel/region/lscr.hpp"

namespace trammel::program {

namespace {

using io::Json;
using Point = std::pair<double, double>;

constexpr double kWidth = 860.0;  // of the picture, in its own units
constexpr double kHeight = 560.0;
constexpr double kMargin = 60.0;
constexpr double kTicks = 6.0;  // roughly, per axis

/// One region to draw.
struct Layer {
  std::string name;
  std::string colour;
  std::string note;
  std::vector<std::vector<Point>> outlines;
};

std::vector<std::vector<Point>> outlines_of(const Json& components) {
  std::vector<std::vector<Point>> outlines;
  for (const Json& component : components) {
    std::vector<Point> outline;
    for (const Json& vertex : component) {
      outline.emplace_back(vertex[0].get<double>(), vertex[1].get<double>());
    }
    outlines.push_back(std::move(outline));
  }
  return outlines;
}

/// Edges straight in the plane of the impulse parameters are arcs here: points along them, mapped one by one.
std::vector<std::vector<Point>> mapped_outlines(const io::RegionSpec& spec, const Json& components) {
  constexpr int kParts = 24;
  std::vector<std::vector<Point>> outlines = outlines_of(components);
  for (std::vector<Point>& outline : outlines) {
    std::vector<Point> fine;
    for (std::size_t k = 0; k < outline.size(); ++k) {
      const Point& from = outline[k];
      const Point& to = outline[(k + 1) % outline.size()];
      for (int part = 0; part < kParts; ++part) {
        const double share = static_cast<double>(part) / kParts;
        const Eigen::Vector2d theta(from.first + share * (to.first - from.first),
                                    from.second + share * (to.second - from.second));
        const Eigen::VectorXd p = region::plant_from_impulse(spec.model, theta).parameters;
        if (p.allFinite()) {
          fine.emplace_back(p(0), p(1));
        }
      }
    }
    outline = std::move(fine);
  }
  return outlines;
}

/// Places of data on the picture.
class Axes {
 public:
  explicit Axes(const std::vector<const Layer*>& layers, const std::vector<Point>& points) {
    for (const Layer* layer : layers) {
      for (const std::vector<Point>& outline : layer->outlines) {
        std::for_each(outline.begin(), outline.end(), [this](const Point& point) { include(point); });
      }
    }
    std::for_each(points.begin(), points.end(), [this](const Point& point) { include(point); });
    constexpr double kBorder = 0.05;
    const double dx = std::max(kBorder * (high_.first - low_.first), 1e-9);
    const double dy = std::max(kBorder * (high_.second - low_.second), 1e-9);
    low_ = {low_.first - dx, low_.second - dy};
    high_ = {high_.first + dx, high_.second + dy};
  }
  [[nodiscard]] double x(double value) const {
    return kMargin + (kWidth - 2.0 * kMargin) * (value - low_.first) / (high_.first - low_.first);
  }
  [[nodiscard]] double y(double value) const {
    return kHeight - kMargin -
           (kHeight - 2.0 * kMargin) * (value - low_.second) / (high_.second - low_.second);
  }
  [[nodiscard]] std::string frame(const std::string& x_name, const std::string& y_name) const;

 private:
  void include(const Point& point) {
    low_ = {std::min(low_.first, point.first), std::min(low_.second, point.second)};
    high_ = {std::max(high_.first, point.first), std::max(high_.second, point.second)};
  }
  Point low_{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  Point high_{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
};

std::string text_of(double value, const char* format = "%.2f") {
  std::array<char, 40> buffer{};
  std::snprintf(buffer.data(), buffer.size(), format, value);
  return buffer.data();
}

/// A round number near range / kTicks.
double tick_step(double range) {
  const double raw = range / kTicks;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double lead = raw / power;
  return power * (lead < 1.5 ? 1.0 : (lead < 3.5 ? 2.0 : (lead < 7.5 ? 5.0 : 10.0)));
}

std::string Axes::frame(const std::string& x_name, const std::string& y_name) const {
  std::string svg;
  const double bottom = kHeight - kMargin;
  const double step_x = tick_step(high_.first - low_.first);
  for (double k = std::ceil(low_.first / step_x); k * step_x <= high_.first; k += 1.0) {
    const std::string at = text_of(x(k * step_x));
    svg += "<line class=\"grid\" x1=\"" + at + "\" x2=\"" + at + "\" y1=\"" + text_of(kMargin) + "\" y2=\"" +
           text_of(bottom) + "\"/><text x=\"" + at + "\" y=\"" + text_of(bottom + 18.0) +
           "\" text-anchor=\"middle\">" + text_of(k * step_x + 0.0, "%.4g") + "</text>\n";
  }
  const double step_y = tick_step(high_.second - low_.second);
  for (double k = std::ceil(low_.second / step_y); k * step_y <= high_.second; k += 1.0) {
    const std::string at = text_of(y(k * step_y));
    svg += "<line class=\"grid\" y1=\"" + at + "\" y2=\"" + at + "\" x1=\"" + text_of(kMargin) + "\" x2=\"" +
           text_of(kWidth - kMargin) + "\"/><text x=\"" + text_of(kMargin - 8.0) + "\" y=\"" + at +
           "\" dy=\"4\" text-anchor=\"end\">" + text_of(k * step_y + 0.0, "%.4g") + "</text>\n";
  }
  svg += "<text class=\"axis\" x=\"" + text_of(kWidth / 2.0) + "\" y=\"" + text_of(kHeight - 12.0) +
         "\" text-anchor=\"middle\">" + x_name + "</text><text class=\"axis\" x=\"16\" y=\"" +
         text_of(kHeight / 2.0) + "\" text-anchor=\"middle\">" + y_name + "</text>\n";
  return svg;
}

std::string draw(const Axes& axes, const Layer& layer) {
  std::string svg;
  for (const std::vector<Point>& outline : layer.outlines) {
    svg += "<polygon points=\"";
    for (const Point& point : outline) {
      svg += text_of(axes.x(point.first)) + "," + text_of(axes.y(point.second)) + " ";
    }
    svg += "\" fill=\"" + layer.colour + "\" stroke=\"" + layer.colour + "\"/>\n";
  }
  return svg;
}

/// One figure with the layers that have an outline.
std::string figure(const std::vector<const Layer*>& layers, const std::vector<std::string>& names,
                   const std::vector<Point>& truth, const std::vector<Point>& estimate,
                   const std::string& caption) {
  std::vector<Point> points = truth;
  points.insert(points.end(), estimate.begin(), estimate.end());
  const bool drawn =
      std::any_of(layers.begin(), layers.end(), [](const Layer* layer) { return !layer->outlines.empty(); });
  if (!drawn) {
    return "<p>None of these regions is bounded.</p>\n";
  }
  const Axes axes(layers, points);
  std::string svg = "<figure><svg viewBox=\"0 0 860 560\" role=\"img\">\n" + axes.frame(names[0], names[1]);
  for (const Layer* layer : layers) {
    svg += draw(axes, *layer);
  }
  for (const Point& point : estimate) {
    svg += "<circle cx=\"" + text_of(axes.x(point.first)) + "\" cy=\"" + text_of(axes.y(point.second)) +
           "\" r=\"4\" class=\"estimate\"/>\n";
  }
  for (const Point& point : truth) {
    const double x = axes.x(point.first);
    const double y = axes.y(point.second);
    svg += "<path class=\"truth\" d=\"M" + text_of(x - 7.0) + " " + text_of(y) + "H" + text_of(x + 7.0) +
           "M" + text_of(x) + " " + text_of(y - 7.0) + "V" + text_of(y + 7.0) + "\"/>\n";
  }
  return svg + "</svg><figcaption>" + caption + "</figcaption></figure>\n";
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '&':
        result += "&amp;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

constexpr const char* kStyle =
    "body{font:16px/1.5 system-ui,sans-serif;max-width:920px;margin:2em auto;padding:0 1em;color:#222;"
    "background:#fff}svg{width:100%;height:auto;border:1px solid #ddd}svg text{font-size:13px;fill:#555}"
    "svg .axis{font-size:15px;fill:#222}.grid{stroke:#e6e6e6}polygon{fill-opacity:.28;stroke-width:1.5}"
    ".truth{stroke:#000;stroke-width:2.5}.estimate{fill:#fff;stroke:#000;stroke-width:1.5}"
    "table{border-collapse:collapse;width:100%}td,th{padding:.3em .8em;border-bottom:1px solid #ddd;"
    "text-align:left}td.number{text-align:right}.key{display:inline-block;width:1em;height:1em;"
    "margin-right:.5em;vertical-align:-.1em}figure{margin:1.5em 0}figcaption{color:#555;font-size:14px}";

}  // namespace

std::string region_picture(const io::RegionSpec& spec, const region::ProbedRecord& record) {
  const std::vector<std::string> names = region::unknown_names(spec.model);
  require(names.size() == 2 && spec.period == 2, "--picture",
          std::to_string(names.size()) + " unknown coefficients and period " + std::to_string(spec.period),
          "2 and 2");
  struct Choice {
    const char* name;
    const char* colour;
    io::RegionMethod method;
    region::ResidualFilter::Kind filter;
  };
  constexpr std::array<Choice, 3> kChoices{
      {{"published form", "#8a8a8a", io::RegionMethod::kPaper, region::ResidualFilter::Kind::kNone},
       {"full residuals", "#2b6cb0", io::RegionMethod::kFullResidual, region::ResidualFilter::Kind::kNone},
       {"full residuals without mean", "#d9480f", io::RegionMethod::kFullResidual,
        region::ResidualFilter::Kind::kMean}}};
  std::vector<Layer> layers;
  std::vector<Point> estimate;
  std::string rows;
  for (const Choice& choice : kChoices) {
    io::RegionSpec one = spec;
    one.method = choice.method;
    one.filter.kind = choice.filter;
    one.channels = spec.period;
    one.excluded = std::max(1, region::excluded_for_level(spec.level, spec.members, spec.period));
    const Json result = region_result(one, record);
    Layer layer{choice.name, choice.colour, result["level_is"].get<std::string>(), {}};
    if (!result["polygon"].is_null()) {
      layer.outlines = choice.method == io::RegionMethod::kPaper
                           ? mapped_outlines(one, result["theta"]["polygon"])
                           : outlines_of(result["polygon"]);
    }
    if (choice.filter == region::ResidualFilter::Kind::kMean && !result["estimate"][names[0]].is_null()) {
      estimate.emplace_back(result["estimate"][names[0]].get<double>(),
                            result["estimate"][names[1]].get<double>());
    }
    const auto cell = [](const Json& value) {
      return value.is_null() ? std::string("unbounded") : text_of(value.get<double>(), "%.6g");
    };
    rows +=
        "<tr><td><span class=\"key\" style=\"background:" + layer.colour + "\"></span>" + layer.name +
        "</td><td class=\"number\">" + cell(result["area"]) + "</td><td class=\"number\">" +
        cell(result["level"]) + "</td><td>" + (layer.note == "at_least" ? "a lower bound" : layer.note) +
        "</td><td>" +
        (result["contains_truth"].is_null() ? "not known"
                                            : (result["contains_truth"].get<bool>() ? "inside" : "outside")) +
        "</td></tr>\n";
    layers.push_back(std::move(layer));
  }
  std::vector<Point> truth;
  if (spec.truth) {
    truth.emplace_back((*spec.truth)(0), (*spec.truth)(1));
  }
  const std::string title = spec.title.empty() ? "Confidence regions" : escaped(spec.title);
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" + title +
         "</title><style>" + kStyle + "</style></head><body><h1>" + title + "</h1>\n<p>Regions for " +
         names[0] + " and " + names[1] + " from " + std::to_string(record.probe.size()) +
         " probes, M = " + std::to_string(spec.members) +
         ". All three use the same data and the same random "
         "strings.</p>\n<table><tr><th>region</th><th>area</th>"
         "<th>joint level</th><th>the level is</th><th>truth</th></tr>\n" +
         rows + "</table>\n" +
         figure({&layers[0], &layers[1], &layers[2]}, names, truth, estimate,
                "Published form, full residuals, and full residuals without mean. Cross: true coefficients. "
                "Circle: "
                "estimate.") +
         figure({&layers[1], &layers[2]}, names, truth, estimate, "The two smaller regions, enlarged.") +
         "<p>The level of the published form is an approximation: its residuals contain past outputs, whose "
         "size "
         "depends on earlier probes. Full residuals give each channel's level exactly, for any feedback and "
         "any "
         "noise independent of the probes.</p>\n</body></html>\n";
}

}  // namespace trammel::program
