// SPDX-License-Identifier: Apache-2.0
/// @file
/// What every solver does around its algorithm: reduce, solve in reduced coordinates, bring the answer back.
#pragma once

#include <chrono>
#include <functional>
#include <limits>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/minimax/reduction.hpp"
#include "trammel/minimax/solution.hpp"
#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

/// Answer in reduced coordinates; `upper` and `lower` do not hold the free error yet.
struct ReducedSolution {
  SolveStatus status = SolveStatus::kNumericalTrouble;
  Eigen::MatrixXd prior_factor;  ///< q x k
  Eigen::MatrixXd gain;          ///< q x q
  Eigen::VectorXd multipliers;   ///< s
  double upper = std::numeric_limits<double>::infinity();
  double lower = 0.0;
  int iterations = 0;
  int inner_iterations = 0;
};

/// Puts the answer of a reduced problem into `solution`, in the coordinates of `problem`. Iterations are
/// added to those already there.
void restore(const GuaranteedProblem& problem, const ReducedProblem& reduced, const ReducedSolution& inner,
             Solution& solution);

/// Seconds since `start`.
[[nodiscard]] inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Reduces `problem`, solves by `algorithm` what no closed form answers, and fills `solution` except for its
/// method and time. Unbounded problems end with their directions, problems that no bound limits with the
/// unbiased estimate.
void solve_reduced(const GuaranteedProblem& problem,
                   const std::function<ReducedSolution(const ReducedProblem&)>& algorithm,
                   Solution& solution);

/// The whole of a method that works in reduced coordinates only: checks the settings, solves and takes the
/// time.
[[nodiscard]] Solution solve_reduced(const GuaranteedProblem& problem, const SolverSettings& settings,
                                     Method method,
                                     const std::function<ReducedSolution(const ReducedProblem&)>& algorithm);

}  // namespace trammel::inline TRAMMEL_ABI::minimax

#ifndef TRAMMEL_COMPILED
#include "trammel/minimax/reduced_solution_impl.hpp"
#endif
