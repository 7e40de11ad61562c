// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of solve.hpp.
#pragma once

#include <chrono>

#include "trammel/minimax/interior_point.hpp"
#include "trammel/minimax/newton_multipliers.hpp"
#include "trammel/minimax/reduced_solution.hpp"
#include "trammel/minimax/solve.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

namespace detail {

/// Newton's method in the multipliers, polished where its own certificate is too wide; false where it does
/// not apply. Counts its iterations.
inline bool solve_directly(const GuaranteedProblem& problem, const SolverSettings& settings,
                           const ProgressObserver& observe, Solution& solution) {
  const std::optional<ReducedProblem> direct = directly_observed(problem);
  if (!direct) {
    return false;
  }
  ReducedSolution near = solve_in_multipliers(*direct, settings, observe);
  if (near.status == SolveStatus::kOptimal) {
    certify_prior(*direct, settings, near);
    if (near.status == SolveStatus::kOptimal) {
      restore(problem, *direct, near, solution);
      return true;
    }
  }
  solution.iterations += near.iterations;
  if (near.prior_factor.size() == 0) {
    return false;
  }
  const ReducedSolution inner =
      InteriorPoint(*direct, settings).polish(near.prior_factor, near.multipliers, observe);
  if (inner.status != SolveStatus::kOptimal) {
    solution.iterations += inner.iterations;
    return false;
  }
  restore(problem, *direct, inner, solution);
  return true;
}

}  // namespace detail

TRAMMEL_INLINE Solution solve(const GuaranteedProblem& problem, const SolverSettings& settings,
                              const ProgressObserver& observe) {
  validate(settings, "settings");
  const auto start = std::chrono::steady_clock::now();
  Solution solution;
  if (detail::solve_directly(problem, settings, observe, solution)) {
    solution.method = Method::kNewtonMultipliers;
  } else {
    solution.method = Method::kInteriorPoint;
    solve_reduced(
        problem, [&](const ReducedProblem& reduced) { return InteriorPoint(reduced, settings).run(observe); },
        solution);
  }
  solution.solve_time_s = seconds_since(start);
  return solution;
}

}  // namespace trammel::inline TRAMMEL_ABI::minimax
