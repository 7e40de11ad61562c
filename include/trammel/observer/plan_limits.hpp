// SPDX-License-Identifier: Apache-2.0
/// @file
/// Plans with a limited lateral speed, a demanded accuracy or a given amount of control energy.
#pragma once

#include "trammel/core/config.hpp"
#include "trammel/observer/plan.hpp"
#include "trammel/observer/plan_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

/// A plan and the weights it was made with.
struct LimitedPlan {
  Plan plan;
  Eigen::Vector3d beta_per_s = Eigen::Vector3d::Zero();
};

/// All three scale the weights beta by one factor and search it: with growing weights xi, the control energy
/// and the largest speed grow and the weighted variance falls (proved for the energy and the weighted
/// variance, since both are the parts of a minimised sum; observed for the speed). If the problem has no
/// positive weight, beta = (1, 0, 0) is scaled. Cost: some 60 plans.

/// The plan with the weights of `problem`, lowered until sqrt(u1^2 + u2^2) <= limit_mps. Error if even the
/// straight flight is faster. Cheap and feasible; a path that is optimal under the limit may be slightly
/// better.
[[nodiscard]] LimitedPlan plan_with_speed_limit(const PlanProblem& problem, double limit_mps);

/// As plan_with_speed_limit for loops: no checks; where the straight flight is already too fast it is
/// returned.
[[nodiscard]] Plan fastest_allowed_plan(const PlanProblem& problem, double limit_mps);

/// The cheapest plan whose standard deviation of x at the end is target_m. If the straight flight is as good,
/// that is the answer. Error if no weight of at most 1e12 times the control energy's natural scale reaches
/// it.
[[nodiscard]] LimitedPlan plan_for_accuracy(const PlanProblem& problem, double target_m);

/// The plan that spends `energy` (integral of u1^2 + u2^2, m^2/s). Error if the straight flight needs more.
[[nodiscard]] LimitedPlan plan_for_energy(const PlanProblem& problem, double energy);

}  // namespace trammel::inline TRAMMEL_ABI::observer

#ifndef TRAMMEL_COMPILED
#include "trammel/observer/plan_limits_impl.hpp"
#endif
