// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of batch_bound.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/filter/batch_bound.hpp"
#include "trammel/filter/design.hpp"
#include "trammel/filter/require_order.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

TRAMMEL_INLINE GuaranteedProblem batch_problem(const BatchWindow& window) {
  const int order = window.order;
  const int samples = window.samples;
  constexpr int kMostSamples = 2000;  // the parameters of the problem are as many
  detail::require_order(order, order);
  require(samples >= order && samples <= kMostSamples, "samples", std::to_string(samples),
          "from the order " + std::to_string(order) + " to " + std::to_string(kMostSamples));
  require(std::isfinite(window.index) && window.index > 0.0, "index", std::to_string(window.index),
          "a positive number");
  require(window.output.predicted || (window.output.row >= 0 && window.output.row < order), "output.row",
          std::to_string(window.output.row), "a row below the order");

  const int first = window.output.predicted ? 1 : 0;  // age of the latest sample in intervals
  const int intervals = samples - 1 + first;
  const double scale = samples;
  GuaranteedProblem problem;
  problem.information_factor = Eigen::MatrixXd::Zero(samples, order + intervals);
  for (int n = 0; n < samples; ++n) {
    const double age = n + first;
    for (int i = 0; i < order; ++i) {
      problem.information_factor(n, i) = std::pow(-age / scale, i) / factorial(i);
    }
    // x(-age) = Taylor polynomial + (-1)^v int_0^age (age - s)^(v-1)/(v-1)! x^(v)(-s) ds
    const double sign = order % 2 == 0 ? 1.0 : -1.0;
    for (int j = 0; j < n + first; ++j) {
      const double integral = std::pow(age - j, order) - std::pow(age - j - 1, order);
      problem.information_factor(n, order + j) = sign * window.index * integral / factorial(order);
    }
  }
  const int row = window.output.predicted ? 0 : window.output.row;
  problem.criterion_factor = Eigen::MatrixXd::Zero(1, order + intervals);
  problem.criterion_factor(0, row) = std::pow(scale, -row);
  for (int j = 0; j < intervals; ++j) {
    problem.ellipsoids.emplace_back(Eigen::RowVectorXd::Unit(order + intervals, order + j));
  }
  return problem;
}

TRAMMEL_INLINE int sufficient_samples(int order, double index) {
  detail::require_order(order, order);
  require(std::isfinite(index) && index > 0.0, "index", std::to_string(index), "a positive number");
  constexpr double kMost = 1e9;
  const double memory = 8.0 / std::pow(index, 2.0 / (2.0 * order + 1.0));
  return static_cast<int>(std::min(std::ceil(memory) + 4.0 * order, kMost));
}

TRAMMEL_INLINE minimax::Solution batch_bound(const BatchWindow& window,
                                             const minimax::SolverSettings& settings) {
  return minimax::solve(batch_problem(window), settings);
}

}  // namespace trammel::inline TRAMMEL_ABI::filter
