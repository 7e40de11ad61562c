// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of double_double.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "trammel/linalg/double_double.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

namespace double_double_detail {

inline constexpr double kUnitRoundoff = 0x1p-53;
/// Rows computed together: a multiple of every vector length, few enough to stay in the first cache.
inline constexpr Eigen::Index kBlockRows = 32;
/// Entries beyond this could overflow in products of products.
inline constexpr double kLargestEntry = 0x1p400;
/// Covers all errors from underflow in a sum of 2^40 terms whose factors are at most kLargestEntry.
inline constexpr double kUnderflow = 0x1p-600;

using BlockColumn = std::array<double, kBlockRows>;

/// One block of rows of the first factor: its non-zero columns, one after the other.
struct PackedRows {
  std::vector<Eigen::Index> columns;
  std::vector<BlockColumn> hi;
  std::vector<BlockColumn> lo;
};

inline void pack(const EnclosedMatrix& a, Eigen::Index first, Eigen::Index count, PackedRows& packed) {
  packed.columns.clear();
  packed.hi.clear();
  packed.lo.clear();
  const bool has_lo = a.lo.size() != 0;
  for (Eigen::Index k = 0; k < a.cols(); ++k) {
    const double* const source = a.hi.data() + k * a.rows() + first;
    if (std::all_of(source, source + count, [](double x) { return x == 0.0; })) {
      continue;  // |lo| <= u |hi|
    }
    packed.columns.push_back(k);
    packed.hi.emplace_back();
    packed.hi.back().fill(0.0);
    std::copy_n(source, count, packed.hi.back().begin());
    if (has_lo) {
      packed.lo.emplace_back();
      packed.lo.back().fill(0.0);
      std::copy_n(a.lo.data() + k * a.rows() + first, count, packed.lo.back().begin());
    }
  }
}

/// (hi, lo) += packed rows times one column of the second factor.
template <bool kLeftLow, bool kRightLow>
inline void accumulate(const PackedRows& left, const double* right_hi, const double* right_lo,
                       BlockColumn& hi_out, BlockColumn& lo_out) {
  BlockColumn hi = hi_out;
  BlockColumn lo = lo_out;
  for (std::size_t t = 0; t < left.columns.size(); ++t) {
    const double b = right_hi[left.columns[t]];
    if (b == 0.0) {
      continue;
    }
    const BlockColumn& a = left.hi[t];
    [[maybe_unused]] const double b_lo = kRightLow ? right_lo[left.columns[t]] : 0.0;
    for (std::size_t r = 0; r < a.size(); ++r) {
      const DoubleDouble term = two_product(a[r], b);
      const DoubleDouble partial = two_sum(hi[r], term.hi);
      hi[r] = partial.hi;
      double low = term.lo;
      if constexpr (kLeftLow) {
        low = std::fma(left.lo[t][r], b, low);
      }
      if constexpr (kRightLow) {
        low = std::fma(a[r], b_lo, low);
      }
      lo[r] += partial.lo + low;
    }
  }
  hi_out = hi;
  lo_out = lo;
}

inline bool entries_in_range(const Eigen::MatrixXd& x) {
  return x.size() == 0 || x.cwiseAbs().maxCoeff() <= kLargestEntry;
}

/// |hi| + |lo|, rounded up.
inline Eigen::MatrixXd magnitude(const EnclosedMatrix& a) { return (1.0 + 0x1p-51) * a.hi.cwiseAbs(); }

/// Upper bound of the radius of A B - C in double-double arithmetic.
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

/// Upper bound of the radius of A B in plain arithmetic, from norms of the rows of A and columns of B (Cauchy
/// and Schwarz) after a diagonal scaling D of the inner dimension that balances the two: no further products.
inline Eigen::MatrixXd plain_radius(const EnclosedMatrix& a, const EnclosedMatrix& b) {
  const double terms = static_cast<double>(a.cols()) + 5.0;
  const double relative = 2.0 * terms * kUnitRoundoff;
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(a.cols());
  for (Eigen::Index k = 0; k < a.cols(); ++k) {
    const double ratio = b.hi.row(k).lpNorm<Eigen::Infinity>() / a.hi.col(k).lpNorm<Eigen::Infinity>();
    if (std::isfinite(ratio) && ratio > 0.0) {
      scale(k) = std::exp2(std::round(std::log2(ratio) / 2.0));
    }
  }
  const auto row_norms = [&scale](const Eigen::MatrixXd& x) -> Eigen::VectorXd {
    return (x * scale.asDiagonal()).rowwise().norm();
  };
  const auto column_norms = [&scale](const Eigen::MatrixXd& x) -> Eigen::RowVectorXd {
    return (scale.cwiseInverse().asDiagonal() * x).colwise().norm();
  };
  const Eigen::VectorXd a_size = row_norms(a.hi);
  const Eigen::RowVectorXd b_size = column_norms(b.hi);
  Eigen::RowVectorXd b_error = relative * b_size;
  if (b.radius.size() != 0) {
    b_error += column_norms(b.radius);
  }
  Eigen::MatrixXd radius = a_size * b_error;
  if (a.radius.size() != 0) {
    radius += row_norms(a.radius) * (b_size + b_error);
  }
  // Norms, sums and products round at most terms + 3 times; the trailing parts are below u of the leading.
  radius = ((1.0 + 8.0 * terms * kUnitRoundoff) * radius.array() + kUnderflow).matrix();
  if (!(entries_in_range(a.hi) && entries_in_range(b.hi))) {
    radius.setConstant(std::numeric_limits<double>::infinity());
  }
  return radius;
}

template <bool kLeftLow, bool kRightLow>
inline void multiply(const EnclosedMatrix& a, const EnclosedMatrix& b, ProductPart part,
                     EnclosedMatrix& result) {
  PackedRows packed;
  for (Eigen::Index first = 0; first < a.rows(); first += kBlockRows) {
    const Eigen::Index count = std::min(kBlockRows, a.rows() - first);
    pack(a, first, count, packed);
    const Eigen::Index columns = part == ProductPart::kLower ? std::min(b.cols(), first + count) : b.cols();
    for (Eigen::Index j = 0; j < columns; ++j) {
      double* const hi_target = result.hi.data() + j * a.rows() + first;
      double* const lo_target = result.lo.data() + j * a.rows() + first;
      BlockColumn hi{};
      BlockColumn lo{};
      std::copy_n(hi_target, count, hi.begin());
      accumulate<kLeftLow, kRightLow>(packed, b.hi.data() + j * b.rows(),
                                      kRightLow ? b.lo.data() + j * b.rows() : nullptr, hi, lo);
      for (Eigen::Index r = 0; r < count; ++r) {
        const auto entry = static_cast<std::size_t>(r);
        const DoubleDouble normal = two_sum(hi[entry], lo[entry]);
        hi_target[r] = normal.hi;
        lo_target[r] = normal.lo;
      }
    }
  }
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
  const bool a_low = a.lo.size() != 0;
  const bool b_low = b.lo.size() != 0;
  if (a_low && b_low) {
    multiply<true, true>(a, b, part, result);
  } else if (a_low) {
    multiply<true, false>(a, b, part, result);
  } else if (b_low) {
    multiply<false, true>(a, b, part, result);
  } else {
    multiply<false, false>(a, b, part, result);
  }
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

TRAMMEL_INLINE EnclosedMatrix product(const EnclosedMatrix& a, const EnclosedMatrix& b, Precision precision,
                                      ProductPart part) {
  if (precision == Precision::kDoubleDouble) {
    return double_double_detail::product_from(a, b, part, nullptr);
  }
  EnclosedMatrix result;
  result.hi.noalias() = a.hi * b.hi;
  result.radius = double_double_detail::plain_radius(a, b);
  return result;
}

TRAMMEL_INLINE EnclosedMatrix product_minus(const EnclosedMatrix& a, const EnclosedMatrix& b,
                                            const Eigen::MatrixXd& c) {
  return double_double_detail::product_from(a, b, ProductPart::kFull, &c);
}

TRAMMEL_INLINE EnclosedMatrix scale_rows(const EnclosedMatrix& a, const Eigen::VectorXd& d) {
  using double_double_detail::kUnderflow;
  using double_double_detail::kUnitRoundoff;
  EnclosedMatrix result;
  result.hi.resize(a.rows(), a.cols());
  result.lo.resize(a.rows(), a.cols());
  result.radius.resize(a.rows(), a.cols());
  const bool in_range =
      double_double_detail::entries_in_range(a.hi) && double_double_detail::entries_in_range(d);
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
  using double_double_detail::kUnderflow;
  using double_double_detail::kUnitRoundoff;
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
  if (!(double_double_detail::entries_in_range(a.hi) && double_double_detail::entries_in_range(b.hi))) {
    result.radius = std::numeric_limits<double>::infinity();
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
