// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of rules.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/filter/design.hpp"
#include "trammel/filter/require_order.hpp"
#include "trammel/filter/rules.hpp"
#include "trammel/linalg/lu.hpp"
#include "trammel/linalg/qr.hpp"
#include "trammel/linalg/semidefinite_factor.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

namespace detail {

inline void require_index(double index, const char* name) {
  require(std::isfinite(index) && index > 0.0, name, std::to_string(index), "a positive number");
}

inline Eigen::VectorXd two_gains(double alpha, double beta) {
  Eigen::VectorXd gains(2);
  gains << alpha, beta;
  return gains;
}

/// Root of an increasing function between low and high, to the last digit.
template <class Function>
double bisect(const Function& function, double low, double high) {
  for (double middle = 0.5 * (low + high); low < middle && middle < high; middle = 0.5 * (low + high)) {
    (function(middle) < 0.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// Transition over one interval for state (x, T x', T^2 x'', ...).
inline Eigen::MatrixXd unit_transition(int order) {
  Eigen::MatrixXd transition = Eigen::MatrixXd::Zero(order, order);
  for (int i = 0; i < order; ++i) {
    for (int j = i; j < order; ++j) {
      transition(i, j) = 1.0 / factorial(j - i);
    }
  }
  return transition;
}

/// q in powers of d.
inline Polynomial shift_in_d() {
  Polynomial q(2);
  q << 1.0, -1.0;
  return q;
}

/// q^n p(1/q) for p of degree n, both in powers of d: 1/q turns d into d/(d - 1), so this is
/// sum_j (-1)^j p_j d^j q^(n-j).
inline Polynomial reversed_in_d(const Polynomial& p) {
  const int degree = static_cast<int>(p.size()) - 1;
  const Polynomial q = shift_in_d();
  Polynomial reversed = Polynomial::Zero(degree + 1);
  Polynomial power = constant(1.0);  // q^(n-j), from the last coefficient on
  for (int j = degree; j >= 0; --j) {
    const double sign = j % 2 == 0 ? 1.0 : -1.0;
    reversed.segment(j, power.size()) += sign * p[j] * power;
    power = multiply(power, q);
  }
  return reversed;
}

}  // namespace detail

TRAMMEL_INLINE Eigen::VectorXd pole_placement(const Eigen::VectorXcd& poles) {
  detail::require_order(static_cast<int>(poles.size()), static_cast<int>(poles.size()));
  Eigen::VectorXcd product = Eigen::VectorXcd::Ones(1);
  for (const std::complex<double> pole : poles) {
    // 1 - z q = (1 - z) + z d
    Eigen::VectorXcd next = Eigen::VectorXcd::Zero(product.size() + 1);
    next.head(product.size()) += (1.0 - pole) * product;
    next.tail(product.size()) += pole * product;
    product = next;
  }
  constexpr double kConjugate = 1e-12;  // imaginary rest of products of conjugate pairs
  require(product.imag().cwiseAbs().maxCoeff() <= kConjugate * product.cwiseAbs().sum(), "poles",
          "a complex pole without its conjugate", "real poles and conjugate pairs");
  return gains_from_denominator(product.real());
}

TRAMMEL_INLINE Eigen::VectorXd fading_memory(int order, double theta) {
  require(theta >= 0.0 && theta < 1.0, "theta", std::to_string(theta), "a number from 0 to below 1");
  detail::require_order(order, order);
  return pole_placement(Eigen::VectorXcd::Constant(order, theta));
}

TRAMMEL_INLINE Eigen::VectorXd expanding_memory(int order, int samples) {
  detail::require_order(order, order);
  require(samples >= 1, "samples", std::to_string(samples), "1 or more");
  const auto falling = [](double top, int count) {
    double product = 1.0;
    for (int i = 0; i < count; ++i) {
      product *= top - i;
    }
    return product;
  };
  // coefficients(i, k) = |s(k, i)|, Stirling numbers of the first kind: x (x+1) ... (x+k-1).
  Eigen::MatrixXd stirling = Eigen::MatrixXd::Zero(order, order);
  stirling(0, 0) = 1.0;
  for (int k = 1; k < order; ++k) {
    stirling.col(k) = (k - 1) * stirling.col(k - 1);
    stirling.col(k).tail(order - 1) += stirling.col(k - 1).head(order - 1);
  }
  const double n = samples;
  Eigen::VectorXd gains = Eigen::VectorXd::Zero(order);
  for (int m = 0; m < order; ++m) {
    const double norm = (2 * m + 1) / falling(n + m, m + 1);
    for (int k = 0; k <= m; ++k) {
      const double binomials = falling(m + k, 2 * k) / (factorial(k) * factorial(k));
      gains += norm * binomials * falling(n - 1 - k, m - k) * stirling.col(k);
    }
  }
  for (int i = 0; i < order; ++i) {
    gains[i] *= factorial(i) * factorial(i);
  }
  return gains;
}

TRAMMEL_INLINE Eigen::VectorXd finite_fading_memory(int order, int samples, double theta) {
  detail::require_order(order, order);
  require(samples >= 1, "samples", std::to_string(samples), "1 or more");
  require(theta > 0.0 && theta <= 1.0, "theta", std::to_string(theta), "a number above 0 and at most 1");
  const int used = std::min(order, samples);
  // Samples whose weight is below 1e-40 of the newest change nothing.
  constexpr double kLogNegligible = 92.0;
  const double decay = -std::log(theta);
  const int count =
      decay * samples > kLogNegligible ? static_cast<int>(std::ceil(kLogNegligible / decay)) : samples;
  const int rows = std::max(count, used);
  const double scale = static_cast<double>(std::max(rows - 1, 1));
  Eigen::MatrixXd design(rows, used);
  for (int m = 0; m < rows; ++m) {
    double value = std::exp(-0.5 * decay * m);
    for (int i = 0; i < used; ++i) {
      design(m, i) = value;
      value *= -m / scale / (i + 1);
    }
  }
  // (D'D)^-1 e_0 = R^-1 R^-T e_0, D = Q R.
  const linalg::Qr qr(design);
  const Eigen::MatrixXd r = qr.matrixQR().topRows(used).triangularView<Eigen::Upper>();
  Eigen::VectorXd gain = r.transpose().triangularView<Eigen::Lower>().solve(Eigen::VectorXd::Unit(used, 0));
  gain = r.triangularView<Eigen::Upper>().solve(gain).eval();
  Eigen::VectorXd gains = Eigen::VectorXd::Zero(order);
  for (int i = 0; i < used; ++i) {
    gains[i] = gain[i] * factorial(i) / std::pow(scale, i);
  }
  return gains;
}

TRAMMEL_INLINE Eigen::VectorXd kalata(int order, double tracking_index) {
  require(order >= 1 && order <= 3, "order", std::to_string(order), "1, 2 or 3 for this rule");
  detail::require_index(tracking_index, "tracking_index");
  const double index = tracking_index;
  Eigen::VectorXd gains(order);
  if (order == 1) {
    // alpha = (sqrt(L^4 + 16 L^2) - L^2)/8 without the difference
    gains << 2.0 * index / (std::sqrt(index * index + 16.0) + index);
    return gains;
  }
  double s = 0.0;
  if (order == 2) {
    // (4 + L - sqrt(8 L + L^2))/4 without the difference
    s = 4.0 / (4.0 + index + std::sqrt(8.0 * index + index * index));
  } else {
    s = detail::bisect([&](double x) { return ((x + 0.5 * index - 3.0) * x + 0.5 * index + 3.0) * x - 1.0; },
                       0.0, 1.0);
  }
  // 1 - s from the defining equation keeps its digits for small indices: L = 2 (1-s)^2/s, 2 (1-s)^3/(s(1+s)).
  const double rest = order == 2 ? std::sqrt(0.5 * index * s) : std::cbrt(0.5 * index * s * (1.0 + s));
  gains[0] = rest * (1.0 + s);
  gains[1] = 2.0 * rest * rest;
  if (order == 3) {
    gains[2] = 4.0 * rest * rest * rest / (1.0 + s);
  }
  return gains;
}

TRAMMEL_INLINE Eigen::MatrixXd process_noise_covariance(int order, ProcessNoise noise) {
  detail::require_order(order, order);
  Eigen::MatrixXd covariance(order, order);
  for (int i = 0; i < order; ++i) {
    for (int j = 0; j < order; ++j) {
      const int left = order - i;
      const int right = order - j;
      switch (noise) {
        case ProcessNoise::kDiscrete:
          covariance(i, j) = 1.0 / (factorial(left) * factorial(right));
          break;
        case ProcessNoise::kIncrements:
          covariance(i, j) = 1.0 / (factorial(left - 1) * factorial(right - 1));
          break;
        case ProcessNoise::kContinuous:
          covariance(i, j) = 1.0 / (factorial(left - 1) * factorial(right - 1) * (left + right - 1));
          break;
      }
    }
  }
  return covariance;
}

TRAMMEL_INLINE Eigen::VectorXd kalman(int order, ProcessNoise noise, double tracking_index) {
  detail::require_index(tracking_index, "tracking_index");
  return kalman(Eigen::MatrixXd(tracking_index * tracking_index * process_noise_covariance(order, noise)));
}

TRAMMEL_INLINE Eigen::VectorXd kalman(const Eigen::MatrixXd& process_noise) {
  const int order = static_cast<int>(process_noise.rows());
  detail::require_order(order, order);
  require(process_noise.cols() == order, "process_noise", "not square", "an order x order matrix");
  require(process_noise.allFinite() && process_noise.isApprox(process_noise.transpose()), "process_noise",
          "not finite or not symmetric", "a symmetric matrix");
  require(process_noise.diagonal().minCoeff() >= 0.0 && process_noise(order - 1, order - 1) > 0.0,
          "process_noise", "no noise in the last derivative", "a positive last diagonal element");
  require(linalg::semidefinite_factor(process_noise).negative_pivot == 0.0, "process_noise",
          "a negative eigenvalue", "a positive semidefinite matrix");

  // State scaled by powers of the expected bandwidth, so that a long memory does not spoil the digits.
  const double index = std::sqrt(process_noise(order - 1, order - 1));
  const double bandwidth = std::min(1.0, std::pow(index, 1.0 / order));
  Eigen::VectorXd scale(order);
  for (int i = 0; i < order; ++i) {
    scale[i] = std::pow(bandwidth, i);
  }
  const Eigen::MatrixXd transition =
      scale.cwiseInverse().asDiagonal() * detail::unit_transition(order) * scale.asDiagonal();
  Eigen::MatrixXd a = transition.transpose();
  Eigen::MatrixXd g = Eigen::MatrixXd::Zero(order, order);
  g(0, 0) = 1.0;
  Eigen::MatrixXd h = scale.cwiseInverse().asDiagonal() * process_noise * scale.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(order, order);
  constexpr int kMaxDoublings = 60;
  constexpr double kConverged = 1e-16;
  bool converged = false;
  for (int i = 0; i < kMaxDoublings && !converged; ++i) {
    const linalg::Lu lu(identity + g * h);
    const Eigen::MatrixXd w = lu.solve(a);
    const Eigen::MatrixXd increment = a.transpose() * h * w;
    g += (a * lu.solve(g) * a.transpose()).eval();
    g = (0.5 * (g + g.transpose())).eval();
    h += 0.5 * (increment + increment.transpose());
    a = (a * w).eval();
    converged = !(increment.norm() > kConverged * h.norm());
  }
  require(converged && h.allFinite(), "process_noise", "a Riccati equation that did not converge",
          "noise that reaches every row, within 1e-100 and 1e100 of the measurement's");
  Eigen::VectorXd gains = h.col(0) / (1.0 + h(0, 0));
  for (int i = 0; i < order; ++i) {
    gains[i] *= factorial(i) * scale[i];
  }
  return gains;
}

TRAMMEL_INLINE Eigen::VectorXd benedict_bordner(double alpha) {
  require(alpha > 0.0 && alpha <= 1.0, "alpha", std::to_string(alpha), "a number above 0 and at most 1");
  return detail::two_gains(alpha, alpha * alpha / (2.0 - alpha));
}

TRAMMEL_INLINE Eigen::VectorXd benedict_bordner_from_index(double index) {
  detail::require_index(index, "tracking_index");
  // In r = sqrt(1 - alpha): Lambda = (1 - r^2)^2 / ((1 + r^2) r), decreasing; in the logarithm of r for
  // large Lambda, in 1 - r for small.
  const double r = detail::bisect(
      [&](double x) {
        const double alpha = (1.0 - x) * (1.0 + x);
        return index - alpha * alpha / ((1.0 + x * x) * x);
      },
      0.0, 1.0);
  if (r > 0.5) {
    const double rest = detail::bisect(
        [&](double x) {
          const double y = 1.0 - x;
          const double alpha = x * (2.0 - x);
          return alpha * alpha / ((1.0 + y * y) * y) - index;
        },
        0.0, 0.6);
    return benedict_bordner(rest * (2.0 - rest));
  }
  return benedict_bordner((1.0 - r) * (1.0 + r));
}

TRAMMEL_INLINE Eigen::VectorXd minimum_noise_prediction(int order, double b) {
  detail::require_order(order, order);
  require(b > 0.0 && b < 2.0, "b", std::to_string(b), "a number between 0 and 2");
  const Polynomial q = detail::shift_in_d();
  Polynomial p = constant(1.0);
  for (int v = 0; v < order; ++v) {
    p = add(raise(p, 1), multiply(q, add(p, detail::reversed_in_d(p))), 0.5 * b);
  }
  return gains_from_denominator(p);
}

TRAMMEL_INLINE Eigen::VectorXd minimum_noise_estimate(int order, double lag) {
  detail::require_order(order, order);
  require(std::isfinite(lag) && (lag > 0.0 || (lag == 0.0 && order == 1)), "lag", std::to_string(lag),
          "a positive number, or 0 for order 1");
  const double t = 1.0 / (1.0 + 2.0 * std::pow(lag, 1.0 / order));
  const Polynomial q = detail::shift_in_d();
  Polynomial p = constant(1.0);
  for (int v = 0; v < order; ++v) {
    p = add(raise(p, 1), add(multiply(q, p), detail::reversed_in_d(p)), t);
  }
  return gains_from_denominator(Polynomial(p / p.sum()));  // q = 0 is d = 1
}

}  // namespace trammel::inline TRAMMEL_ABI::filter
