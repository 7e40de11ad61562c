// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of worst_case.hpp.
#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/filter/analysis_impl.hpp"
#include "trammel/filter/polynomial_impl.hpp"
#include "trammel/filter/worst_case.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

namespace detail {

/// Pieces of the uniform B-spline of order v on [0, v]: column l holds M_v(l + s), from the recursion
/// M_v(x) = (x M_(v-1)(x) + (v - x) M_(v-1)(x - 1)) / (v - 1).
inline Eigen::MatrixXd spline_pieces(int order) {
  Eigen::MatrixXd pieces = Eigen::MatrixXd::Ones(1, 1);
  for (int v = 2; v <= order; ++v) {
    Eigen::MatrixXd next = Eigen::MatrixXd::Zero(v, v);
    for (int l = 0; l < v; ++l) {
      if (l < v - 1) {
        next.col(l).head(v - 1) += l * pieces.col(l);
        next.col(l).tail(v - 1) += pieces.col(l);
      }
      if (l > 0) {
        next.col(l).head(v - 1) += (v - l) * pieces.col(l - 1);
        next.col(l).tail(v - 1) -= pieces.col(l - 1);
      }
    }
    pieces = next / (v - 1);
  }
  return pieces;
}

/// c (j + s)^power / power! as coefficients in s, added to `column`.
inline void add_shifted_power(Eigen::Ref<Eigen::VectorXd> column, int power, double j, double c) {
  for (int i = 0; i <= power; ++i) {
    column[i] += c * std::pow(j, power - i) / (factorial(i) * factorial(power - i));
  }
}

/// Finite part for row i > 0: kernel of x^(i) - (its backward-difference formula of order v), T = 1;
/// columns as in error_kernel, v - 1 of them.
inline Eigen::MatrixXd differentiation_kernel(int order, int row) {
  Eigen::MatrixXd kernel = Eigen::MatrixXd::Zero(order, order - 1);
  if (row == 0) {
    return kernel;
  }
  const Polynomial weights = reflect(derivative_series(row, order));
  for (int j = 0; j < order - 1; ++j) {
    add_shifted_power(kernel.col(j), order - 1 - row, j, 1.0);
    for (int l = 0; l <= j; ++l) {
      add_shifted_power(kernel.col(j), order - 1, j - l, -weights[l]);
    }
  }
  return kernel;
}

/// Error operator divided by d^v, times P: polynomial in d; Error if the division is not exact.
inline Polynomial invariant_factor(const FilterDesign& design, FilterOutput output) {
  const int order = design.specification.order;
  if (output.predicted) {
    return design.innovation_numerator_d.tail(design.innovation_numerator_d.size() - order);
  }
  const Polynomial& numerator = design.numerators_d[static_cast<std::size_t>(output.row)];
  const Polynomial series = derivative_series(output.row, order);
  const Polynomial error = add(multiply(series, design.denominator_d), numerator, -1.0);
  const Polynomial sizes = add(multiply(series, design.denominator_d.cwiseAbs()), numerator.cwiseAbs());
  for (int i = 0; i < order; ++i) {
    require(std::abs(error[i]) <= kSeriesNoise * sizes.sum(), "output.row",
            "row " + std::to_string(output.row) + ", not invariant up to degree " + std::to_string(order - 1),
            "a row whose error is bounded under a bound on derivative " + std::to_string(order));
  }
  return error.tail(error.size() - order);
}

/// True if the steady error of the output vanishes up to degree v - 1.
inline bool is_invariant(const FilterDesign& design, FilterOutput output) {
  return output.predicted || output.row == 0 || design.specification.mode == FilterMode::kDerivatives;
}

}  // namespace detail

TRAMMEL_INLINE Eigen::MatrixXd error_kernel(const FilterDesign& design, FilterOutput output) {
  require(output.predicted || (output.row >= 0 && output.row < design.specification.rows), "output.row",
          std::to_string(output.row), "a row of the design");
  require(is_stable(design.denominator_d), "design", "an unstable filter", "a stable one");
  const int order = design.specification.order;
  const Polynomial factor = detail::invariant_factor(design, output);
  const DeltaRealisation realisation(design.denominator_d);
  const int memory = realisation.memory();
  const Eigen::VectorXd pulse = realisation.impulse_response(factor, memory);
  const Eigen::MatrixXd pieces = detail::spline_pieces(order);
  Eigen::MatrixXd kernel = Eigen::MatrixXd::Zero(order, memory + order);
  for (int j = 0; j < memory; ++j) {
    kernel.middleCols(j, order) += pulse[j] * pieces;
  }
  if (!output.predicted && order > 1) {
    kernel.leftCols(order - 1) += detail::differentiation_kernel(order, output.row);
  }
  return kernel;
}

TRAMMEL_INLINE WorstCaseBias worst_case_bias(const FilterDesign& design, FilterOutput output) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (!detail::is_invariant(design, output) || !is_stable(design.denominator_d)) {
    return {kInfinity, kInfinity, kInfinity};
  }
  const Eigen::MatrixXd kernel = error_kernel(design, output);
  const Eigen::Index order = kernel.rows();
  Eigen::VectorXd weights(order);
  for (Eigen::Index i = 0; i < order; ++i) {
    weights[i] = 1.0 / static_cast<double>(i + 1);
  }
  double sum = 0.0;
  WorstCaseBias bias;
  for (Eigen::Index j = 0; j < kernel.cols(); ++j) {
    const double integral = weights.dot(kernel.col(j));
    sum += integral;
    bias.piecewise_constant += std::abs(integral);
    bias.arbitrary += integrate_absolute(kernel.col(j));
  }
  bias.constant = std::abs(sum);
  const int power = design.specification.order - (output.predicted ? 0 : output.row);
  const double scale = std::pow(design.specification.sampling_s, power);
  bias.constant *= scale;
  bias.piecewise_constant *= scale;
  bias.arbitrary *= scale;
  return bias;
}

TRAMMEL_INLINE WorstManoeuvre worst_manoeuvre(const FilterDesign& design, FilterOutput output) {
  const Eigen::MatrixXd kernel = error_kernel(design, output);
  WorstManoeuvre worst;
  worst.length = static_cast<double>(kernel.cols());
  double sign = 0.0;
  for (Eigen::Index j = 0; j < kernel.cols(); ++j) {
    std::vector<double> ends = detail::sign_changes(kernel.col(j));
    ends.push_back(1.0);
    double previous = 0.0;
    for (const double end : ends) {
      const double value = evaluate(kernel.col(j), 0.5 * (previous + end));
      const double here = value < 0.0 ? -1.0 : 1.0;
      if (sign == 0.0) {
        worst.first_sign = here;
      } else if (here != sign && value != 0.0) {
        worst.switches.push_back(static_cast<double>(j) + previous);
      }
      if (sign == 0.0 || value != 0.0) {
        sign = here;
      }
      previous = end;
    }
  }
  return worst;
}

}  // namespace trammel::inline TRAMMEL_ABI::filter
