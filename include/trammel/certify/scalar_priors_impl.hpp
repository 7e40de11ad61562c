// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of scalar_priors.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "trammel/certify/scalar_priors.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace prior_detail {

inline constexpr double kPi = std::numbers::pi;
/// Bisection halves an interval this often: to double precision.
inline constexpr int kBisections = 200;
/// sqrt(a) width below which D width^2 = 1 + pi x/2 + ... is replaced by 1 + 2 x, above which by pi^2.
inline constexpr double kFaint = 1e-6;
inline constexpr double kBright = 1e7;

/// sqrt(a) width as a function of q = m - 1; decreasing.
inline double interval_width(double q) {
  const double m_squared_less_one = q * (q + 2.0);
  return 2.0 * (1.0 + q) / std::sqrt(m_squared_less_one) * std::atan(std::sqrt((q + 2.0) / q)) - kPi / 2.0;
}

inline constexpr int kRadialSteps = 600;
inline constexpr double kRoundUp = 3e-4;
/// Logarithmic grid of informations.
inline constexpr double kSmallestInformation = 0.01;
inline constexpr double kLargestInformation = 1000.0;
inline constexpr int kInformations = 20;

/// s(r) on a uniform grid by Runge-Kutta of order four; stops (and tells by a value above 1) once s leaves
/// [0, 1].
inline double shoot(double mu, double root_a, double d, std::vector<double>* path) {
  const double root_d = std::sqrt(d);
  const auto slope = [&](double r, double s) {
    const double cosine = std::sqrt(std::max(0.0, 1.0 - s * s));
    const double drive = root_d * (mu - root_a * cosine);
    return r > 0.0 ? drive - (d - 1.0) * s / r : drive / d;  // s ~ drive r/d at the centre
  };
  const double step = 1.0 / kRadialSteps;
  double s = 0.0;
  for (int i = 0; i < kRadialSteps; ++i) {
    const double r = i * step;
    if (path != nullptr) {
      path->push_back(s);
    }
    const double k1 = slope(r, s);
    const double k2 = slope(r + step / 2.0, s + step / 2.0 * k1);
    const double k3 = slope(r + step / 2.0, s + step / 2.0 * k2);
    const double k4 = slope(r + step, s + step * k3);
    s += step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    if (s > 1.0 && path == nullptr) {
      return 2.0;
    }
  }
  if (path != nullptr) {
    path->push_back(s);
  }
  return s;
}

/// int h cos r^(d-1) dr / int h r^(d-1) dr. h falls like exp(-sqrt(1 - r)) at the end; the trapezium rule in
/// u, r = 1 - u^2, takes the root out.
inline double mean_cosine(const std::vector<double>& path, double root_a, double d) {
  const double root_d = std::sqrt(d);
  const int points = kRadialSteps;
  const auto s_at = [&](double r) {
    const double position = std::clamp(r, 0.0, 1.0) * kRadialSteps;
    const auto left = std::min<std::size_t>(static_cast<std::size_t>(position), kRadialSteps - 1);
    const double share = position - static_cast<double>(left);
    return std::min(1.0, path[left] * (1.0 - share) + path[left + 1] * share);
  };
  // From the centre (u = 1) outwards (u = 0): log h accumulates -sqrt(d a) s/cos dr, dr = 2 u du.
  double log_h = 0.0;
  double weighted = 0.0;
  double total = 0.0;
  double last_rate = 0.0;
  const double du = 1.0 / points;
  for (int i = 0; i <= points; ++i) {
    const double u = 1.0 - i * du;
    const double r = 1.0 - u * u;
    const double s = s_at(r);
    const double cosine = std::sqrt(std::max(0.0, 1.0 - s * s));
    // At the end s/cos * 2u tends to 2/sqrt(2 s'(1)); repeat the last value there.
    const double rate = cosine > 1e-9 && i < points ? root_d * root_a * s / cosine * 2.0 * u : last_rate;
    log_h -= i > 0 ? du * (rate + last_rate) / 2.0 : 0.0;
    last_rate = rate;
    const double edge = i == 0 || i == points ? 0.5 : 1.0;
    const double volume = edge * std::exp(log_h) * std::pow(r, d - 1.0) * 2.0 * u * du;
    weighted += volume * cosine;
    total += volume;
  }
  return weighted / total;
}

inline BallPrior ball_prior(double a, double d) {
  const double root_a = std::sqrt(a);
  double low = 0.0;
  double high = 2.0 * (root_a + d + kPi);
  for (int step = 0; step < 45; ++step) {
    const double middle = (low + high) / 2.0;
    (shoot(middle, root_a, d, nullptr) >= 1.0 ? high : low) = middle;
  }
  std::vector<double> path;
  (void)shoot(low, root_a, d, &path);
  BallPrior prior;
  prior.tau = std::max(1.0, high / root_a * mean_cosine(path, root_a, d));
  prior.k = high * high * (1.0 + kRoundUp) - a * prior.tau;
  return prior;
}

/// First positive zero of the Bessel function of order d/2 - 1.
inline double bessel_zero(double d) {
  constexpr double kScan = 0.05;
  if (d < 2.0) {
    return kPi / 2.0;  // J_{-1/2} is a cosine
  }
  const double order = d / 2.0 - 1.0;
  double low = std::max(order, kScan);
  while (std::cyl_bessel_j(order, low + kScan) > 0.0) {
    low += kScan;
  }
  double high = low + kScan;
  for (int step = 0; step < 60; ++step) {
    const double middle = (low + high) / 2.0;
    (std::cyl_bessel_j(order, middle) > 0.0 ? low : high) = middle;
  }
  return high;
}

}  // namespace prior_detail

TRAMMEL_INLINE double interval_information(double information, double width) {
  using namespace prior_detail;
  const double inverse_square = 1.0 / (width * width);
  const double x = std::sqrt(std::max(information, 0.0)) * width;
  if (x < kFaint) {
    return inverse_square * (1.0 + 2.0 * x);
  }
  if (x > kBright) {
    return kPi * kPi * inverse_square;
  }
  double low = -40.0;  // log q; interval_width(low) is beyond every x, interval_width(high) below
  double high = 20.0;
  for (int step = 0; step < kBisections && high - low > 1e-15 * std::abs(low); ++step) {
    const double middle = (low + high) / 2.0;
    (interval_width(std::exp(middle)) > x ? low : high) = middle;
  }
  const double q = std::exp(high);
  return information * q * (2.0 + q) * (1.0 + 1e-12);
}

TRAMMEL_INLINE std::vector<BallPrior> ball_priors(Eigen::Index dimension) {
  using namespace prior_detail;
  const auto d = static_cast<double>(dimension);
  std::vector<BallPrior> priors;
  for (int i = 0; i < kInformations; ++i) {
    const double share = static_cast<double>(i) / (kInformations - 1);
    priors.push_back(
        ball_prior(kSmallestInformation * std::pow(kLargestInformation / kSmallestInformation, share), d));
  }
  const double zero = bessel_zero(d);
  priors.push_back({1.0, 4.0 * zero * zero / d * (1.0 + 1e-12)});
  return priors;
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
