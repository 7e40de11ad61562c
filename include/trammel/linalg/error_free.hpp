// SPDX-License-Identifier: Apache-2.0
/// @file
/// Error-free transformations and directed rounding of doubles.
#pragma once

#include <cmath>
#include <limits>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// Unevaluated sum hi + lo.
struct DoubleDouble {
  double hi = 0.0;
  double lo = 0.0;
};

/// hi = fl(a + b), lo = the rounding error, exactly (Knuth 1969, TwoSum).
[[nodiscard]] inline DoubleDouble two_sum(double a, double b) noexcept {
  const double sum = a + b;
  const double b_part = sum - a;
  return {sum, (a - (sum - b_part)) + (b - b_part)};
}

/// hi = fl(a b), lo = the rounding error, exactly unless it underflows (TwoProd with a fused multiply-add).
[[nodiscard]] inline DoubleDouble two_product(double a, double b) noexcept {
#ifdef FP_FAST_FMA
  // Written as a fused operation so that no compiler contracts the product with the sum that follows.
  const double product = std::fma(a, b, 0.0);
#else
  const double product = a * b;
#endif
  return {product, std::fma(a, b, -product)};
}

/// Next double above: an upper bound of a result rounded once.
[[nodiscard]] inline double round_up(double x) noexcept {
  return std::nextafter(x, std::numeric_limits<double>::infinity());
}

/// Next double below.
[[nodiscard]] inline double round_down(double x) noexcept {
  return std::nextafter(x, -std::numeric_limits<double>::infinity());
}

/// Sum, every step rounded up.
[[nodiscard]] inline double sum_rounded_up(const Eigen::VectorXd& values) noexcept {
  double total = 0.0;
  for (const double value : values) {
    total = round_up(total + value);
  }
  return total;
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
