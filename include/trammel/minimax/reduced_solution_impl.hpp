// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of reduced_solution.hpp.
#pragma once

#include <cmath>

#include "trammel/minimax/reduced_solution.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

namespace detail {

inline ReducedSolution exact_without_bounds(const ReducedProblem& reduced) {
  ReducedSolution exact;
  exact.status = SolveStatus::kOptimal;
  exact.upper = 0.0;
  exact.gain = Eigen::MatrixXd::Zero(reduced.size(), reduced.size());
  exact.prior_factor = Eigen::MatrixXd::Zero(reduced.size(), 0);
  exact.multipliers = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(reduced.ellipsoids()));
  return exact;
}

}  // namespace detail

TRAMMEL_INLINE void restore(const GuaranteedProblem& problem, const ReducedProblem& reduced,
                            const ReducedSolution& inner, Solution& solution) {
  const Eigen::Index p = problem.parameters();
  solution.status = inner.status;
  solution.iterations += inner.iterations;
  solution.inner_iterations += inner.inner_iterations;
  solution.upper = inner.upper + reduced.free_error;
  solution.lower = inner.lower + reduced.free_error;
  solution.claim = std::isfinite(solution.upper) ? Claim::kApproximate : Claim::kNone;
  solution.multipliers = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(problem.ellipsoids.size()));
  for (std::size_t i = 0; i < reduced.owner.size(); ++i) {
    solution.multipliers[static_cast<Eigen::Index>(reduced.owner[i])] =
        inner.multipliers[static_cast<Eigen::Index>(i)];
  }
  solution.gain = reduced.basis * inner.gain * reduced.basis.transpose();
  solution.gain += reduced.free_basis * reduced.free_basis.transpose();
  // The unbounded directions get a prior so wide that narrowing it would not be seen in double precision.
  constexpr double kWide = 1e7;  // squared: 1e14 times the estimate's variance
  solution.prior_factor.resize(p, inner.prior_factor.cols() + reduced.free_basis.cols());
  solution.prior_factor << reduced.basis * inner.prior_factor, kWide * reduced.free_basis;
}

TRAMMEL_INLINE void solve_reduced(const GuaranteedProblem& problem,
                                  const std::function<ReducedSolution(const ReducedProblem&)>& algorithm,
                                  Solution& solution) {
  const ReducedProblem reduced = reduce(problem);
  if (reduced.unbounded_directions.cols() > 0) {
    solution.status = SolveStatus::kUnbounded;
    solution.upper = std::numeric_limits<double>::infinity();
    solution.lower = std::numeric_limits<double>::infinity();
    solution.unbounded_directions = reduced.unbounded_directions;
    return;
  }
  const bool nothing_to_bound = reduced.size() == 0 || reduced.criterion.squaredNorm() == 0.0;
  restore(problem, reduced, nothing_to_bound ? detail::exact_without_bounds(reduced) : algorithm(reduced),
          solution);
}

TRAMMEL_INLINE Solution
solve_reduced(const GuaranteedProblem& problem, const SolverSettings& settings, Method method,
              const std::function<ReducedSolution(const ReducedProblem&)>& algorithm) {
  validate(settings, "settings");
  const auto start = std::chrono::steady_clock::now();
  Solution solution;
  solution.method = method;
  solve_reduced(problem, algorithm, solution);
  solution.solve_time_s = seconds_since(start);
  return solution;
}

}  // namespace trammel::inline TRAMMEL_ABI::minimax
