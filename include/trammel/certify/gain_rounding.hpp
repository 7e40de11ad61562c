// SPDX-License-Identifier: Apache-2.0
/// @file
/// An estimator's matrix in binary64 that hardly moves the matrix inequality.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// K = L (I + L'JL)^-1 L', the optimal estimator for the prior V = L L' (p x p, L square), computed in 32
/// digits and rounded to binary64 so that E = K J - I stays where it is rather than K itself.
///
/// In badly conditioned coordinates (truncated powers over a long flight) rounding every entry of K to the
/// nearest number moves E by up to 1e-5 of the bound. Here each entry is rounded knowing the errors of those
/// before it in its row, and the entries that have the most effect on K J L come first: the nearest-plane
/// method for the closest vector of a lattice (Babai 1986, "On Lovasz' lattice reduction and the nearest
/// lattice point problem"), with the rows of J L, each times a unit in the last place of its column of K, as
/// lattice basis. What is left is the effect of the last entries alone.
///
/// Cost: some ten p x p products in double-double arithmetic. Empty where the numbers overflow or L is not
/// square. Throws Error for shapes that do not fit.
[[nodiscard]] Eigen::MatrixXd round_gain(const GuaranteedProblem& problem,
                                         const Eigen::MatrixXd& prior_factor);

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/gain_rounding_impl.hpp"
#endif
