// SPDX-License-Identifier: Apache-2.0
/// @file
/// The conditional-gradient method for the guaranteed problem, independent of the interior points.
#pragma once

#include <concepts>
#include <string_view>
#include <type_traits>

#include "trammel/core/progress.hpp"
#include "trammel/minimax/solution.hpp"
#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

/// How the next prior is made from the present one and the worst one found.
enum class ConditionalGradientVariant {
  kPlain,            ///< exact line search between the two: algorithm 1 of the paper
  kFullyCorrective,  ///< best prior on the span of all directions found so far
};

[[nodiscard]] constexpr std::string_view to_string(ConditionalGradientVariant variant) noexcept {
  return variant == ConditionalGradientVariant::kPlain ? "plain" : "fully-corrective";
}

/// Maximises the concave dual f(V) = tr C (V^-1 + J)^-1 C' over the priors within the bounds by Frank and
/// Wolfe's method.
///
/// Each step linearises f at V, finds the worst prior V' for the gradient Sigma(V) (`worst_prior`) and moves
/// towards it. The multipliers of that oracle satisfy H(lambda) >= Sigma(V), so with the gain of V they are
/// the certified upper bound of the step, and f(V) the lower one: the gap stands in every result.
/// Start: a multiple of the identity in coordinates where the H_l sum to it, at 0.9 of the bounds.
///
/// Source: algorithm 1 and theorem 1 of "Minimax estimation of a flight trajectory ... by dual optimisation"
/// (README, Sources), for any number of ellipsoids; Frank and Wolfe (1956); Jaggi (2013), section 3.2, for
/// the corrective form, here over the semidefinite face that the directions span (`InteriorPoint` on that
/// face). Guarantee: both bounds are feasible at every exit, up to rounding; `iteration_limit` leaves the gap
/// reached. Cost per step: one oracle (50 q x q products); a line search (15 products) or a solve on the
/// face. The plain form converges like 1/k: thousands of steps for six digits; the corrective one takes at
/// most q.
[[nodiscard]] Solution solve_by_conditional_gradient(
    const GuaranteedProblem& problem, const SolverSettings& settings = {},
    ConditionalGradientVariant variant = ConditionalGradientVariant::kFullyCorrective,
    const ProgressObserver& observe = {});

}  // namespace trammel::inline TRAMMEL_ABI::minimax

#ifndef TRAMMEL_COMPILED
#include "trammel/minimax/conditional_gradient_impl.hpp"
#endif
