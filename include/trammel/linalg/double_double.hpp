// SPDX-License-Identifier: Apache-2.0
/// @file
/// Double-double arithmetic with proved error radii: error-free transformations and matrix products.
#pragma once

#include <cmath>
#include <limits>
#include <utility>

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

/// A real number known to lie within `radius` of hi + lo.
struct Enclosure {
  double hi = 0.0;
  double lo = 0.0;
  double radius = 0.0;

  [[nodiscard]] double upper() const noexcept { return round_up(hi + round_up(lo + radius)); }
  [[nodiscard]] double lower() const noexcept { return round_down(hi + round_down(lo - radius)); }
};

/// Every real matrix X with |X - (hi + lo)| <= radius, entry by entry.
///
/// | member | shape           | meaning                                              |
/// |--------|-----------------|------------------------------------------------------|
/// | hi     | m x n           | leading part                                         |
/// | lo     | m x n or empty  | trailing part, |lo| <= u |hi|; empty: zero            |
/// | radius | m x n or empty  | bound of the error of hi + lo; empty: zero           |
///
/// A product of factors with n inner terms has radius (n + 5)^2 u^2 |A||B| beside what the radii of the
/// factors cause, u = 2^-53 (Ogita, Rump, Oishi 2005, "Accurate sum and dot product", section 5, kept as an
/// unevaluated sum and with the trailing parts included). Entries beyond 2^400 give an infinite radius;
/// underflow is covered by an absolute term. Rounding must be to nearest. Cost: about ten operations per
/// term, vectorised over rows; zeros of the second factor, and columns of the first that are zero within a
/// block of rows, are skipped.
struct EnclosedMatrix {
  Eigen::MatrixXd hi;
  Eigen::MatrixXd lo;
  Eigen::MatrixXd radius;

  EnclosedMatrix() = default;
  /// Exactly `values`.
  explicit EnclosedMatrix(Eigen::MatrixXd values) : hi(std::move(values)) {}

  [[nodiscard]] Eigen::Index rows() const { return hi.rows(); }
  [[nodiscard]] Eigen::Index cols() const { return hi.cols(); }
  [[nodiscard]] EnclosedMatrix transpose() const;
};

/// Which entries of a product are computed; the others are left zero.
enum class ProductPart { kFull, kLower };

/// A B.
[[nodiscard]] EnclosedMatrix product(const EnclosedMatrix& a, const EnclosedMatrix& b,
                                     ProductPart part = ProductPart::kFull);
/// A B - C, C exact with the shape of the product: no digits are lost where A B is close to C. Not in
/// kDouble.
[[nodiscard]] EnclosedMatrix product_minus(const EnclosedMatrix& a, const EnclosedMatrix& b,
                                           const Eigen::MatrixXd& c);
/// diag(d) A, d exact.
[[nodiscard]] EnclosedMatrix scale_rows(const EnclosedMatrix& a, const Eigen::VectorXd& d);
/// A + B.
[[nodiscard]] EnclosedMatrix sum(const EnclosedMatrix& a, const EnclosedMatrix& b);
/// A - B.
[[nodiscard]] EnclosedMatrix difference(const EnclosedMatrix& a, const EnclosedMatrix& b);
/// tr A'B, A and B of equal shape.
[[nodiscard]] Enclosure inner_product(const EnclosedMatrix& a, const EnclosedMatrix& b);

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifndef TRAMMEL_COMPILED
#include "trammel/linalg/double_double_impl.hpp"
#endif
