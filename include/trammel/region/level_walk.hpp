// SPDX-License-Identifier: Apache-2.0
/// @file
/// Levels of arrangements of lines: the k-th smallest of many affine functions of one variable, exactly.
#pragma once

#include <span>
#include <vector>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// t = intercept + slope x.
struct Line {
  double slope = 0.0;
  double intercept = 0.0;

  [[nodiscard]] double at(double x) const { return intercept + slope * x; }
};

/// A continuous piecewise linear function: lines[pieces[k]] between breaks[k-1] and breaks[k], where
/// breaks[-1] and breaks[size] are the ends of the walk.
struct LevelChain {
  std::vector<double> breaks;  ///< ascending
  std::vector<int> pieces;     ///< breaks.size() + 1 indices of lines
};

/// Work space of walk_level, kept between calls.
struct LevelWalkWork {
  std::vector<int> order;
};

/// The k-th smallest (k from 1) of the lines on [begin, end], ends may be infinite. Starts with the k-th line
/// at `begin` and goes from one crossing of the current line to the next; at each the rank is counted anew,
/// also where many lines meet in one point, so that rounding cannot make it drift.
/// Cost: O(lines) per crossing, and few of them for k near 1 or near the number of lines.
void walk_level(std::span<const Line> lines, int k, double begin, double end, LevelWalkWork& work,
                LevelChain& out);

}  // namespace trammel::inline TRAMMEL_ABI::region

#ifndef TRAMMEL_COMPILED
#include "trammel/region/level_walk_impl.hpp"
#endif
