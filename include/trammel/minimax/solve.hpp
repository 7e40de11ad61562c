// SPDX-License-Identifier: Apache-2.0
/// @file
/// Solves the guaranteed problem with the structured method.
#pragma once

#include "trammel/core/progress.hpp"
#include "trammel/minimax/solution.hpp"
#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

/// Structured method, the default: Newton's method in the multipliers where it applies, the primal-dual
/// interior point otherwise. Throws Error for shapes that do not fit or entries that are not finite.
[[nodiscard]] Solution solve(const GuaranteedProblem& problem, const SolverSettings& settings = {},
                             const ProgressObserver& observe = {});

}  // namespace trammel::inline TRAMMEL_ABI::minimax

#ifndef TRAMMEL_COMPILED
#include "trammel/minimax/solve_impl.hpp"
#endif
