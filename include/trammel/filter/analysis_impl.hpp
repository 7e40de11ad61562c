// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of analysis.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/filter/analysis.hpp"
#include "trammel/filter/design_impl.hpp"
#include "trammel/filter/polynomial_impl.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

namespace detail {

/// A term of an error series below this part of its sum of absolute values is zero.
inline constexpr double kSeriesNoise = 1e-10;

/// Coefficients in powers of y of p(d) with d = 1 - exp(-y), up to y^(terms-1).
inline Polynomial substitute_difference(const Polynomial& p, int terms) {
  Polynomial difference = Polynomial::Zero(terms);
  for (int i = 1; i < terms; ++i) {
    difference[i] = (i % 2 == 1 ? 1.0 : -1.0) / factorial(i);
  }
  Polynomial value = Polynomial::Zero(terms);
  for (Eigen::Index i = std::min<Eigen::Index>(p.size(), terms) - 1; i >= 0; --i) {
    value = multiply(value, difference).head(terms).eval();
    value[0] += p[i];
  }
  return value;
}

/// Error of one row in powers of d, T = 1: (-ln(1-d))^row - N/P, `terms` terms.
/// The terms that are zero by design come out as rounding errors and are set to zero.
inline Polynomial error_series(const Polynomial& numerator_d, const Polynomial& denominator_d, int row,
                               int terms) {
  // ((-ln(1-d))^row P - N) / P: differences of polynomials first, so small terms keep their digits.
  const Polynomial series = derivative_series(row, terms);
  Polynomial difference = multiply(series, denominator_d).head(terms);
  const Polynomial sizes = multiply(series, denominator_d.cwiseAbs()).head(terms);
  for (Eigen::Index i = 0; i < terms; ++i) {
    difference[i] -= i < numerator_d.size() ? numerator_d[i] : 0.0;
    if (std::abs(difference[i]) <= kCoefficientNoise * sizes[i]) {
      difference[i] = 0.0;
    }
  }
  return divide_series(difference, denominator_d, terms);
}

/// First power whose term is not zero; `series.size()` if all are.
inline int leading_power(const Polynomial& series) {
  const double noise = kSeriesNoise * series.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < series.size(); ++i) {
    if (std::abs(series[i]) > noise) {
      return static_cast<int>(i);
    }
  }
  return static_cast<int>(series.size());
}

}  // namespace detail

TRAMMEL_INLINE DeltaRealisation::DeltaRealisation(const Polynomial& denominator_d) {
  const Polynomial& p = denominator_d;
  const Eigen::Index n = p.size() - 1;
  // P(d = 0) is about the product of the distances of the slow poles from 1, its degree-th root their size.
  if (n > 0 && p[0] != 0.0) {
    const double bandwidth = std::pow(std::abs(p[0]), 1.0 / static_cast<double>(n));
    constexpr double kSmallest = 1e-12;  // keeps powers of the scale finite
    scale_ = std::clamp(bandwidth, kSmallest, 1.0);
  }
  transition_.resize(n + 1, n);
  input_.resize(n + 1);
  for (Eigen::Index j = 0; j <= n; ++j) {
    double sum = 0.0;
    for (Eigen::Index l = 0; l < n; ++l) {
      sum += p[l];
      const double carried = l >= j ? 1.0 : 0.0;
      transition_(j, l) = (carried - sum) * std::pow(scale_, static_cast<double>(l - j));
    }
    input_[j] = std::pow(scale_, static_cast<double>(n - j));
  }
}

TRAMMEL_INLINE Eigen::VectorXd DeltaRealisation::output_row(const Polynomial& numerator_d) const {
  const Eigen::Index n = states();
  require(numerator_d.size() <= n + 1, "numerator_d", "degree above the denominator's", "a proper fraction");
  Eigen::VectorXd row = Eigen::VectorXd::Zero(n + 1);
  for (Eigen::Index j = 0; j < numerator_d.size(); ++j) {
    row[j] = numerator_d[j] * std::pow(scale_, static_cast<double>(j - n));
  }
  return row;
}

TRAMMEL_INLINE Eigen::MatrixXd DeltaRealisation::covariance() const {
  const Eigen::Index n = states();
  Eigen::MatrixXd a = transition_.topRows(n);
  Eigen::MatrixXd x = input_.head(n) * input_.head(n).transpose();
  constexpr int kMaxDoublings = 60;  // 2^60 samples: no stable filter in double precision is slower
  constexpr double kNegligible = 1e-20;
  for (int i = 0; i < kMaxDoublings; ++i) {
    const Eigen::MatrixXd increment = a * x * a.transpose();
    x += increment;
    if (!(increment.norm() > kNegligible * x.norm())) {
      break;
    }
    a = (a * a).eval();
  }
  return transition_ * x * transition_.transpose() + input_ * input_.transpose();
}

TRAMMEL_INLINE Eigen::VectorXd DeltaRealisation::impulse_response(const Polynomial& numerator_d,
                                                                  int count) const {
  const Eigen::VectorXd row = output_row(numerator_d);
  Eigen::VectorXd state = input_;
  Eigen::VectorXd next(state.size());
  Eigen::VectorXd values(count);
  for (int i = 0; i < count; ++i) {
    values[i] = row.dot(state);
    next.noalias() = transition_ * state.head(states());
    state.swap(next);
  }
  return values;
}

TRAMMEL_INLINE int DeltaRealisation::memory() const {
  constexpr double kNegligible = 1e-18;
  constexpr int kMaxMemory = 1 << 22;  // a filter that remembers four million samples is not a filter
  Eigen::MatrixXd a = transition_.topRows(states());
  int count = 1;
  while (count < kMaxMemory && a.norm() > kNegligible) {
    a = (a * a).eval();
    count *= 2;
  }
  return count;
}

TRAMMEL_INLINE FilterAnalysis analyse(const FilterDesign& design) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const int order = design.specification.order;
  const int rows = design.specification.rows;
  const double step = design.specification.sampling_s;
  const int terms = order + 2;
  FilterAnalysis analysis;
  analysis.poles = poles(design.denominator);
  analysis.stable = is_stable(design.denominator_d);
  analysis.error_coefficients = Eigen::MatrixXd::Constant(rows, terms, kNan);
  analysis.prediction_error_coefficients = Eigen::VectorXd::Constant(terms, kNan);
  analysis.covariance = Eigen::MatrixXd::Constant(rows, rows, kNan);
  analysis.prediction_noise_gain = kNan;
  analysis.innovation_variance = kNan;

  const auto error = [&](const Polynomial& numerator, int row) {
    return detail::error_series(numerator, design.denominator_d, row, terms);
  };
  const Polynomial prediction = add(design.denominator_d, design.innovation_numerator_d, -1.0);
  const Polynomial prediction_error =
      divide_series(design.innovation_numerator_d, design.denominator_d, terms);
  analysis.prediction_astatism = detail::leading_power(prediction_error);
  std::vector<Polynomial> errors;
  for (int i = 0; i < rows; ++i) {
    errors.push_back(error(design.numerators_d[static_cast<std::size_t>(i)], i));
    analysis.astatism.push_back(detail::leading_power(errors.back()));
  }
  if (!analysis.stable) {
    return analysis;
  }

  const Eigen::VectorXd prediction_in_time = detail::substitute_difference(prediction_error, terms);
  for (int p = 0; p < terms; ++p) {
    analysis.prediction_error_coefficients[p] = prediction_in_time[p] * std::pow(step, p);
  }
  for (int i = 0; i < rows; ++i) {
    const Polynomial in_time = detail::substitute_difference(errors[static_cast<std::size_t>(i)], terms);
    for (int p = 0; p < terms; ++p) {
      analysis.error_coefficients(i, p) = in_time[p] * std::pow(step, p - i);
    }
  }

  const DeltaRealisation realisation(design.denominator_d);
  const Eigen::MatrixXd covariance = realisation.covariance();
  Eigen::MatrixXd outputs(realisation.states() + 1, rows);
  for (int i = 0; i < rows; ++i) {
    outputs.col(i) =
        realisation.output_row(design.numerators_d[static_cast<std::size_t>(i)]) / std::pow(step, i);
  }
  analysis.covariance = outputs.transpose() * covariance * outputs;
  const Eigen::VectorXd output = realisation.output_row(prediction);
  analysis.prediction_noise_gain = output.dot(covariance * output);
  analysis.innovation_variance = 1.0 + analysis.prediction_noise_gain;
  return analysis;
}

namespace detail {

/// Direct form of N/P in q, from zero state.
inline Eigen::VectorXd run_transfer(const Polynomial& numerator, const Polynomial& denominator,
                                    const Eigen::VectorXd& input) {
  Eigen::VectorXd output(input.size());
  for (Eigen::Index n = 0; n < input.size(); ++n) {
    double value = 0.0;
    for (Eigen::Index j = 0; j < std::min(numerator.size(), n + 1); ++j) {
      value += numerator[j] * input[n - j];
    }
    for (Eigen::Index j = 1; j < std::min(denominator.size(), n + 1); ++j) {
      value -= denominator[j] * output[n - j];
    }
    output[n] = value;
  }
  return output;
}

}  // namespace detail

TRAMMEL_INLINE Eigen::VectorXd response(const FilterDesign& design, int row, const Eigen::VectorXd& input) {
  require(row >= 0 && row < design.specification.rows, "row", std::to_string(row), "a row of the design");
  return detail::run_transfer(design.numerators[static_cast<std::size_t>(row)], design.denominator, input);
}

TRAMMEL_INLINE Eigen::VectorXd prediction_response(const FilterDesign& design, const Eigen::VectorXd& input) {
  return detail::run_transfer(design.prediction_numerator, design.denominator, input);
}

}  // namespace trammel::inline TRAMMEL_ABI::filter
