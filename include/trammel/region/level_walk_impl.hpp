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

/// Lines closer to a crossing than this, relative to the size of their terms, go through it.
inline constexpr double kSamePoint = 1e-13;

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

/// Nearest crossing of the current line right of `after`.
TRAMMEL_INLINE double next_crossing(std::span<const Line> lines, int current, double after) {
  const Line line = lines[static_cast<std::size_t>(current)];
  double nearest = std::numeric_limits<double>::infinity();
  for (const Line& other : lines) {
    const double x = (other.intercept - line.intercept) / (line.slope - other.slope);
    // Parallel lines give an infinity or NaN, which neither comparison accepts.
    nearest = x > after && x < nearest ? x : nearest;
  }
  return nearest;
}

/// The k-th smallest line just right of a crossing of the current line at x: the lines through that point are
/// in ascending order of their slopes there, above those that pass below it.
TRAMMEL_INLINE int line_after_crossing(std::span<const Line> lines, int k, int current, double x,
                                       std::vector<int>& order) {
  const double height = lines[static_cast<std::size_t>(current)].at(x);
  int below = 0;
  order.clear();
  for (std::size_t m = 0; m < lines.size(); ++m) {
    const double distance = lines[m].at(x) - height;
    const double size = std::abs(lines[m].intercept) + std::abs(lines[m].slope * x);
    if (std::abs(distance) <= kSamePoint * size) {
      order.push_back(static_cast<int>(m));
    } else {
      below += distance < 0.0 ? 1 : 0;
    }
  }
  const int place = k - 1 - below;
  if (place < 0 || place >= static_cast<int>(order.size())) {
    return line_of_rank(lines, k, x, order);
  }
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const double first = lines[static_cast<std::size_t>(a)].slope;
    const double second = lines[static_cast<std::size_t>(b)].slope;
    return first != second ? first < second : a < b;
  });
  return order[static_cast<std::size_t>(place)];
}

}  // namespace detail

TRAMMEL_INLINE void walk_level(std::span<const Line> lines, int k, double begin, double end,
                               LevelWalkWork& work, LevelChain& out) {
  require(k >= 1 && k <= static_cast<int>(lines.size()), [&] {
    return ErrorDetail{"walk_level: k", std::to_string(k),
                       "1 to the number of lines, " + std::to_string(lines.size())};
  });
  out.breaks.clear();
  out.pieces.clear();
  int current = detail::line_of_rank(lines, k, begin, work.order);
  out.pieces.push_back(current);
  for (double x = detail::next_crossing(lines, current, begin); x < end;
       x = detail::next_crossing(lines, current, x)) {
    const int next = detail::line_after_crossing(lines, k, current, x, work.order);
    if (next != current) {
      out.breaks.push_back(x);
      out.pieces.push_back(next);
      current = next;
    }
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::region
