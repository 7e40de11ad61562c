// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of plan_limits.hpp.
#pragma once

#include <cmath>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/observer/plan_limits.hpp"
#include "trammel/observer/plan_problem_impl.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

namespace detail {

[[nodiscard]] inline LimitedPlan plan_with_weights(PlanProblem problem, const Eigen::Vector3d& beta) {
  problem.beta_per_s = beta;
  return {make_plan_unchecked(problem), beta};
}

[[nodiscard]] inline Eigen::Vector3d weight_direction(const PlanProblem& problem) {
  return problem.beta_per_s.maxCoeff() > 0.0 ? problem.beta_per_s : Eigen::Vector3d::UnitX().eval();
}

/// Largest-to-smallest factor of the weights that a search covers around its natural scale.
inline constexpr double kWeightDecades = 24.0;

/// Weights whose information term would match what is at stake: J_R of order V^2 T phi^2 against beta
/// gamma_11.
[[nodiscard]] inline double natural_factor(const PlanProblem& problem, const Eigen::Vector3d& direction) {
  const double speed = problem.closing_speed_mps();
  return speed * speed * problem.time_to_go_s / direction.dot(problem.covariance_m2.diagonal());
}

/// Bisection in log(factor) for the largest factor at which `allowed(plan)` still holds; allowed at `low`,
/// not at `high`. Ends when the interval is rounding.
template <class Allowed>
[[nodiscard]] LimitedPlan largest_allowed(const PlanProblem& problem, const Eigen::Vector3d& direction,
                                          double low, double high, const Allowed& allowed) {
  constexpr int kSteps = 70;
  double below = std::log(low);
  double above = std::log(high);
  LimitedPlan best = plan_with_weights(problem, low * direction);
  for (int step = 0; step < kSteps; ++step) {
    const double middle = 0.5 * (below + above);
    if (!(middle > below && middle < above)) {
      break;
    }
    LimitedPlan candidate = plan_with_weights(problem, std::exp(middle) * direction);
    if (allowed(candidate.plan)) {
      below = middle;
      best = std::move(candidate);
    } else {
      above = middle;
    }
  }
  return best;
}

/// The straight flight where no smaller weight is allowed.
template <class Allowed>
[[nodiscard]] LimitedPlan search_weights(const PlanProblem& problem, double high_factor,
                                         const Allowed& allowed) {
  const Eigen::Vector3d direction = weight_direction(problem);
  const double low = natural_factor(problem, direction) * std::pow(10.0, -kWeightDecades);
  const LimitedPlan lowest = plan_with_weights(problem, std::fmin(low, high_factor) * direction);
  if (!allowed(lowest.plan) || !(low < high_factor)) {
    return plan_with_weights(problem, Eigen::Vector3d::Zero());
  }
  return largest_allowed(problem, direction, low, high_factor, allowed);
}

}  // namespace detail

TRAMMEL_INLINE Plan fastest_allowed_plan(const PlanProblem& problem, double limit_mps) {
  Plan full = make_plan_unchecked(problem);
  if (full.max_speed_mps() <= limit_mps) {
    return full;
  }
  return detail::search_weights(problem, 1.0,
                                [&](const Plan& plan) { return plan.max_speed_mps() <= limit_mps; })
      .plan;
}

TRAMMEL_INLINE LimitedPlan plan_with_speed_limit(const PlanProblem& problem, double limit_mps) {
  require_valid(problem);
  if (!(limit_mps > 0.0)) {  // infinity: no limit
    throw Error({"max_lateral_speed_mps", shortest(limit_mps), "a positive number"});
  }
  LimitedPlan full = detail::plan_with_weights(problem, problem.beta_per_s);
  if (std::isinf(limit_mps) || full.plan.max_speed_mps() <= limit_mps) {
    return full;
  }
  const LimitedPlan straight = detail::plan_with_weights(problem, Eigen::Vector3d::Zero());
  const double least = straight.plan.max_speed_mps();
  if (!(least <= limit_mps)) {
    throw Error({"max_lateral_speed_mps", shortest(limit_mps),
                 "at least " + std::to_string(least) + " (the straight flight to the end point)"});
  }
  return detail::search_weights(problem, 1.0,
                                [&](const Plan& plan) { return plan.max_speed_mps() <= limit_mps; });
}

TRAMMEL_INLINE LimitedPlan plan_for_accuracy(const PlanProblem& problem, double target_m) {
  require_valid(problem);
  detail::require_positive(target_m, "target_sigma_x_m");
  const double target = target_m * target_m;
  const auto coarser = [&](const Plan& plan) { return plan.final_covariance_m2(0, 0) > target; };
  LimitedPlan straight = detail::plan_with_weights(problem, Eigen::Vector3d::Zero());
  if (!coarser(straight.plan)) {
    return straight;
  }
  const Eigen::Vector3d direction = detail::weight_direction(problem);
  constexpr double kLargest = 1e12;
  const double high = kLargest * detail::natural_factor(problem, direction);
  const LimitedPlan finest = detail::plan_with_weights(problem, high * direction);
  if (coarser(finest.plan)) {
    throw Error({"target_sigma_x_m", shortest(target_m),
                 "at least " + std::to_string(std::sqrt(finest.plan.final_covariance_m2(0, 0))) +
                     " (what the largest useful weight reaches)"});
  }
  return detail::search_weights(problem, high, coarser);
}

TRAMMEL_INLINE LimitedPlan plan_for_energy(const PlanProblem& problem, double energy) {
  require_valid(problem);
  detail::require_positive(energy, "energy_budget_m2ps");
  const LimitedPlan straight = detail::plan_with_weights(problem, Eigen::Vector3d::Zero());
  const double least = straight.plan.cost_control;
  if (!(least <= energy)) {
    throw Error({"energy_budget_m2ps", std::to_string(energy),
                 "at least " + std::to_string(least) + " (the straight flight to the end point)"});
  }
  constexpr double kLargest = 1e12;
  const Eigen::Vector3d direction = detail::weight_direction(problem);
  const double high = kLargest * detail::natural_factor(problem, direction);
  return detail::search_weights(problem, high, [&](const Plan& plan) { return plan.cost_control <= energy; });
}

}  // namespace trammel::inline TRAMMEL_ABI::observer
