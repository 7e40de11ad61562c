// SPDX-License-Identifier: Apache-2.0
/// @file
/// Solves semidefinite programs by a primal-dual interior-point method.
#pragma once

#include "trammel/core/progress.hpp"
#include "trammel/sdp/problem.hpp"
#include "trammel/sdp/solution.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp {

/// Primal-dual path following from an infeasible start with Mehrotra's predictor and corrector and the HKM
/// direction.
///
/// With X = sum x_i F_i - F_0 and the perturbed complementarity X Y = mu I, a Newton step solves
///   B dx = r,   B_ij = <F_i, X^-1 F_j Y>,
///   dX = sum dx_i F_i + (sum x_i F_i - F_0 - X),   dY = sym(mu X^-1 - Y - X^-1 dX Y).
///
/// | symbol | shape | meaning                                                             |
/// |--------|-------|---------------------------------------------------------------------|
/// | x      | m     | variables; m = cost.size()                                          |
/// | X, Y   | block | slack of (P) and multiplier (D)                                     |
/// | B      | m x m | Schur complement, positive definite, dense                          |
/// | mu     | -     | <X, Y> / n, n the total size of the cones                           |
///
/// Method: Helmberg, Rendl, Vanderbei, Wolkowicz (1996); Kojima, Shindoh, Hara (1997); Monteiro (1997);
/// products for B chosen per constraint by a count of operations as in Fujisawa, Kojima, Nakata (1997);
/// starting point and centring as in Toh, Todd, Tutuncu (1999); step length by Lanczos as in Toh (2002).
/// Before solving, dense blocks are split into the connected components of their sparsity pattern and
/// opposite rows of diagonal blocks become equations. Dependent constraints are dropped by the factorisation
/// of B, whose solutions are refined against B itself; in small problems B is factorised through M with
/// B = M'M where its condition exceeds the digits at hand. Where (D) has no interior points, x would grow
/// without end: the iteration then stays on the path of costs c + r with a residual r below the tolerance, up
/// to where c'x = <F_0, Y>, and moves Y to the nearest point with <F_i, Y> = c_i. Such optima are attained up
/// to the tolerance only, and depend on it. Where rounding errors stop the progress all the same and the
/// problem is small, the solver goes on in double-double numbers. Guarantee: the error measures of the result
/// are computed from the returned x, X, Y and the problem as given; infeasibility is only reported with a ray
/// whose violation was checked. The same input gives the same bits. Cost: per iteration O(m^3 + m^2 n + m
/// n^3) at worst, far less for sparse F_i; memory m^2 + O(n^2) per block.
[[nodiscard]] Solution solve(const Problem& problem, const Settings& settings = {},
                             const ProgressObserver& observe = {});

/// Error measures of any x, X, Y for a problem; knows nothing of the solver.
[[nodiscard]] DimacsErrors dimacs_errors(const Problem& problem, const Eigen::VectorXd& x,
                                         const BlockMatrix& slack, const BlockMatrix& multiplier);

}  // namespace trammel::inline TRAMMEL_ABI::sdp

#ifndef TRAMMEL_COMPILED
#include "trammel/sdp/solve_impl.hpp"
#endif
