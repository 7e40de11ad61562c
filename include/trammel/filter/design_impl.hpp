// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of design.hpp.
#pragma once

#include <cmath>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/filter/design.hpp"
#include "trammel/filter/polynomial_impl.hpp"
#include "trammel/filter/require_order.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

namespace detail {

inline void require_polynomials(const std::vector<Polynomial>& list, int rows, const char* name) {
  require(static_cast<int>(list.size()) == rows, name, std::to_string(list.size()) + " polynomials",
          std::to_string(rows) + ", one per row");
  for (const Polynomial& p : list) {
    require(p.size() > 0, name, "a polynomial without coefficients", "at least one coefficient");
    require(p.allFinite(), name, "a coefficient that is not finite", "finite coefficients");
  }
}

inline void require_valid(const FilterSpecification& s) {
  require_order(s.order, s.rows);
  require(std::isfinite(s.sampling_s) && s.sampling_s > 0.0, "sampling_s", shortest(s.sampling_s),
          "a positive number of seconds");
  if (s.gains.size() > 0) {
    require(s.a.empty() && s.b.empty(), "gains", "gains beside a or b", "one of them");
    require(s.gains.size() == s.rows, "gains", std::to_string(s.gains.size()) + " gains",
            std::to_string(s.rows) + ", one per row");
    require(s.gains.allFinite(), "gains", "a gain that is not finite", "finite gains");
    return;
  }
  require_polynomials(s.a, s.rows, "a");
  require_polynomials(s.b, s.rows, "b");
  for (const Polynomial& a : s.a) {
    require(a[0] == 1.0, "a", "a(0) = " + std::to_string(a[0]),
            "a(0) = 1: otherwise the prediction would need the present estimate");
  }
}

/// F0 in powers of d for T = 1.
inline std::vector<std::vector<Polynomial>> predictor_d(int order, int rows) {
  Polynomial q(2);
  q << 1.0, -1.0;
  const int extra = order - rows;
  std::vector<std::vector<Polynomial>> f(static_cast<std::size_t>(rows),
                                         std::vector<Polynomial>(static_cast<std::size_t>(rows)));
  for (int i = 0; i < rows; ++i) {
    auto& row = f[static_cast<std::size_t>(i)];
    for (int j = 0; j + 1 < rows; ++j) {
      row[static_cast<std::size_t>(j)] = j >= i ? Polynomial(q / factorial(j - i)) : constant(0.0);
    }
    Polynomial series = Polynomial::Zero(extra + 1);
    for (int l = 0; l <= extra; ++l) {
      series += derivative_series(l, extra + 1) / factorial(rows - 1 - i + l);
    }
    row.back() = multiply(q, series);
  }
  return f;
}

/// Smoothing polynomials in d: a, b and a - b, which is the exact gain where that is constant.
struct Smoothing {
  std::vector<Polynomial> a;
  std::vector<Polynomial> b;
  std::vector<Polynomial> difference;
};

inline Smoothing smoothing_d(const FilterSpecification& s) {
  Smoothing smoothing;
  for (int i = 0; i < s.rows; ++i) {
    if (s.gains.size() > 0) {
      smoothing.a.push_back(constant(1.0));
      smoothing.b.push_back(constant(1.0 - s.gains[i]));
      smoothing.difference.push_back(constant(s.gains[i]));
    } else {
      const auto at = static_cast<std::size_t>(i);
      smoothing.a.push_back(reflect(s.a[at]));
      smoothing.b.push_back(reflect(s.b[at]));
      smoothing.difference.push_back(reflect(add(s.a[at], s.b[at], -1.0)));
    }
  }
  return smoothing;
}

/// Product of a_j^2 over all rows but those from `skip_begin` to before `skip_end`.
inline Polynomial squares_except(const std::vector<Polynomial>& a, int skip_begin, int skip_end) {
  Polynomial product = constant(1.0);
  for (int j = 0; j < static_cast<int>(a.size()); ++j) {
    if (j < skip_begin || j >= skip_end) {
      const Polynomial& factor = a[static_cast<std::size_t>(j)];
      product = multiply(multiply(product, factor), factor);
    }
  }
  return product;
}

/// Numerators and denominator in d, T = 1, of the filter with artificial feedback: back substitution of
/// (I - F0) x = N u from the last row, x_i = Y_i / (d^(v-i) Q) u, Q the product of all a_j^2.
inline void synthesise_derivatives(FilterDesign& design, const Smoothing& smoothing) {
  const std::vector<Polynomial>& a = smoothing.a;
  const int order = design.specification.order;
  const int rows = design.specification.rows;
  const auto f = predictor_d(order, rows);
  std::vector<Polynomial> y(static_cast<std::size_t>(rows));
  for (int i = rows - 1; i >= 0; --i) {
    const auto at = static_cast<std::size_t>(i);
    const Polynomial own = multiply(smoothing.difference[at], squares_except(a, i, i + 1)) / factorial(i);
    if (i == rows - 1) {
      y[at] = own;
      continue;
    }
    y[at] = raise(own, order - i - 1);
    for (int j = i + 1; j < rows; ++j) {
      const auto other = static_cast<std::size_t>(j);
      y[at] = add(y[at], raise(multiply(f[at][other], y[other]), j - i - 1));
    }
  }
  const Polynomial all = squares_except(a, 0, 0);
  const Polynomial own_b = multiply(multiply(smoothing.b[0], a[0]), squares_except(a, 0, 1));
  design.denominator_d = add(y[0], raise(own_b, order));
  design.innovation_numerator_d = raise(all, order);
  for (int i = 0; i < rows; ++i) {
    design.numerators_d.push_back(raise(y[static_cast<std::size_t>(i)], i));
  }
}

/// The same for the published diagonal form: u = d^v a_0^2 / P_0 g, P_0 = a_0 - b_0 + d^v a_0 b_0, and row i
/// is d^i (a_i - b_i) a_0^2 / (i! a_i^2 P_0) g, over the common denominator.
inline void synthesise_differences(FilterDesign& design, const Smoothing& smoothing) {
  const std::vector<Polynomial>& a = smoothing.a;
  const int order = design.specification.order;
  const Polynomial others = squares_except(a, 0, 1);
  const Polynomial& difference = smoothing.difference[0];
  design.denominator_d = multiply(add(difference, raise(multiply(a[0], smoothing.b[0]), order)), others);
  design.innovation_numerator_d = raise(squares_except(a, 0, 0), order);
  design.numerators_d.push_back(multiply(difference, others));
  for (int i = 1; i < design.specification.rows; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Polynomial factor = multiply(smoothing.difference[at], squares_except(a, i, i + 1));
    design.numerators_d.push_back(raise(factor, i) / factorial(i));
  }
}

}  // namespace detail

TRAMMEL_INLINE double factorial(int n) {
  double value = 1.0;
  for (int i = 2; i <= n; ++i) {
    value *= i;
  }
  return value;
}

TRAMMEL_INLINE FilterSpecification from_gains(int order, double sampling_s, const Eigen::VectorXd& gains,
                                              FilterMode mode) {
  FilterSpecification specification;
  specification.order = order;
  specification.rows = static_cast<int>(gains.size());
  specification.sampling_s = sampling_s;
  specification.mode = mode;
  specification.gains = gains;
  return specification;
}

TRAMMEL_INLINE Eigen::VectorXd constant_gains(const FilterSpecification& specification) {
  if (specification.gains.size() > 0) {
    return specification.gains;
  }
  Eigen::VectorXd gains(specification.rows);
  for (int i = 0; i < specification.rows; ++i) {
    const Polynomial& a = specification.a[static_cast<std::size_t>(i)];
    const Polynomial& b = specification.b[static_cast<std::size_t>(i)];
    if (!a.tail(a.size() - 1).isZero(0.0) || !b.tail(b.size() - 1).isZero(0.0)) {
      return {};
    }
    gains[i] = a[0] - b[0];
  }
  return gains;
}

TRAMMEL_INLINE FilterDesign synthesise(const FilterSpecification& specification) {
  detail::require_valid(specification);
  FilterDesign design;
  design.specification = specification;
  const detail::Smoothing smoothing = detail::smoothing_d(specification);
  if (specification.mode == FilterMode::kDerivatives) {
    detail::synthesise_derivatives(design, smoothing);
  } else {
    detail::synthesise_differences(design, smoothing);
  }
  design.denominator = trim(reflect(design.denominator_d));
  design.innovation_numerator = trim(reflect(design.innovation_numerator_d));
  design.prediction_numerator = trim(reflect(add(design.denominator_d, design.innovation_numerator_d, -1.0)));
  design.prediction_numerator[0] = 0.0;  // exactly: P(0) = 1 and every a_i(0) = 1
  for (int i = 0; i < specification.rows; ++i) {
    const Polynomial& numerator = design.numerators_d[static_cast<std::size_t>(i)];
    design.numerators.push_back(trim(reflect(numerator)) / std::pow(specification.sampling_s, i));
  }
  return design;
}

TRAMMEL_INLINE std::vector<std::vector<Polynomial>> predictor(int order, int rows, double sampling_s) {
  detail::require_order(order, rows);
  auto f = detail::predictor_d(order, rows);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < rows; ++j) {
      Polynomial& entry = f[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
      entry = trim(reflect(entry)) * std::pow(sampling_s, j - i);
      entry[0] = 0.0;  // strictly causal: every entry has the factor q
    }
  }
  return f;
}

TRAMMEL_INLINE Eigen::VectorXd gains_from_denominator(const Polynomial& denominator_d) {
  const int order = static_cast<int>(denominator_d.size()) - 1;
  detail::require_order(order, order);
  // P(kappa) = P(0) + sum kappa_i dP/dkappa_i; the derivative for row i starts at d^(v-1-i), so the lowest
  // power gives the last gain, and so on upwards.
  const Polynomial base = synthesise(from_gains(order, 1.0, Eigen::VectorXd::Zero(order))).denominator_d;
  Eigen::VectorXd gains(order);
  Polynomial rest = add(denominator_d, base, -1.0);
  for (int i = order - 1; i >= 0; --i) {
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(order, i);
    const Polynomial direction = add(synthesise(from_gains(order, 1.0, unit)).denominator_d, base, -1.0);
    const Eigen::Index power = order - 1 - i;
    gains[i] = rest[power] / direction[power];
    rest = add(rest, direction, -gains[i]);
  }
  return gains;
}

}  // namespace trammel::inline TRAMMEL_ABI::filter
