// SPDX-License-Identifier: Apache-2.0
/// @file
/// Lower bound of the risk of every estimator from a correlated Gaussian prior with smooth cut-offs.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// Distribution of |g|, g ~ N(0, diag(e)), scaled so that max e = 1: P(|g| <= r) on a uniform grid. Built one
/// variance after the other by Gauss-Legendre quadrature, the largest in closed form; the absolute error is
/// below kProbabilityError (tested against chi distributions).
class GaussianNorm {
 public:
  static constexpr double kProbabilityError = 1e-7;

  /// variances: any number, >= 0, not all zero.
  explicit GaussianNorm(const Eigen::VectorXd& variances);

  /// P(|g| <= r) for the variances given (not scaled).
  [[nodiscard]] double probability(double r) const;

 private:
  double scale_ = 1.0;  ///< root of the largest variance
  double step_ = 0.0;
  Eigen::VectorXd table_;
};

/// D such that a cut-off at the unit ball costs 2 omega^2 P(|g| >= a)/E f(|g|)^2, f = 1 up to a, a quarter
/// cosine from a to 1, omega = pi/(2 (1 - a)), minimised over a; g = factor times the vector of `norm`.
/// Probabilities are rounded to the safe side by kProbabilityError.
[[nodiscard]] double cut_off_information(const GaussianNorm& norm, double factor);

/// tr S (J + G^-1 + sum_l D_l H_l)^-1 with G = k^2 L L', D_l = cut_off_information, the best k of a grid: no
/// estimator has a smaller worst mean-square error, for any intersection of ellipsoids. Van Trees inequality
/// for the prior proportional to N(0, G) prod_l f(|a_l theta|)^2; the information of the cut-offs is bounded
/// by the Gaussian correlation inequality (Royen 2014), block by block, without a union bound.
/// prior_factor: p x k with <H_l, L L'> <= 1. Lowered by 1e-9 of itself for rounding errors. Cost: about
/// twenty factorisations.
[[nodiscard]] double correlated_bound(const GuaranteedProblem& problem, const Eigen::MatrixXd& prior_factor);

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/correlated_prior_impl.hpp"
#endif
