// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of polynomial.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "trammel/core/error.hpp"
#include "trammel/filter/polynomial.hpp"
#include "trammel/linalg/eigenvalues.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

namespace detail {

/// Coefficients below this part of the sum of all are taken for rounding errors of sums of a dozen terms.
inline constexpr double kCoefficientNoise = 16 * std::numeric_limits<double>::epsilon();

/// Routh's array: true if all roots of p (ascending powers of w) have negative real parts.
inline bool is_hurwitz(const Eigen::VectorXd& p) {
  const Eigen::Index degree = p.size() - 1;
  // Scaling w makes the first and last coefficient equal, so one tolerance fits the whole array.
  const double scale =
      degree > 0 ? std::pow(std::abs(p[0] / p[degree]), 1.0 / static_cast<double>(degree)) : 1.0;
  Eigen::VectorXd scaled(p.size());
  double power = 1.0;
  for (Eigen::Index i = 0; i <= degree; ++i, power *= scale) {
    scaled[i] = p[i] * power;
  }
  scaled /= scaled.cwiseAbs().sum();
  const double sign = scaled[degree] > 0.0 ? 1.0 : -1.0;
  Eigen::VectorXd upper = Eigen::VectorXd::Zero(degree / 2 + 2);
  Eigen::VectorXd lower = Eigen::VectorXd::Zero(degree / 2 + 2);
  for (Eigen::Index i = 0; i <= degree; ++i) {
    const double value = sign * scaled[degree - i];
    (i % 2 == 0 ? upper : lower)[i / 2] = value;
    if (!(value > kCoefficientNoise)) {
      return false;
    }
  }
  for (Eigen::Index row = 2; row <= degree; ++row) {
    Eigen::VectorXd next = Eigen::VectorXd::Zero(upper.size());
    const double ratio = upper[0] / lower[0];
    const double noise = kCoefficientNoise * std::max(std::abs(upper[1]), std::abs(ratio * lower[1]));
    for (Eigen::Index i = 0; i + 1 < upper.size(); ++i) {
      next[i] = upper[i + 1] - ratio * lower[i + 1];
    }
    if (!(next[0] > noise)) {
      return false;
    }
    upper.swap(lower);
    lower = next;
  }
  return true;
}

/// Points in (0, 1) where p changes its sign, ascending: bisection between the turning points.
inline std::vector<double> sign_changes(const Polynomial& p) {
  std::vector<double> points;
  Eigen::Index degree = p.size() - 1;
  while (degree > 0 && p[degree] == 0.0) {
    --degree;
  }
  if (degree == 0) {
    return points;
  }
  Polynomial slope(degree);
  for (Eigen::Index i = 0; i < degree; ++i) {
    slope[i] = static_cast<double>(i + 1) * p[i + 1];
  }
  std::vector<double> ends = sign_changes(slope);
  ends.push_back(1.0);
  double left = 0.0;
  for (const double right : ends) {
    double low = left;
    double high = right;
    const double at_low = evaluate(p, low);
    if (at_low * evaluate(p, high) < 0.0) {
      if (degree == 1) {
        low = high = -p[0] / p[1];
      }
      for (double middle = 0.5 * (low + high); low < middle && middle < high; middle = 0.5 * (low + high)) {
        (evaluate(p, middle) * at_low > 0.0 ? low : high) = middle;
      }
      points.push_back(low);
    }
    left = right;
  }
  return points;
}

/// True if the Bernstein coefficients of p on [0, 1] show that it does not change its sign there. (That
/// they do not show it proves nothing.)
inline bool keeps_sign(const Eigen::Ref<const Eigen::VectorXd>& p) {
  const Eigen::Index degree = p.size() - 1;
  bool positive = false;
  bool negative = false;
  for (Eigen::Index i = 0; i <= degree; ++i) {
    double coefficient = 0.0;
    double ratio = 1.0;  // C(i, j) / C(degree, j)
    for (Eigen::Index j = 0; j <= i; ++j) {
      coefficient += ratio * p[j];
      ratio *= static_cast<double>(i - j) / static_cast<double>(std::max<Eigen::Index>(degree - j, 1));
    }
    positive = positive || coefficient > 0.0;
    negative = negative || coefficient < 0.0;
  }
  return !(positive && negative);
}

}  // namespace detail

TRAMMEL_INLINE Polynomial constant(double value) { return Polynomial::Constant(1, value); }

TRAMMEL_INLINE Polynomial add(const Polynomial& p, const Polynomial& r, double factor) {
  Polynomial sum = Polynomial::Zero(std::max(p.size(), r.size()));
  sum.head(p.size()) = p;
  sum.head(r.size()) += factor * r;
  return sum;
}

TRAMMEL_INLINE Polynomial multiply(const Polynomial& p, const Polynomial& r) {
  Polynomial product = Polynomial::Zero(p.size() + r.size() - 1);
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    product.segment(i, r.size()) += p[i] * r;
  }
  return product;
}

TRAMMEL_INLINE Polynomial raise(const Polynomial& p, int shift) {
  Polynomial raised = Polynomial::Zero(p.size() + shift);
  raised.tail(p.size()) = p;
  return raised;
}

TRAMMEL_INLINE Polynomial reflect(const Polynomial& p) {
  // Horner's rule in (1 - x), with long sums because the terms cancel.
  std::vector<long double> value(static_cast<std::size_t>(p.size()), 0.0L);
  for (Eigen::Index i = p.size() - 1; i >= 0; --i) {
    for (std::size_t k = value.size(); k-- > 0;) {
      value[k] -= k > 0 ? value[k - 1] : 0.0L;
    }
    // value now holds value - x value of the step before, with the old value in place.
    value[0] += static_cast<long double>(p[i]);
  }
  Polynomial out(p.size());
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    out[i] = static_cast<double>(value[static_cast<std::size_t>(i)]);
  }
  return out;
}

TRAMMEL_INLINE Polynomial trim(const Polynomial& p) {
  const double noise = detail::kCoefficientNoise * p.cwiseAbs().sum();
  Eigen::Index size = p.size();
  while (size > 1 && std::abs(p[size - 1]) <= noise) {
    --size;
  }
  return p.head(size);
}

TRAMMEL_INLINE Polynomial divide_series(const Polynomial& p, const Polynomial& r, int terms) {
  Polynomial quotient = Polynomial::Zero(terms);
  for (Eigen::Index n = 0; n < terms; ++n) {
    double value = n < p.size() ? p[n] : 0.0;
    for (Eigen::Index j = 1; j <= std::min(n, r.size() - 1); ++j) {
      value -= r[j] * quotient[n - j];
    }
    quotient[n] = value / r[0];
  }
  return quotient;
}

TRAMMEL_INLINE Polynomial derivative_series(int power, int terms) {
  Polynomial logarithm = Polynomial::Zero(terms);
  for (Eigen::Index i = 1; i < terms; ++i) {
    logarithm[i] = 1.0 / static_cast<double>(i);
  }
  Polynomial series = Polynomial::Zero(terms);
  series[0] = 1.0;
  for (int i = 0; i < power; ++i) {
    series = multiply(series, logarithm).head(terms).eval();
  }
  return series;
}

TRAMMEL_INLINE double evaluate(const Polynomial& p, double x) {
  double value = 0.0;
  for (Eigen::Index i = p.size() - 1; i >= 0; --i) {
    value = value * x + p[i];
  }
  return value;
}

TRAMMEL_INLINE Eigen::VectorXcd poles(const Polynomial& denominator_q) {
  const Eigen::Index degree = denominator_q.size() - 1;
  require(denominator_q[0] != 0.0, "denominator[0]", "0", "a causal filter: nonzero");
  if (degree == 0) {
    return {};
  }
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(degree, degree);
  companion.row(0) = -denominator_q.tail(degree).transpose() / denominator_q[0];
  companion.diagonal(-1).setOnes();
  const linalg::GeneralEigen eigen(companion, false);
  Eigen::VectorXcd values = eigen.eigenvalues();
  std::sort(values.begin(), values.end(), [](const auto& left, const auto& right) {
    return left.real() != right.real() ? left.real() < right.real() : left.imag() < right.imag();
  });
  return values;
}

TRAMMEL_INLINE std::vector<double> reflection_coefficients(const Polynomial& denominator_q) {
  Eigen::VectorXd p = denominator_q / denominator_q[0];
  std::vector<double> reflections;
  for (Eigen::Index n = p.size() - 1; n > 0; --n) {
    const double k = p[n];
    reflections.push_back(k);
    if (!(std::abs(k) < 1.0)) {
      break;
    }
    const Eigen::VectorXd reversed = p.reverse();
    p = ((p - k * reversed) / ((1.0 - k) * (1.0 + k))).head(n).eval();
  }
  return reflections;
}

TRAMMEL_INLINE bool is_stable(const Polynomial& denominator_d) {
  // p(d) (1 + w)^n with d = 2 w / (1 + w).
  const Polynomial p = denominator_d;
  const Eigen::Index degree = p.size() - 1;
  Polynomial mapped = Polynomial::Zero(degree + 1);
  Polynomial one_plus_w(2);
  one_plus_w << 1.0, 1.0;
  std::vector<Polynomial> powers{constant(1.0)};
  for (Eigen::Index i = 0; i < degree; ++i) {
    powers.push_back(multiply(powers.back(), one_plus_w));
  }
  double two_power = 1.0;
  for (Eigen::Index i = 0; i <= degree; ++i, two_power *= 2.0) {
    mapped.segment(i, degree - i + 1) += two_power * p[i] * powers[static_cast<std::size_t>(degree - i)];
  }
  const double noise = detail::kCoefficientNoise * p.cwiseAbs().sum();
  if (degree == 0) {
    return true;
  }
  if (p[0] == 0.0 || std::abs(mapped[degree]) <= noise) {
    return false;  // a pole at z = 1 or at z = -1
  }
  return detail::is_hurwitz(mapped);
}

TRAMMEL_INLINE double integrate_absolute(const Eigen::Ref<const Eigen::VectorXd>& p) {
  if (detail::keeps_sign(p)) {  // nearly all intervals of a kernel: no memory is taken
    double integral = 0.0;
    for (Eigen::Index i = 0; i < p.size(); ++i) {
      integral += p[i] / static_cast<double>(i + 1);
    }
    return std::abs(integral);
  }
  Polynomial antiderivative = Polynomial::Zero(p.size() + 1);
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    antiderivative[i + 1] = p[i] / static_cast<double>(i + 1);
  }
  std::vector<double> ends = detail::sign_changes(p);
  ends.push_back(1.0);
  double sum = 0.0;
  double previous = 0.0;
  for (const double end : ends) {
    const double value = evaluate(antiderivative, end);
    sum += std::abs(value - previous);
    previous = value;
  }
  return sum;
}

}  // namespace trammel::inline TRAMMEL_ABI::filter
