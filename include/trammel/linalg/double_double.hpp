// SPDX-License-Identifier: Apache-2.0
/// @file
/// Double-double matrices with proved error radii and their products.
#pragma once

#include <utility>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/error_free.hpp"
#include "trammel/linalg/sparse_columns.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

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
