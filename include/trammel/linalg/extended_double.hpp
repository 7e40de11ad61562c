// SPDX-License-Identifier: Apache-2.0
/// @file
/// Numbers of about 32 digits as unevaluated sums of two doubles.
#pragma once

#include <cmath>
#include <limits>
#include <type_traits>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// high + low with |low| <= ulp(high)/2 (Dekker 1971; Hida, Li, Bailey 2001). Relative error of one operation
/// below 2^-102; range and special values as double. Needs arithmetic that rounds each operation to double,
/// in the order written.
class ExtendedDouble {
 public:
  constexpr ExtendedDouble() = default;
  // Conversions from built-in numbers are exact for double and int, hence implicit.
  constexpr ExtendedDouble(double value) : high_(value) {}                              // NOLINT
  constexpr ExtendedDouble(int value) : high_(value) {}                                 // NOLINT
  constexpr ExtendedDouble(long value) : ExtendedDouble(static_cast<double>(value)) {}  // NOLINT
  constexpr ExtendedDouble(double high, double low) : high_(high), low_(low) {}

  [[nodiscard]] constexpr double high() const { return high_; }
  [[nodiscard]] constexpr double low() const { return low_; }
  explicit constexpr operator double() const { return high_; }
  explicit constexpr operator int() const { return static_cast<int>(high_); }

  constexpr ExtendedDouble operator-() const { return {-high_, -low_}; }

  friend constexpr ExtendedDouble operator+(const ExtendedDouble& a, const ExtendedDouble& b) {
    const ExtendedDouble high = two_sum(a.high_, b.high_);
    const ExtendedDouble low = two_sum(a.low_, b.low_);
    const ExtendedDouble middle = quick_two_sum(high.high_, high.low_ + low.high_);
    return quick_two_sum(middle.high_, middle.low_ + low.low_);
  }
  friend constexpr ExtendedDouble operator-(const ExtendedDouble& a, const ExtendedDouble& b) {
    return a + (-b);
  }
  friend ExtendedDouble operator*(const ExtendedDouble& a, const ExtendedDouble& b) {
    const ExtendedDouble product = two_product(a.high_, b.high_);
    return quick_two_sum(product.high_, product.low_ + (a.high_ * b.low_ + a.low_ * b.high_));
  }
  friend ExtendedDouble operator/(const ExtendedDouble& a, const ExtendedDouble& b) {
    const double first = a.high_ / b.high_;
    if (!std::isfinite(first) || !std::isfinite(b.high_)) {
      return first;
    }
    ExtendedDouble rest = a - b * first;
    const double second = rest.high_ / b.high_;
    rest = rest - b * second;
    const double third = rest.high_ / b.high_;
    return quick_two_sum(first, second) + third;
  }
  ExtendedDouble& operator+=(const ExtendedDouble& other) { return *this = *this + other; }
  ExtendedDouble& operator-=(const ExtendedDouble& other) { return *this = *this - other; }
  ExtendedDouble& operator*=(const ExtendedDouble& other) { return *this = *this * other; }
  ExtendedDouble& operator/=(const ExtendedDouble& other) { return *this = *this / other; }

  friend constexpr bool operator==(const ExtendedDouble& a, const ExtendedDouble& b) {
    return a.high_ == b.high_ && a.low_ == b.low_;
  }
  friend constexpr bool operator<(const ExtendedDouble& a, const ExtendedDouble& b) {
    return a.high_ < b.high_ || (a.high_ == b.high_ && a.low_ < b.low_);
  }
  friend constexpr bool operator>(const ExtendedDouble& a, const ExtendedDouble& b) { return b < a; }
  friend constexpr bool operator<=(const ExtendedDouble& a, const ExtendedDouble& b) {
    return a < b || a == b;
  }
  friend constexpr bool operator>=(const ExtendedDouble& a, const ExtendedDouble& b) {
    return b < a || a == b;
  }

  friend constexpr ExtendedDouble abs(const ExtendedDouble& a) { return a.high_ < 0.0 ? -a : a; }
  friend ExtendedDouble sqrt(const ExtendedDouble& a) {
    if (!(a.high_ > 0.0) || !std::isfinite(a.high_)) {
      return std::sqrt(a.high_);
    }
    // One step of Newton's method from the double root (Karp, Markstein 1997).
    const double root = std::sqrt(a.high_);
    const ExtendedDouble square = two_product(root, root);
    return quick_two_sum(root, (a - square).high_ / (2.0 * root));
  }
  friend bool isfinite(const ExtendedDouble& a) { return std::isfinite(a.high_); }
  friend bool isnan(const ExtendedDouble& a) { return std::isnan(a.high_); }
  friend bool isinf(const ExtendedDouble& a) { return std::isinf(a.high_); }

 private:
  static constexpr ExtendedDouble quick_two_sum(double a, double b) {
    const double sum = a + b;
    return {sum, b - (sum - a)};
  }
  static constexpr ExtendedDouble two_sum(double a, double b) {
    const double sum = a + b;
    const double part = sum - a;
    return {sum, (a - (sum - part)) + (b - part)};
  }
  static ExtendedDouble two_product(double a, double b) {
    const double product = a * b;
#ifdef __FMA__
    return {product, std::fma(a, b, -product)};
#else
    constexpr double kSplit = 134217729.0;  // 2^27 + 1
    const double scaled_a = kSplit * a;
    const double high_a = scaled_a - (scaled_a - a);
    const double low_a = a - high_a;
    const double scaled_b = kSplit * b;
    const double high_b = scaled_b - (scaled_b - b);
    const double low_b = b - high_b;
    return {product, ((high_a * high_b - product) + high_a * low_b + low_a * high_b) + low_a * low_b};
#endif
  }

  double high_ = 0.0;
  double low_ = 0.0;
};

}  // namespace trammel::inline TRAMMEL_ABI::linalg

template <>
class std::numeric_limits<trammel::linalg::ExtendedDouble> : public std::numeric_limits<double> {
 public:
  using Number = trammel::linalg::ExtendedDouble;
  static constexpr int digits = 104;
  static constexpr int digits10 = 31;
  static constexpr Number epsilon() noexcept { return 0x1p-104; }
  static constexpr Number min() noexcept { return 0x1p-969; }  // below, the low part underflows
  static constexpr Number max() noexcept { return std::numeric_limits<double>::max(); }
  static constexpr Number lowest() noexcept { return std::numeric_limits<double>::lowest(); }
  static constexpr Number infinity() noexcept { return std::numeric_limits<double>::infinity(); }
  static constexpr Number quiet_NaN() noexcept { return std::numeric_limits<double>::quiet_NaN(); }
};

namespace Eigen {
template <>
struct NumTraits<trammel::linalg::ExtendedDouble> : GenericNumTraits<trammel::linalg::ExtendedDouble> {
  using Real = trammel::linalg::ExtendedDouble;
  using NonInteger = Real;
  using Nested = Real;
  using Literal = double;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 2,
    AddCost = 20,
    MulCost = 10
  };
  static Real epsilon() { return std::numeric_limits<Real>::epsilon(); }
  static Real dummy_precision() { return 1e-28; }
  static int digits10() { return std::numeric_limits<Real>::digits10; }
};
}  // namespace Eigen
