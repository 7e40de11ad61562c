// SPDX-License-Identifier: Apache-2.0
/// @file
/// The guaranteed problem as a linear matrix inequality, and its solution by the general semidefinite solver.
#pragma once

#include <utility>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/minimax/reduction.hpp"
#include "trammel/minimax/solution.hpp"
#include "trammel/problem/guaranteed_problem.hpp"
#include "trammel/sdp/problem.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

/// The linear matrix inequality (14) of Mamaev and Semenikhin (README, Sources) in symmetric matrices K, N
/// and lambda:
///
///   min tr W N + sum lambda   s.t.  [H(lambda)   (KJ - I)'B']      [N      B K G]
///                                   [B (KJ - I)  E          ] >= 0, [G'K B' E_2 ] >= 0,   lambda >= 0.
///
/// | symbol | in the paper's coordinates | in whitened coordinates w, theta = T w                         |
/// |--------|----------------------------|-----------------------------------------------------------------|
/// | B, W   | I, S                       | C T without zero rows, I                                        |
/// | E, E_2 | S^-1, J^-1                 | I, I                                                            |
/// | G      | I                          | J^(1/2) without zero columns                                    |
/// | N      | M of the paper, M >= K J K | C M C'                                                          |
///
/// Whitened: J = I and C T diagonal where J is definite beside the bounds; where it is not, T makes
/// J + sum H_l = I and J diagonal.
struct MatrixInequality {
  sdp::Problem program;
  Eigen::MatrixXd basis;              ///< T: coordinates of the given problem from those of the inequality
  Eigen::Index size = 0;              ///< rows of K, and of H(lambda) in block 0
  Eigen::Index first_multiplier = 0;  ///< variable that is lambda_1
  /// Row and column of K for each of the first variables; entries that do not matter are left out.
  std::vector<std::pair<Eigen::Index, Eigen::Index>> gain_entries;
};

/// The inequality in whitened coordinates of a reduced problem. p^2 + p + s variables where J and S are
/// definite, fewer otherwise.
[[nodiscard]] MatrixInequality whitened_inequality(const ReducedProblem& reduced);

/// The inequality exactly as printed, in the problem's own coordinates; hard for every floating-point solver
/// (README, Design). Throws Error where J or S is singular to working precision.
[[nodiscard]] MatrixInequality printed_inequality(const GuaranteedProblem& problem);

/// Solves the guaranteed problem through `whitened_inequality` and sdp::solve.
///
/// The bounds returned do not rest on that solver: `lower` is f(V) for V from its multiplier, scaled to the
/// bounds, `upper` belongs to the better of its own K and the gain of V, each with multipliers raised until
/// the inequality holds. Cost O(p^6): meant for p up to about 45, to check the structured method.
[[nodiscard]] Solution solve_semidefinite(const GuaranteedProblem& problem,
                                          const SolverSettings& settings = {},
                                          const ProgressObserver& observe = {});

}  // namespace trammel::inline TRAMMEL_ABI::minimax

#ifndef TRAMMEL_COMPILED
#include "trammel/minimax/matrix_inequality_impl.hpp"
#endif
