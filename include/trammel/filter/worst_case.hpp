// SPDX-License-Identifier: Apache-2.0
/// @file
/// Largest steady error of a filter over all manoeuvres within a bound.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/filter/analysis.hpp"
#include "trammel/filter/design.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

/// What is looked at: a row of the estimates (0 is the coordinate), or the predicted coordinate.
struct FilterOutput {
  int row = 0;
  bool predicted = false;  ///< then `row` is ignored
};

/// Largest |error| per unit bound on |x^(v)|, for three classes of manoeuvres; unit s^(v - row).
/// Infinite where a row is not invariant up to degree v - 1 (rows of the published diagonal form) or the
/// filter is unstable.
struct WorstCaseBias {
  double constant = 0.0;            ///< x^(v) constant for ever: |integral of the kernel|
  double piecewise_constant = 0.0;  ///< constant between samples: sum of |integral over one interval|
  double arbitrary = 0.0;           ///< any measurable x^(v): integral of |kernel|, the rigorous bound
};

/// Kernel of the error of a filter: error(n) = T^(v-i) int_0^inf h(s) x^(v)(t_n - s T) ds.
///
/// The error operator has the factor d^v for rows that are invariant, d^v x is x^(v) averaged with the
/// uniform B-spline of order v (Curry and Schoenberg 1966), and the derivative rows add a part of finite
/// length, the remainder of numerical differentiation. So h is a polynomial of degree v - 1 on every
/// sampling interval, with coefficients that come without cancellation from the pulse response of a stable
/// filter. Column j of the result: coefficients of h(j + s), s in [0, 1), ascending.
/// Throws Error if the output is not invariant up to degree v - 1 or the filter is unstable.
[[nodiscard]] Eigen::MatrixXd error_kernel(const FilterDesign& design, FilterOutput output);

/// Norms of the error kernel. max over |x^(v)| <= omega of the mean-square error of the output is
/// (omega bias)^2 + noise variance, because the noise does not depend on the manoeuvre; for a bound on the
/// length of a vector x^(v) in space and the same filter on every axis, the same number bounds the length
/// of the error. Cost: O(memory n^2) for n poles.
[[nodiscard]] WorstCaseBias worst_case_bias(const FilterDesign& design, FilterOutput output);

/// Manoeuvre of magnitude one that attains the arbitrary bound at the latest sample: signs of the kernel as
/// switching times s (in intervals before the sample, ascending) with the sign before the first switch.
struct WorstManoeuvre {
  double first_sign = 1.0;
  std::vector<double> switches;
  double length = 0.0;  ///< intervals after which the kernel has died out
};
[[nodiscard]] WorstManoeuvre worst_manoeuvre(const FilterDesign& design, FilterOutput output);

}  // namespace trammel::inline TRAMMEL_ABI::filter

#ifndef TRAMMEL_COMPILED
#include "trammel/filter/worst_case_impl.hpp"
#endif
