// SPDX-License-Identifier: Apache-2.0
/// @file
/// Finite unions of open intervals of the real line, the form of every section of a region.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

namespace detail {
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
}  // namespace detail

/// lower < t < upper; infinite ends are allowed.
struct Interval {
  double lower = -detail::kInfinity;
  double upper = detail::kInfinity;
};

/// Disjoint intervals in ascending order.
using IntervalList = std::vector<Interval>;

[[nodiscard]] inline bool inside(const IntervalList& list, double t) {
  return std::any_of(list.begin(), list.end(),
                     [t](const Interval& interval) { return t > interval.lower && t < interval.upper; });
}

/// Intersection of two lists.
[[nodiscard]] inline IntervalList intersect(const IntervalList& first, const IntervalList& second) {
  IntervalList result;
  auto a = first.begin();
  auto b = second.begin();
  while (a != first.end() && b != second.end()) {
    const Interval common{std::max(a->lower, b->lower), std::min(a->upper, b->upper)};
    if (common.lower < common.upper) {
      result.push_back(common);
    }
    if (a->upper < b->upper) {
      ++a;
    } else {
      ++b;
    }
  }
  return result;
}

/// Points where the number of functions above and below zero changes along a line, and the set where a
/// condition on these numbers holds. Kept between calls, it does not allocate after the first.
class CountSweep {
 public:
  /// Forgets all changes.
  void clear() { events_.clear(); }
  /// The count at t = -infinity.
  void set_initial(int count) { initial_ = count; }
  /// At t the count changes by `change`.
  void add(double t, int change) { events_.push_back({t, change}); }

  /// All t where the count lies in [least, most]; appended to `result`.
  void collect(int least, int most, IntervalList& result) {
    std::sort(events_.begin(), events_.end(), [](const Event& a, const Event& b) { return a.t < b.t; });
    int count = initial_;
    double from = -detail::kInfinity;
    bool holds = count >= least && count <= most;
    for (std::size_t k = 0; k < events_.size();) {
      const double t = events_[k].t;
      for (; k < events_.size() && events_[k].t == t; ++k) {
        count += events_[k].change;
      }
      const bool now = count >= least && count <= most;
      if (holds && !now) {
        result.push_back({from, t});
      } else if (now && !holds) {
        from = t;
      }
      holds = now;
    }
    if (holds) {
      result.push_back({from, detail::kInfinity});
    }
  }

 private:
  struct Event {
    double t;
    int change;
  };
  int initial_ = 0;
  std::vector<Event> events_;
};

}  // namespace trammel::inline TRAMMEL_ABI::region
