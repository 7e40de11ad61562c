// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of planar.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "trammel/core/error.hpp"
#include "trammel/region/level_walk_impl.hpp"
#include "trammel/region/lscr_impl.hpp"
#include "trammel/region/planar.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

namespace detail {

/// How the sums of a channel change along a direction.
enum class Monotone { kNo, kYes, kConstant };

TRAMMEL_INLINE Monotone monotone(const LscrRegion& region, int channel, const Eigen::Vector2d& direction) {
  int rising = 0;
  int falling = 0;
  const int count = region.members() - 1;
  for (int j = 0; j < count; ++j) {
    const double change =
        region.slope(j, channel, 0) * direction(0) + region.slope(j, channel, 1) * direction(1);
    rising += change > 0.0 ? 1 : 0;
    falling += change < 0.0 ? 1 : 0;
  }
  if (rising == 0 && falling == 0) {
    return Monotone::kConstant;
  }
  return rising == count || falling == count ? Monotone::kYes : Monotone::kNo;
}

TRAMMEL_INLINE bool suits_all(const LscrRegion& region, const Eigen::Vector2d& direction) {
  for (int channel = 0; channel < region.channels(); ++channel) {
    if (monotone(region, channel, direction) == Monotone::kNo) {
      return false;
    }
  }
  return true;
}

/// Angles of directions along which all sums of a channel fall: those within a quarter turn of every slope
/// vector. Empty if the slope vectors do not lie in a half plane.
TRAMMEL_INLINE std::optional<Interval> falling_angles(const LscrRegion& region, int channel) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (int j = 0; j < region.members() - 1; ++j) {
    mean += Eigen::Vector2d(region.slope(j, channel, 0), region.slope(j, channel, 1));
  }
  const double middle = std::atan2(mean(1), mean(0));
  double least = 0.0;
  double most = 0.0;
  for (int j = 0; j < region.members() - 1; ++j) {
    const double x = region.slope(j, channel, 0);
    const double y = region.slope(j, channel, 1);
    const double angle = std::atan2(mean(0) * y - mean(1) * x, mean(0) * x + mean(1) * y);
    least = std::min(least, angle);
    most = std::max(most, angle);
  }
  const Interval angles{middle + most - std::numbers::pi / 2.0, middle + least + std::numbers::pi / 2.0};
  return angles.lower < angles.upper ? std::optional<Interval>(angles) : std::nullopt;
}

/// A direction along which every channel's sums all fall or all rise; the second axis is preferred.
TRAMMEL_INLINE std::optional<Eigen::Vector2d> sweep_direction(const LscrRegion& region) {
  for (const Eigen::Vector2d& axis : {Eigen::Vector2d(0.0, 1.0), Eigen::Vector2d(1.0, 0.0)}) {
    if (suits_all(region, axis)) {
      return axis;
    }
  }
  Interval common{-kInfinity, kInfinity};
  for (int channel = 0; channel < region.channels(); ++channel) {
    const std::optional<Interval> angles = falling_angles(region, channel);
    if (!angles) {
      return std::nullopt;
    }
    if (channel == 0) {
      common = *angles;
      continue;
    }
    // Falling or rising: angles count modulo half a turn. The widest overlap is kept.
    Interval best{0.0, 0.0};
    for (int half_turns = -3; half_turns <= 3; ++half_turns) {
      const double turn = half_turns * std::numbers::pi;
      const Interval overlap{std::max(common.lower, angles->lower + turn),
                             std::min(common.upper, angles->upper + turn)};
      if (overlap.upper - overlap.lower > best.upper - best.lower) {
        best = overlap;
      }
    }
    common = best;
  }
  const double angle = (common.lower + common.upper) / 2.0;
  const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
  return suits_all(region, direction) ? std::optional<Eigen::Vector2d>(direction) : std::nullopt;
}

/// Lines t_j(x) of one channel in p = x across + t along, and the levels that bound its set.
TRAMMEL_INLINE void prepare_channel(const LscrRegion& region, int channel, const Eigen::Vector2d& across,
                                    const Eigen::Vector2d& along, double begin, double end,
                                    LevelWalkWork& walk, PlanarWork::Channel& out) {
  const int count = region.members() - 1;
  out.lines.resize(static_cast<std::size_t>(count));
  for (int j = 0; j < count; ++j) {
    const double s0 = region.slope(j, channel, 0);
    const double s1 = region.slope(j, channel, 1);
    const double fall = s0 * along(0) + s1 * along(1);
    Line& line = out.lines[static_cast<std::size_t>(j)];
    line.slope = -(s0 * across(0) + s1 * across(1)) / fall;
    line.intercept = region.constant(j, channel) / fall;
  }
  walk_level(out.lines, region.excluded(), begin, end, walk, out.lower);
  walk_level(out.lines, count + 1 - region.excluded(), begin, end, walk, out.upper);
}

/// Line of a chain at x.
TRAMMEL_INLINE const Line& active_line(const PlanarWork::Channel& channel, const LevelChain& chain,
                                       double x) {
  const auto piece = std::upper_bound(chain.breaks.begin(), chain.breaks.end(), x) - chain.breaks.begin();
  return channel.lines[static_cast<std::size_t>(chain.pieces[static_cast<std::size_t>(piece)])];
}

/// The highest lower bound and the lowest upper bound at x.
struct Bounds {
  Line lower{0.0, -kInfinity};
  Line upper{0.0, kInfinity};
};

TRAMMEL_INLINE Bounds bounds_at(const PlanarWork& work, double x) {
  Bounds bounds;
  for (const PlanarWork::Channel& channel : work.channels) {
    if (channel.is_strip) {
      continue;
    }
    const Line& lower = active_line(channel, channel.lower, x);
    const Line& upper = active_line(channel, channel.upper, x);
    if (lower.at(x) > bounds.lower.at(x)) {
      bounds.lower = lower;
    }
    if (upper.at(x) < bounds.upper.at(x)) {
      bounds.upper = upper;
    }
  }
  return bounds;
}

/// A point between two neighbouring events, of which either may be infinite.
TRAMMEL_INLINE double representative(double from, double to) {
  if (std::isinf(from)) {
    return std::isinf(to) ? 0.0 : to - 1.0 - std::abs(to);
  }
  return std::isinf(to) ? from + 1.0 + std::abs(from) : from + (to - from) / 2.0;
}

/// Adds all crossings, between two neighbouring breaks, of the lines that bound the set there.
TRAMMEL_INLINE void add_crossings(PlanarWork& work, double from, double to) {
  const double middle = representative(from, to);
  work.active.clear();
  for (const PlanarWork::Channel& channel : work.channels) {
    if (!channel.is_strip) {
      work.active.push_back(active_line(channel, channel.lower, middle));
      work.active.push_back(active_line(channel, channel.upper, middle));
    }
  }
  for (std::size_t a = 0; a < work.active.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const double x = (work.active[a].intercept - work.active[b].intercept) /
                       (work.active[b].slope - work.active[a].slope);
      if (x > from && x < to) {
        work.events.push_back(x);
      }
    }
  }
}

/// Extends the box of a region by a direction in which it goes on for ever.
TRAMMEL_INLINE void extend_to_infinity(const Eigen::Vector2d& direction, PlanarRegion& out) {
  for (int k = 0; k < 2; ++k) {
    if (direction(k) > 0.0) {
      out.upper(k) = kInfinity;
    } else if (direction(k) < 0.0) {
      out.lower(k) = -kInfinity;
    }
  }
  out.bounded = false;
  out.area = kInfinity;
}

/// Emits the polygon collected in lower_points and upper_points.
TRAMMEL_INLINE void close_component(PlanarWork& work, PlanarRegion& out) {
  if (work.lower_points.empty()) {
    return;
  }
  const auto emit = [&](const Eigen::Vector2d& point) {
    const auto begin = static_cast<std::size_t>(out.first_vertex.back());
    if (out.vertices.size() == begin || out.vertices.back() != point) {
      out.vertices.push_back(point);
      out.lower = out.lower.cwiseMin(point);
      out.upper = out.upper.cwiseMax(point);
    }
  };
  std::for_each(work.lower_points.begin(), work.lower_points.end(), emit);
  std::for_each(work.upper_points.rbegin(), work.upper_points.rend(), emit);
  const auto begin = static_cast<std::size_t>(out.first_vertex.back());
  while (out.vertices.size() > begin + 1 && out.vertices.back() == out.vertices[begin]) {
    out.vertices.pop_back();
  }
  out.first_vertex.push_back(static_cast<int>(out.vertices.size()));
  work.lower_points.clear();
  work.upper_points.clear();
}

/// Appends a point to a chain unless it lies on the straight continuation of the last two.
TRAMMEL_INLINE void append(std::vector<Eigen::Vector2d>& chain, const Eigen::Vector2d& point, bool corner) {
  if (!corner && chain.size() > 1) {
    chain.back() = point;
  } else {
    chain.push_back(point);
  }
}

/// Fills work.channels and work.events, the abscissas where the bounds of the set can change. False if some
/// channel leaves nothing.
TRAMMEL_INLINE bool prepare_events(const LscrRegion& region, const Eigen::Vector2d& across,
                                   const Eigen::Vector2d& along, PlanarWork& work) {
  // Channels that do not change along t limit x alone; the others are bounded by two levels each.
  work.channels.resize(static_cast<std::size_t>(region.channels()));
  work.events.clear();
  double begin = -kInfinity;
  double end = kInfinity;
  for (int channel = 0; channel < region.channels(); ++channel) {
    PlanarWork::Channel& item = work.channels[static_cast<std::size_t>(channel)];
    item.is_strip = monotone(region, channel, along) == Monotone::kConstant;
    if (!item.is_strip) {
      continue;
    }
    const Eigen::Vector2d origin(0.0, 0.0);
    region.channel_section(channel, origin, across, work.sweep, item.strip);
    if (item.strip.empty()) {
      return false;
    }
    begin = std::max(begin, item.strip.front().lower);
    end = std::min(end, item.strip.back().upper);
    for (const Interval& interval : item.strip) {
      work.events.push_back(interval.lower);
      work.events.push_back(interval.upper);
    }
  }
  for (int channel = 0; channel < region.channels(); ++channel) {
    PlanarWork::Channel& item = work.channels[static_cast<std::size_t>(channel)];
    if (!item.is_strip) {
      prepare_channel(region, channel, across, along, begin, end, work.walk, item);
      work.events.insert(work.events.end(), item.lower.breaks.begin(), item.lower.breaks.end());
      work.events.insert(work.events.end(), item.upper.breaks.begin(), item.upper.breaks.end());
    }
  }
  work.events.push_back(begin);
  work.events.push_back(end);
  std::sort(work.events.begin(), work.events.end());
  const std::size_t breaks = work.events.size();
  for (std::size_t k = 0; k + 1 < breaks; ++k) {
    add_crossings(work, work.events[k], work.events[k + 1]);
  }
  std::sort(work.events.begin(), work.events.end());
  work.events.erase(std::unique(work.events.begin(), work.events.end()), work.events.end());
  return true;
}

/// True if x lies in every strip.
TRAMMEL_INLINE bool in_strips(const PlanarWork& work, double x) {
  return std::all_of(work.channels.begin(), work.channels.end(), [x](const PlanarWork::Channel& channel) {
    return !channel.is_strip || inside(channel.strip, x);
  });
}

/// Goes through the events from left to right and emits the polygons between the bounds.
TRAMMEL_INLINE void trace_components(PlanarWork& work, const Eigen::Vector2d& across,
                                     const Eigen::Vector2d& along, PlanarRegion& out) {
  constexpr double kPinch = 1e-13;  // components narrower than this, relative, are apart
  out.first_vertex.push_back(0);
  Bounds previous;
  const auto point = [&](double x, const Line& line) -> Eigen::Vector2d {
    return x * across + line.at(x) * along;
  };
  for (std::size_t k = 0; k + 1 < work.events.size(); ++k) {
    const double from = work.events[k];
    const double to = work.events[k + 1];
    const double middle = representative(from, to);
    const Bounds bounds = bounds_at(work, middle);
    const double low = bounds.lower.at(middle);
    const double high = bounds.upper.at(middle);
    if (!(low < high) || !in_strips(work, middle)) {
      close_component(work, out);
      continue;
    }
    if (std::isinf(low) || std::isinf(high)) {
      extend_to_infinity(along, out);
      extend_to_infinity(-along, out);
      continue;
    }
    if (std::isinf(from) || std::isinf(to)) {
      const double side = std::isinf(from) ? -1.0 : 1.0;
      extend_to_infinity(side * (across + bounds.lower.slope * along), out);
      extend_to_infinity(side * (across + bounds.upper.slope * along), out);
    }
    if (std::isfinite(from)) {
      const double width = bounds.upper.at(from) - bounds.lower.at(from);
      if (width <= kPinch * (std::abs(bounds.upper.at(from)) + std::abs(bounds.lower.at(from)))) {
        close_component(work, out);
      }
      if (work.lower_points.empty()) {
        work.lower_points.push_back(point(from, bounds.lower));
        work.upper_points.push_back(point(from, bounds.upper));
      }
    }
    if (std::isfinite(to)) {
      const auto same = [](const Line& a, const Line& b) {
        return a.slope == b.slope && a.intercept == b.intercept;
      };
      append(work.lower_points, point(to, bounds.lower), !same(bounds.lower, previous.lower));
      append(work.upper_points, point(to, bounds.upper), !same(bounds.upper, previous.upper));
      if (std::isfinite(from)) {
        out.area += (to - from) * (high - low);
      }
    }
    previous = bounds;
  }
  close_component(work, out);
}

}  // namespace detail

TRAMMEL_INLINE bool exact_polygon(const LscrRegion& region, PlanarWork& work, PlanarRegion& out) {
  using detail::kInfinity;
  require(region.dimension() == 2, [&] {
    return ErrorDetail{"exact_polygon: region", std::to_string(region.dimension()) + " parameters", "2"};
  });
  out.vertices.clear();
  out.first_vertex.clear();
  out.area = 0.0;
  out.bounded = true;
  out.exact = false;
  out.lower.setConstant(kInfinity);
  out.upper.setConstant(-kInfinity);
  const std::optional<Eigen::Vector2d> found = detail::sweep_direction(region);
  if (!found) {
    return false;
  }
  out.exact = true;
  const Eigen::Vector2d along = *found;
  const Eigen::Vector2d across(along(1), -along(0));

  if (detail::prepare_events(region, across, along, work)) {
    detail::trace_components(work, across, along, out);
  } else {
    out.first_vertex.push_back(0);
  }
  return true;
}

namespace detail {

/// Integral of theta_2 / theta_1 over theta_1 along a straight edge.
TRAMMEL_INLINE double edge_integral(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const double relative = (to(0) - from(0)) / from(0);
  if (relative == 0.0) {
    return 0.0;
  }
  const double logarithm = std::log1p(relative);
  return from(1) * logarithm + (to(1) - from(1)) * (1.0 - logarithm / relative);
}

}  // namespace detail

TRAMMEL_INLINE PlantImage plant_image(const PlanarRegion& region, const PlantModel& model) {
  validate(model);
  require(unknown_count(model) == 2, [&] {
    return ErrorDetail{"plant_image: model", std::to_string(unknown_count(model)) + " unknown coefficients",
                       "2"};
  });
  PlantImage image;
  PlanarRegion& outline = image.outline;
  outline.first_vertex = region.first_vertex;
  outline.exact = region.exact;
  outline.bounded = region.bounded;
  outline.lower.setConstant(detail::kInfinity);
  outline.upper.setConstant(-detail::kInfinity);
  // Two impulse parameters leave two regular cases: b_l and b_{l+1} unknown (an affine map of unit area), or
  // a_1 and b_l = theta_1 unknown, with a_1 = (b_{l+1} - theta_2) / theta_1 and area element 1/|theta_1|.
  const bool has_pole = !model.a.empty() && !model.a.front();
  for (const Eigen::Vector2d& vertex : region.vertices) {
    const Eigen::Vector2d mapped = plant_from_impulse(model, vertex).parameters;
    outline.vertices.push_back(mapped);
    outline.lower = outline.lower.cwiseMin(mapped);
    outline.upper = outline.upper.cwiseMax(mapped);
  }
  const bool crosses =
      has_pole && !region.vertices.empty() && region.lower(0) <= 0.0 && region.upper(0) >= 0.0;
  if (!region.bounded || crosses) {
    outline.bounded = false;
    outline.lower.setConstant(-detail::kInfinity);
    outline.upper.setConstant(detail::kInfinity);
    if (has_pole) {  // b_l = theta_1 keeps its own bounds
      outline.lower(1) = region.lower(0);
      outline.upper(1) = region.upper(0);
    }
    image.area = detail::kInfinity;
  } else if (!has_pole) {
    image.area = region.area;
  } else {
    for (int component = 0; component < region.components(); ++component) {
      const int begin = region.first_vertex[static_cast<std::size_t>(component)];
      const int end = region.first_vertex[static_cast<std::size_t>(component) + 1];
      double area = 0.0;
      for (int k = begin; k < end; ++k) {
        const int next = k + 1 < end ? k + 1 : begin;
        area += detail::edge_integral(region.vertices[static_cast<std::size_t>(k)],
                                      region.vertices[static_cast<std::size_t>(next)]);
      }
      image.area += std::abs(area);
    }
  }
  outline.area = image.area;
  return image;
}

}  // namespace trammel::inline TRAMMEL_ABI::region
