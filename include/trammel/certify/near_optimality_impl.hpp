// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of near_optimality.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "trammel/certify/attained.hpp"
#include "trammel/certify/block_structure.hpp"
#include "trammel/certify/correlated_prior.hpp"
#include "trammel/certify/near_optimality.hpp"
#include "trammel/certify/van_trees.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace near_detail {

/// "attained" in words needs this fraction of the guaranteed squared error.
inline constexpr double kAttained = 1.0 - 1e-5;

inline std::string number(double value, int digits) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  return text.data();
}

/// L scaled so that every <H_l, L L'> is at most one.
inline Eigen::MatrixXd admissible_prior(const GuaranteedProblem& problem,
                                        const Eigen::MatrixXd& prior_factor) {
  double largest = 0.0;
  for (const Eigen::MatrixXd& factor : problem.ellipsoids) {
    largest = std::max(largest, (factor * prior_factor).squaredNorm());
  }
  return largest > 1.0 ? Eigen::MatrixXd(prior_factor / std::sqrt(largest)) : prior_factor;
}

}  // namespace near_detail

TRAMMEL_INLINE NearOptimality assess_near_optimality(const GuaranteedProblem& problem,
                                                     const minimax::Solution& solution,
                                                     const NearOptimalitySettings& settings,
                                                     const ProgressObserver& observe) {
  validate(settings, "near_optimality");
  NearOptimality near;
  if (!std::isfinite(solution.upper) || solution.gain.size() == 0) {
    return near;
  }
  const auto tell = [&](double fraction) {
    if (observe) {
      observe({.phase = "near-optimality", .fraction = fraction});
    }
  };
  tell(0.0);
  const Eigen::MatrixXd prior_factor = near_detail::admissible_prior(problem, solution.prior_factor);
  const AttainedError worst =
      find_attained_error(problem, solution.gain, prior_factor, settings.starts, settings.seed);
  near.attained = worst.squared_error;
  near.attained_fraction = solution.upper > 0.0 ? worst.squared_error / solution.upper : 1.0;
  near.worst_case = worst.parameters;
  tell(0.2);
  near.any_estimator = 0.0;
  const auto consider = [&near](double bound, AnyEstimatorBound kind) {
    if (bound > near.any_estimator) {
      near.any_estimator = bound;
      near.kind = kind;
    }
  };
  if (const std::optional<UnitBalls> balls = find_unit_balls(problem, prior_factor)) {
    consider(box_bound(*balls), AnyEstimatorBound::kBox);
    consider(ball_bound(*balls), AnyEstimatorBound::kBall);
    tell(0.4);
    consider(group_bound(*balls), AnyEstimatorBound::kCoherentGroups);
  }
  tell(0.8);
  consider(correlated_bound(problem, prior_factor), AnyEstimatorBound::kCorrelatedPrior);
  tell(1.0);
  if (settings.monte_carlo) {
    near.monte_carlo = palindromic_bound(
        problem, prior_factor,
        {.confidence = settings.confidence, .samples = settings.samples, .seed = settings.seed}, observe);
    near.confidence = settings.confidence;
  }
  return near;
}

TRAMMEL_INLINE std::string describe(const NearOptimality& near, double guaranteed_squared_error,
                                    std::string_view unit) {
  using near_detail::number;
  if (!std::isfinite(near.attained_fraction)) {
    return "No error can be guaranteed.";
  }
  constexpr int kDigits = 4;
  const double guaranteed = std::sqrt(guaranteed_squared_error);
  const auto length = [&](double squared) {
    return number(std::sqrt(squared), kDigits) + (unit.empty() ? "" : " ") + std::string(unit);
  };
  std::string text = "Guaranteed rms error " + length(guaranteed_squared_error);
  text += near.attained_fraction >= near_detail::kAttained
              ? ", attained by an admissible motion"
              : "; an admissible motion with an error of " + length(near.attained) + " was found";
  text += "; no estimator of any kind, however computed, can guarantee less than " +
          length(near.any_estimator) + " (proved";
  if (near.sharpened()) {
    text += "; " + length(near.monte_carlo->bound) + " at " + number(100.0 * near.confidence, kDigits) +
            " % Monte Carlo confidence";
  }
  const double best = std::sqrt(near.best_any_estimator());
  const double gain = guaranteed > 0.0 ? std::max(0.0, 1.0 - best / guaranteed) : 0.0;
  return text + "): at most " + number(std::ceil(1000.0 * gain) / 10.0, 3) + " % can be gained.";
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
