// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of level_walk.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/region/level_walk.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

namespace detail {

/// Crossings closer than this, relative to their place, are one.
inline constexpr double kSameCrossing = 1e-13;

/// The k-th smallest line just right of x (x = -infinity: far left).
TRAMMEL_INLINE int line_of_rank(std::span<const Line> lines, int k, double x, std::vector<int>& order) {
  order.resize(lines.size());
  std::iota(order.begin(), order.end(), 0);
  const bool far_left = std::isinf(x);
  const auto before = [&](int a, int b) {
    const Line& first = lines[static_cast<std::size_t>(a)];
    const Line& second = lines[static_cast<std::size_t>(b)];
    if (far_left) {
      return first.slope != second.slope ? first.slope > second.slope : first.intercept < second.intercept;
    }
    const double first_value = first.at(x);
    const double second_value = second.at(x);
    return first_value != second_value ? first_value < second_value : first.slope < second.slope;
  };
  const auto place = order.begin() + (k - 1);
  std::nth_element(order.begin(), place, order.end(), before);
  return *place;
}

/// True if the current line has rank k at x, counting lines at equal height either way.
TRAMMEL_INLINE bool has_rank(std::span<const Line> lines, int k, int current, double x) {
  const double height = lines[static_cast<std::size_t>(current)].at(x);
  int below = 0;
  int equal = 0;
  for (const Line& line : lines) {
    const double other = line.at(x);
    below += other < height ? 1 : 0;
    equal += other == height ? 1 : 0;
  }
  return below < k && k <= below + equal;
}

/// Nearest crossing of the current line right of `after`; work.crossing holds those of all lines.
TRAMMEL_INLINE double next_crossing(std::span<const Line> lines, int current, double after,
                                    std::vector<double>& crossing) {
  const Line& line = lines[static_cast<std::size_t>(current)];
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t m = 0; m < lines.size(); ++m) {
    const double x = (lines[m].intercept - line.intercept) / (line.slope - lines[m].slope);
    // Parallel lines give an infinity or NaN, which no comparison below accepts.
    const double counted = x > after ? x : std::numeric_limits<double>::infinity();
    crossing[m] = counted;
    nearest = counted < nearest ? counted : nearest;
  }
  return nearest;
}

/// The line of the same rank after all lines through the crossing at x have turned over.
TRAMMEL_INLINE int turn_over(std::span<const Line> lines, int current, double x, double tolerance,
                             LevelWalkWork& work, double& last) {
  work.order.clear();
  work.order.push_back(current);
  last = x;
  for (std::size_t m = 0; m < lines.size(); ++m) {
    if (work.crossing[m] <= x + tolerance) {
      work.order.push_back(static_cast<int>(m));
      last = std::max(last, work.crossing[m]);
    }
  }
  const auto slope = [&](int index) { return lines[static_cast<std::size_t>(index)].slope; };
  std::sort(work.order.begin(), work.order.end(),
            [&](int a, int b) { return slope(a) != slope(b) ? slope(a) < slope(b) : a < b; });
  const auto place = std::find(work.order.begin(), work.order.end(), current) - work.order.begin();
  return work.order[work.order.size() - 1 - static_cast<std::size_t>(place)];
}

}  // namespace detail

TRAMMEL_INLINE void walk_level(std::span<const Line> lines, int k, double begin, double end,
                               LevelWalkWork& work, LevelChain& out) {
  require(k >= 1 && k <= static_cast<int>(lines.size()), "walk_level: k", std::to_string(k),
          "1 to the number of lines, " + std::to_string(lines.size()));
  out.breaks.clear();
  out.pieces.clear();
  work.crossing.resize(lines.size());
  int current = detail::line_of_rank(lines, k, begin, work.order);
  out.pieces.push_back(current);
  double after = begin;
  double nearest = detail::next_crossing(lines, current, after, work.crossing);
  while (nearest < end) {
    const double tolerance = detail::kSameCrossing * std::abs(nearest);
    double last = nearest;
    int next = detail::turn_over(lines, current, nearest, tolerance, work, last);
    after = last + tolerance;
    double following = detail::next_crossing(lines, next, after, work.crossing);
    const double reach = std::isinf(following) ? after + 1.0 + std::abs(after) : following;
    const double middle = after + (reach - after) / 2.0;
    if (!detail::has_rank(lines, k, next, middle)) {
      next = detail::line_of_rank(lines, k, middle, work.order);
      following = detail::next_crossing(lines, next, after, work.crossing);
    }
    if (next != current) {
      out.breaks.push_back(nearest);
      out.pieces.push_back(next);
      current = next;
    }
    nearest = following;
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::region
