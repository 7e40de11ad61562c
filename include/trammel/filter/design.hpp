// SPDX-License-Identifier: Apache-2.0
/// @file
/// Synthesis of invariant filters: from order of astatism and smoothing polynomials to transfer functions.
#pragma once

#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/filter/polynomial.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

/// Largest order of astatism: beyond it double precision no longer carries the factorials and binomials.
inline constexpr int kMaxOrder = 10;

/// How the predicted coordinate and the rows of derivatives are formed.
enum class FilterMode {
  kDerivatives,  ///< artificial feedback in every row: predictions use the estimated derivatives
  kDifferences,  ///< the diagonal form as published: predictions use past coordinates only
};

[[nodiscard]] constexpr std::string_view to_string(FilterMode mode) noexcept {
  return mode == FilterMode::kDerivatives ? "derivatives" : "differences";
}

/// What a filter is made from. All indices count from 0: row i estimates the i-th derivative.
struct FilterSpecification {
  int order = 2;            ///< order of astatism v: polynomials of degree below v are tracked without error
  int rows = 2;             ///< number k of estimated rows x, x', ..., 1 <= k <= v
  double sampling_s = 1.0;  ///< interval T between samples, s
  FilterMode mode = FilterMode::kDerivatives;
  std::vector<Polynomial> a;  ///< smoothing polynomials in q, one per row, a_i(0) = 1
  std::vector<Polynomial> b;  ///< smoothing polynomials in q, one per row
  /// Constant gains kappa_i = a_i - b_i with a_i = 1, in place of a and b, which stay empty: small gains
  /// would lose their digits in b_i = 1 - kappa_i.
  Eigen::VectorXd gains;
};

/// Specification with constant gains kappa_i. The correction of row i is
/// kappa_i / (i! T^i) times the innovation: alpha, beta/T, gamma/(2 T^2), ...
[[nodiscard]] FilterSpecification from_gains(int order, double sampling_s, const Eigen::VectorXd& gains,
                                             FilterMode mode = FilterMode::kDerivatives);

/// Gains kappa of a specification with constant gains, or with constant a_i and b_i; empty otherwise.
[[nodiscard]] Eigen::VectorXd constant_gains(const FilterSpecification& specification);

/// Transfer functions of a filter from the measurement g(n). The common denominator is not reduced.
struct FilterDesign {
  FilterSpecification specification;
  Polynomial denominator;              ///< P(q), P(0) = 1
  std::vector<Polynomial> numerators;  ///< estimate of row i: N_i(q) / P(q), unit s^-i
  Polynomial prediction_numerator;     ///< prediction of the coordinate from data up to n - 1
  Polynomial innovation_numerator;     ///< g - prediction

  // The same in powers of d = 1 - q for T = 1 (row i times T^i): what the analysis works with.
  Polynomial denominator_d;
  std::vector<Polynomial> numerators_d;
  Polynomial innovation_numerator_d;
};

/// Invariant filter for g(n) = x(n) + f(n), f white: estimates of x, x', ..., x^(k-1) whose errors do not
/// depend on x as long as it is a polynomial of degree below v.
///
/// | symbol  | meaning                                                                    | shape, unit   |
/// |---------|----------------------------------------------------------------------------|---------------|
/// | q, d    | shift z^-1 and difference 1 - q                                            | -             |
/// | T       | sampling interval                                                          | s             |
/// | v, k    | order of astatism, number of rows                                          | 1 <= k <= v   |
/// | D       | (1/(i! T^i)), i = 0..k-1                                                    | k, s^-i       |
/// | A, B    | matrices that fix the accuracy of prediction and estimate                  | k x k in q    |
/// | F       | predictor I - A, strictly causal                                           | k x k in q    |
/// | S       | operator from innovation to residual, diag(b_i/a_i) here                   | k x k in q    |
/// | u       | innovation g - H F x                                                       | -             |
///
/// Method: Pichugin, Zimchuk, Kankin (2004), eqs. (5)-(25), with corrections. The filter is
/// A x = (I - S) D u with the scalar innovation u, their eqs. (19) and (22).
/// - kDifferences is their particular method as printed: A = diag(d^(v-i) a_i), B = diag(d^(v-i) b_i), the
///   prediction made from past coordinates only.
/// - kDerivatives carries the replacement of differences by estimated derivatives, their eq. (25), through
///   every row: A = diag(a_i) (I - F0), where F0 is `predictor`. For k = v these are the alpha-beta,
///   alpha-beta-gamma, ... filters; for k < v the last derivative is extrapolated with the weights of the
///   Adams-Bashforth formulas.
///
/// The published example (v = k = 2, b constant) and where its derivation holds:
/// - Its matrices A, B, F, C and eqs. (5)-(13), (15)-(18), (20)-(22) are right for it. The second row of its
///   example lacks the factor 1/T that D and its last formula have.
/// - "The vector of innovations is H_P times the innovation", used to reach eq. (13), does not follow from
///   eqs. (6) and (8) unless all A_i/C_i are equal, which in the example means b_0 = b_0' = 1. It defines
///   another filter (scalar innovation), which is the one derived from there on.
/// - Eq. (25) holds for the sum over all differences only (Newton's series is Taylor's), not term by term
///   from the second difference on.
/// - That the result is the alpha-beta filter is true after the replacement (25) only: before it the
///   denominator is 1 - 2(1-alpha)q + (1-alpha)q^2, after it 1 - (2-alpha-beta)q + (1-alpha)q^2, equal only
///   if alpha = beta. Before it the velocity row is biased by the factor beta/alpha, the filter is stable
///   for 0 < alpha < 4/3 only and its noise gain is at least 1/2.
/// - H_P must not contain the factor 1/(k-1)! if its rows are to be derivatives, and v + 1 - k >= 1 (here
///   k <= v) and a_i(0) = 1 are needed for eqs. (23), (24).
///
/// Guarantee: in kDerivatives and with stable P all rows and the prediction have no steady error up to
/// degree v - 1; in kDifferences the coordinate and the prediction only.
/// Throws Error for k outside 1..v, v outside 1..kMaxOrder, T not positive, a_i(0) != 1, polynomials missing
/// or not finite. Cost: polynomial products of degree v + sum of degrees.
[[nodiscard]] FilterDesign synthesise(const FilterSpecification& specification);

/// Predictor F0 of kDerivatives: entry (i, j) in powers of q, unit s^(j-i); exact for every polynomial
/// trajectory of degree below `order`.
///
/// Columns j < k-1: q T^(j-i)/(j-i)!, j >= i. Last column, with m = v - k:
/// q T^(k-1-i) sum_{l=0..m} [(-ln(1-d))^l up to d^m] / (k-1-i+l)!.
[[nodiscard]] std::vector<std::vector<Polynomial>> predictor(int order, int rows, double sampling_s);

/// Gains kappa of the filter with k = v in kDerivatives whose denominator is P, given in powers of d with
/// P(d = 1) = 1: P is affine in the gains, and triangular in powers of d.
[[nodiscard]] Eigen::VectorXd gains_from_denominator(const Polynomial& denominator_d);

/// 0!, 1!, ..., as double.
[[nodiscard]] double factorial(int n);

}  // namespace trammel::inline TRAMMEL_ABI::filter

#ifndef TRAMMEL_COMPILED
#include "trammel/filter/design_impl.hpp"
#endif
