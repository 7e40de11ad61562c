// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of double_double.hpp.
#pragma once

#include <algorithm>
#include <cmath>

#include "trammel/linalg/double_double.hpp"
#include "trammel/linalg/error_norms.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

namespace double_double_detail {

/// Upper bound of the sizes of entries, trailing parts included.
inline Eigen::MatrixXd magnitude(const EnclosedMatrix& a) { return (1.0 + 0x1p-51) * a.hi.cwiseAbs(); }

/// Upper bound of the radius of A B - C in double-double arithmetic; c null: C = 0.
inline Eigen::MatrixXd product_radius(const EnclosedMatrix& a, const EnclosedMatrix& b,
                                      const Eigen::MatrixXd* c) {
  const double terms = static_cast<double>(a.cols()) + 5.0;
  const double relative = terms * terms * kUnitRoundoff * kUnitRoundoff;
  const Eigen::MatrixXd a_size = magnitude(a);
  const Eigen::MatrixXd b_size = magnitude(b);
  Eigen::MatrixXd b_error = relative * b_size;
  if (b.radius.size() != 0) {
    b_error += b.radius;
  }
  Eigen::MatrixXd radius = Eigen::MatrixXd::Zero(a.rows(), b.cols());
  radius.noalias() += a_size * b_error;
  if (a.radius.size() != 0) {
    if (b.radius.size() != 0) {
      radius.noalias() += a.radius * (b_size + b.radius);
    } else {
      radius.noalias() += a.radius * b_size;
    }
  }
  if (c != nullptr) {
    radius += relative * c->cwiseAbs();
  }
  // Every operation above rounds at most once per term.
  const double slack = 1.0 + 4.0 * terms * kUnitRoundoff;
  radius = (slack * radius.array() + kUnderflow).matrix();
  if (!(entries_in_range(a.hi) && entries_in_range(b.hi) && (c == nullptr || entries_in_range(*c)))) {
    radius.setConstant(std::numeric_limits<double>::infinity());
  }
  return radius;
}

inline EnclosedMatrix product_from(const EnclosedMatrix& a, const EnclosedMatrix& b, ProductPart part,
                                   const Eigen::MatrixXd* c) {
  EnclosedMatrix result;
  if (c != nullptr) {
    result.hi = -*c;
  } else {
    result.hi = Eigen::MatrixXd::Zero(a.rows(), b.cols());
  }
  result.lo = Eigen::MatrixXd::Zero(a.rows(), b.cols());
  add_sparse_product(a.hi, a.lo, SparseColumns(b.hi, b.lo), part, result.hi, result.lo);
  result.radius = product_radius(a, b, c);
  return result;
}

/// A + sign B; sign is 1 or -1.
inline EnclosedMatrix add(const EnclosedMatrix& a, const EnclosedMatrix& b, double sign) {
  EnclosedMatrix result;
  result.hi.resize(a.rows(), a.cols());
  result.lo.resize(a.rows(), a.cols());
  result.radius = Eigen::MatrixXd::Zero(a.rows(), a.cols());
  for (Eigen::Index i = 0; i < a.hi.size(); ++i) {
    const double a_hi = a.hi.data()[i];
    const double b_hi = sign * b.hi.data()[i];
    const double a_lo = a.lo.size() != 0 ? a.lo.data()[i] : 0.0;
    const double b_lo = b.lo.size() != 0 ? sign * b.lo.data()[i] : 0.0;
    const DoubleDouble leading = two_sum(a_hi, b_hi);
    const DoubleDouble normal = two_sum(leading.hi, leading.lo + (a_lo + b_lo));
    result.hi.data()[i] = normal.hi;
    result.lo.data()[i] = normal.lo;
    // Two roundings of terms of size at most u (|a| + |b|) each, tripled for safety.
    double radius = 8.0 * kUnitRoundoff * kUnitRoundoff * (std::abs(a_hi) + std::abs(b_hi)) + kUnderflow;
    radius += a.radius.size() != 0 ? a.radius.data()[i] : 0.0;
    radius += b.radius.size() != 0 ? b.radius.data()[i] : 0.0;
    result.radius.data()[i] = radius * (1.0 + 0x1p-50);
  }
  return result;
}

}  // namespace double_double_detail

TRAMMEL_INLINE EnclosedMatrix EnclosedMatrix::transpose() const {
  EnclosedMatrix result;
  result.hi = hi.transpose();
  result.lo = lo.transpose();
  result.radius = radius.transpose();
  return result;
}

TRAMMEL_INLINE EnclosedMatrix product(const EnclosedMatrix& a, const EnclosedMatrix& b, ProductPart part) {
  return double_double_detail::product_from(a, b, part, nullptr);
}

TRAMMEL_INLINE EnclosedMatrix product_minus(const EnclosedMatrix& a, const EnclosedMatrix& b,
                                            const Eigen::MatrixXd& c) {
  return double_double_detail::product_from(a, b, ProductPart::kFull, &c);
}

TRAMMEL_INLINE EnclosedMatrix scale_rows(const EnclosedMatrix& a, const Eigen::VectorXd& d) {
  EnclosedMatrix result;
  result.hi.resize(a.rows(), a.cols());
  result.lo.resize(a.rows(), a.cols());
  result.radius.resize(a.rows(), a.cols());
  const bool in_range = entries_in_range(a.hi) && entries_in_range(d);
  for (Eigen::Index j = 0; j < a.cols(); ++j) {
    for (Eigen::Index i = 0; i < a.rows(); ++i) {
      const DoubleDouble leading = two_product(a.hi(i, j), d(i));
      const double low = a.lo.size() != 0 ? a.lo(i, j) * d(i) : 0.0;
      const DoubleDouble normal = two_sum(leading.hi, leading.lo + low);
      result.hi(i, j) = normal.hi;
      result.lo(i, j) = normal.lo;
      // Two roundings of terms of size at most u |a d| each, doubled for safety.
      double radius = 8.0 * kUnitRoundoff * kUnitRoundoff * std::abs(leading.hi) + kUnderflow;
      radius += a.radius.size() != 0 ? a.radius(i, j) * std::abs(d(i)) : 0.0;
      result.radius(i, j) = in_range ? radius * (1.0 + 0x1p-50) : std::numeric_limits<double>::infinity();
    }
  }
  return result;
}

TRAMMEL_INLINE EnclosedMatrix sum(const EnclosedMatrix& a, const EnclosedMatrix& b) {
  return double_double_detail::add(a, b, 1.0);
}

TRAMMEL_INLINE EnclosedMatrix difference(const EnclosedMatrix& a, const EnclosedMatrix& b) {
  return double_double_detail::add(a, b, -1.0);
}

TRAMMEL_INLINE Enclosure inner_product(const EnclosedMatrix& a, const EnclosedMatrix& b) {
  Enclosure result;
  double size = 0.0;          // sum of |a b|
  double from_factors = 0.0;  // what the radii of the factors cause
  for (Eigen::Index i = 0; i < a.hi.size(); ++i) {
    const double a_hi = a.hi.data()[i];
    const double b_hi = b.hi.data()[i];
    const double a_lo = a.lo.size() != 0 ? a.lo.data()[i] : 0.0;
    const double b_lo = b.lo.size() != 0 ? b.lo.data()[i] : 0.0;
    const double a_radius = a.radius.size() != 0 ? a.radius.data()[i] : 0.0;
    const double b_radius = b.radius.size() != 0 ? b.radius.data()[i] : 0.0;
    const DoubleDouble term = two_product(a_hi, b_hi);
    const DoubleDouble partial = two_sum(result.hi, term.hi);
    result.hi = partial.hi;
    result.lo += partial.lo + (term.lo + (a_hi * b_lo + a_lo * b_hi));
    size += std::abs(term.hi);
    from_factors += std::abs(a_hi) * b_radius + a_radius * (std::abs(b_hi) + b_radius);
  }
  const double terms = static_cast<double>(a.hi.size()) + 5.0;
  const double slack = 1.0 + 8.0 * terms * kUnitRoundoff;
  const DoubleDouble normal = two_sum(result.hi, result.lo);
  result.hi = normal.hi;
  result.lo = normal.lo;
  result.radius = slack * (terms * terms * kUnitRoundoff * kUnitRoundoff * size + from_factors) + kUnderflow;
  if (!(entries_in_range(a.hi) && entries_in_range(b.hi))) {
    result.radius = std::numeric_limits<double>::infinity();
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
