// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of minimise.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "trammel/filter/minimise.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

namespace detail {

/// One run of the simplex search until the simplex has shrunk to rounding errors.
inline Minimum simplex_search(const std::function<double(const Eigen::VectorXd&)>& function,
                              const Minimum& start, double step) {
  const Eigen::Index n = start.point.size();
  std::vector<Minimum> simplex{start};
  for (Eigen::Index i = 0; i < n; ++i) {
    Eigen::VectorXd point = start.point;
    point[i] += step;
    simplex.push_back({point, function(point)});
  }
  const auto better = [](const Minimum& left, const Minimum& right) { return left.value < right.value; };
  constexpr int kMaxSteps = 2000;
  constexpr double kSize = 1e-10;  // of the simplex, in units of the variables
  for (int iteration = 0; iteration < kMaxSteps; ++iteration) {
    std::sort(simplex.begin(), simplex.end(), better);
    double size = 0.0;
    Eigen::VectorXd centre = Eigen::VectorXd::Zero(n);
    for (std::size_t i = 0; i + 1 < simplex.size(); ++i) {
      centre += simplex[i].point / static_cast<double>(n);
      size = std::max(size, (simplex[i + 1].point - simplex[0].point).cwiseAbs().maxCoeff());
    }
    if (size < kSize) {
      break;
    }
    const auto along = [&](double factor) {
      Eigen::VectorXd point = centre + factor * (simplex.back().point - centre);
      const double value = function(point);
      return Minimum{std::move(point), value};
    };
    Minimum reflected = along(-1.0);
    if (better(reflected, simplex.front())) {
      Minimum expanded = along(-2.0);
      simplex.back() = better(expanded, reflected) ? std::move(expanded) : std::move(reflected);
    } else if (better(reflected, simplex[simplex.size() - 2])) {
      simplex.back() = std::move(reflected);
    } else {
      Minimum contracted = along(better(reflected, simplex.back()) ? -0.5 : 0.5);
      if (better(contracted, simplex.back()) && better(contracted, reflected)) {
        simplex.back() = std::move(contracted);
      } else {
        for (std::size_t i = 1; i < simplex.size(); ++i) {
          simplex[i].point = 0.5 * (simplex[i].point + simplex[0].point);
          simplex[i].value = function(simplex[i].point);
        }
      }
    }
  }
  return *std::min_element(simplex.begin(), simplex.end(), better);
}

}  // namespace detail

TRAMMEL_INLINE Minimum minimise(const std::function<double(const Eigen::VectorXd&)>& function,
                                const Eigen::VectorXd& start, double step) {
  constexpr int kMaxStarts = 30;
  constexpr double kImprovement = 1e-13;  // relative; less is rounding
  Minimum best{start, function(start)};
  if (start.size() == 0) {
    return best;
  }
  double size = step;
  int failures = 0;
  for (int i = 0; i < kMaxStarts && failures < 2; ++i) {
    Minimum next = detail::simplex_search(function, best, size);
    const bool improved = next.value < best.value - kImprovement * std::abs(best.value);
    if (next.value <= best.value) {
      best = std::move(next);
    }
    // Alternate sign and size, so that a simplex lying along a kink is not started along it again.
    size = improved ? size : -0.3 * size;
    failures = improved ? 0 : failures + 1;
  }
  return best;
}

TRAMMEL_INLINE Minimum minimise(const std::function<double(double)>& function, double low, double high,
                                double relative_width) {
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  const double tolerance = relative_width * (high - low);
  double left = high - golden * (high - low);
  double right = low + golden * (high - low);
  double at_left = function(left);
  double at_right = function(right);
  while (high - low > tolerance) {
    if (at_left <= at_right) {
      high = right;
      right = left;
      at_right = at_left;
      left = high - golden * (high - low);
      at_left = function(left);
    } else {
      low = left;
      left = right;
      at_left = at_right;
      right = low + golden * (high - low);
      at_right = function(right);
    }
  }
  const double middle = 0.5 * (low + high);
  return {Eigen::VectorXd::Constant(1, middle), function(middle)};
}

}  // namespace trammel::inline TRAMMEL_ABI::filter
