// SPDX-License-Identifier: Apache-2.0
/// @file
/// The Hessian of Newton's method in the multipliers in O(p^3) operations.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

/// A term of 1/x = sum weight exp(-rate x).
struct ExponentialTerm {
  double weight = 0.0;
  double rate = 0.0;
};

/// Relative error of exponential_sum.
inline constexpr double kExponentialSumError = 5e-3;

/// A sum of exponentials that agrees with 1/x for smallest <= x <= largest up to kExponentialSumError of it:
/// the trapezoidal rule for the integral of exp(u - x exp(u)) (Braess and Hackbusch 2005, "Approximation of
/// 1/x by exponential sums"). About 4 + 0.85 log(largest / smallest) terms, rates rising.
[[nodiscard]] std::vector<ExponentialTerm> exponential_sum(double smallest, double largest);

/// gram_lm = sum_ij (h_l)_ij (h_m)_ij / (b_i b_j (b_i + b_j)) (lower triangle) up to kExponentialSumError of
/// itself, in the semidefinite order too; h_l = rows_l' rows_l.
///
/// Method: with 1/(b_i + b_j) = sum_k w_k exp(-t_k b_i) exp(-t_k b_j) every term is the squared norm of a
/// block of rows D_k rows', D_k diagonal. A term whose exponential has died out beyond some b takes no notice
/// of the columns there. Blocked over columns; the same to the last bit for any number of threads. Cost: half
/// a product per term at most, four to eight in all, where bound_gram takes s^2 / (36 p) of them; memory O(p)
/// per thread.
///
/// | symbol | argument  | shape    | meaning                                                      |
/// |--------|-----------|----------|--------------------------------------------------------------|
/// | e      | rows      | rows x p | bound rows in the basis of the eigenvectors                  |
/// | -      | first_row | s + 1    | ellipsoid l owns rows first_row[l] .. first_row[l + 1] - 1   |
/// | b      | root      | p        | positive, rising                                             |
void separable_gram(const Eigen::MatrixXd& rows, const std::vector<Eigen::Index>& first_row,
                    const Eigen::VectorXd& root, Eigen::MatrixXd& gram, unsigned threads);

}  // namespace trammel::inline TRAMMEL_ABI::minimax

#ifndef TRAMMEL_COMPILED
#include "trammel/minimax/separable_gram_impl.hpp"
#endif
