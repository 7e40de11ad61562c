// SPDX-License-Identifier: Apache-2.0
/// @file
/// Polynomials in the shift q = z^-1 and in the backward difference d = 1 - q: the arithmetic behind the
/// transfer functions of the invariant filters.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

/// Coefficients in ascending powers; never empty.
///
/// A filter with small gains has a denominator whose coefficients in q are of order one while its value at
/// q = 1, which decides steady errors, is tiny. In powers of d that value is the first coefficient, so all
/// computations run in d and only results are turned into q.
using Polynomial = Eigen::VectorXd;

/// The constant `value`.
[[nodiscard]] Polynomial constant(double value);
/// p + factor r, padded to the longer one.
[[nodiscard]] Polynomial add(const Polynomial& p, const Polynomial& r, double factor = 1.0);
[[nodiscard]] Polynomial multiply(const Polynomial& p, const Polynomial& r);
/// x^shift p(x).
[[nodiscard]] Polynomial raise(const Polynomial& p, int shift);
/// p(1 - x): turns coefficients in q into coefficients in d and back.
[[nodiscard]] Polynomial reflect(const Polynomial& p);
/// Without trailing coefficients that are rounding errors beside the largest one; at least one is kept.
[[nodiscard]] Polynomial trim(const Polynomial& p);
/// First `terms` coefficients of the power series of p / r, r(0) != 0.
[[nodiscard]] Polynomial divide_series(const Polynomial& p, const Polynomial& r, int terms);
/// First `terms` coefficients of (-ln(1 - d))^power: the derivative T^power (d/dt)^power in differences.
[[nodiscard]] Polynomial derivative_series(int power, int terms);
/// Value at a point.
[[nodiscard]] double evaluate(const Polynomial& p, double x);

/// Poles z of 1/p(z^-1): the nonzero roots of z^n p(1/z) by the eigenvalues of the companion matrix, with
/// one zero pole for each vanishing last coefficient. v-fold poles are accurate to about eps^(1/v) only:
/// do not judge stability by them.
[[nodiscard]] Eigen::VectorXcd poles(const Polynomial& denominator_q);

/// Reflection coefficients of the Schur-Cohn step-down of p(q), p(0) != 0: all poles lie inside the unit
/// circle if and only if all of them lie in (-1, 1). Stops at the first that does not.
[[nodiscard]] std::vector<double> reflection_coefficients(const Polynomial& denominator_q);

/// Schur-Cohn criterion for a denominator in powers of d.
///
/// The bilinear map w = d/(2 - d) turns the unit circle into the imaginary axis and the step-down into
/// Routh's array, which is built from sums of the coefficients in d; so poles at 1 - 1e-3 of order five
/// are told from unstable ones, where the step-down in q has lost all digits. Marginal is not stable.
[[nodiscard]] bool is_stable(const Polynomial& denominator_d);

/// Integral over [0, 1] of |p(s)|, exact up to rounding: p is integrated between its sign changes.
[[nodiscard]] double integrate_absolute(const Eigen::Ref<const Eigen::VectorXd>& p);

}  // namespace trammel::inline TRAMMEL_ABI::filter

#ifndef TRAMMEL_COMPILED
#include "trammel/filter/polynomial_impl.hpp"
#endif
