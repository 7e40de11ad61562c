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
#include "trammel/linalg/product_norms.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

namespace double_double_detail {

/// Rows computed together: a multiple of every vector length, few enough to stay in the first cache.
inline constexpr Eigen::Index kBlockRows = 32;

using BlockColumn = std::array<double, kBlockRows>;

/// Share of entries up to which a factor counts as sparse.
inline constexpr double kSparse = 0.3;

/// One block of rows of the first factor: its non-zero columns, one after the other.
struct PackedRows {
  std::vector<Eigen::Index> place;  ///< of each column in the vectors below; -1 for a column of zeros
  std::vector<BlockColumn> hi;
  std::vector<BlockColumn> lo;
};

/// Columns of a matrix without their zeros, one after the other.
struct SparseColumns {
  std::vector<std::size_t> start;  ///< of each column in the vectors below, and their size
  std::vector<Eigen::Index> row;
  std::vector<double> hi;
  std::vector<double> lo;  ///< empty: zero
  std::size_t longest = 0;

  explicit SparseColumns(const EnclosedMatrix& b) {
    start.reserve(static_cast<std::size_t>(b.cols()) + 1);
    start.push_back(0);
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
      const double* const column = b.hi.data() + j * b.rows();
      for (Eigen::Index k = 0; k < b.rows(); ++k) {
        if (column[k] != 0.0) {  // |lo| <= u |hi|
          row.push_back(k);
          hi.push_back(column[k]);
          if (b.lo.size() != 0) {
            lo.push_back(b.lo(k, j));
          }
        }
      }
      longest = std::max(longest, row.size() - start.back());
      start.push_back(row.size());
    }
  }

  [[nodiscard]] Eigen::Index cols() const { return static_cast<Eigen::Index>(start.size()) - 1; }
};

/// Upper bound of the sizes of entries, trailing parts included, times `factor`.
inline Eigen::MatrixXd magnitude(const Eigen::MatrixXd& hi, double factor = 1.0) {
  return (factor * (1.0 + 0x1p-51)) * hi.cwiseAbs();
}

inline SparseColumns magnitude(SparseColumns columns) {
  for (double& entry : columns.hi) {
    entry = (1.0 + 0x1p-51) * std::abs(entry);
  }
  return columns;
}

inline bool is_sparse(const Eigen::MatrixXd& x) {
  const auto zeros = static_cast<double>((x.array() == 0.0).count());
  const auto size = static_cast<double>(x.size());
  return size - zeros <= kSparse * size;
}

inline void pack(const Eigen::MatrixXd& hi, const Eigen::MatrixXd& lo, Eigen::Index first, Eigen::Index count,
                 PackedRows& packed) {
  packed.place.clear();
  packed.hi.clear();
  packed.lo.clear();
  for (Eigen::Index k = 0; k < hi.cols(); ++k) {
    const double* const source = hi.data() + k * hi.rows() + first;
    if (std::all_of(source, source + count, [](double x) { return x == 0.0; })) {
      packed.place.push_back(-1);
      continue;  // |lo| <= u |hi|
    }
    packed.place.push_back(static_cast<Eigen::Index>(packed.hi.size()));
    packed.hi.emplace_back();
    packed.hi.back().fill(0.0);
    std::copy_n(source, count, packed.hi.back().begin());
    if (lo.size() != 0) {
      packed.lo.emplace_back();
      packed.lo.back().fill(0.0);
      std::copy_n(lo.data() + k * hi.rows() + first, count, packed.lo.back().begin());
    }
  }
}

/// (hi, lo) += packed rows times column j of the second factor.
template <bool kLeftLow, bool kRightLow>
inline void accumulate(const PackedRows& left, const SparseColumns& right, std::size_t j, BlockColumn& hi_out,
                       BlockColumn& lo_out) {
  BlockColumn hi = hi_out;
  BlockColumn lo = lo_out;
  for (std::size_t t = right.start[j]; t < right.start[j + 1]; ++t) {
    const Eigen::Index place = left.place[static_cast<std::size_t>(right.row[t])];
    if (place < 0) {
      continue;
    }
    const double b = right.hi[t];
    const BlockColumn& a = left.hi[static_cast<std::size_t>(place)];
    [[maybe_unused]] const double b_lo = kRightLow ? right.lo[t] : 0.0;
    for (std::size_t r = 0; r < a.size(); ++r) {
      const DoubleDouble term = two_product(a[r], b);
      const DoubleDouble partial = two_sum(hi[r], term.hi);
      hi[r] = partial.hi;
      double low = term.lo;
      if constexpr (kLeftLow) {
        low = std::fma(left.lo[static_cast<std::size_t>(place)][r], b, low);
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

/// A B in plain arithmetic.
inline Eigen::MatrixXd sparse_product(const Eigen::MatrixXd& a, const SparseColumns& b) {
  Eigen::MatrixXd result(a.rows(), b.cols());
  PackedRows packed;
  for (Eigen::Index first = 0; first < a.rows(); first += kBlockRows) {
    const Eigen::Index count = std::min(kBlockRows, a.rows() - first);
    pack(a, {}, first, count, packed);
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
      Eigen::Array<double, kBlockRows, 1> total = Eigen::Array<double, kBlockRows, 1>::Zero();
      for (std::size_t t = b.start[static_cast<std::size_t>(j)]; t < b.start[static_cast<std::size_t>(j) + 1];
           ++t) {
        const Eigen::Index place = packed.place[static_cast<std::size_t>(b.row[t])];
        if (place >= 0) {
          total += b.hi[t] * Eigen::Map<const Eigen::Array<double, kBlockRows, 1>>(
                                 packed.hi[static_cast<std::size_t>(place)].data());
        }
      }
      result.col(j).segment(first, count) = total.head(count);
    }
  }
  return result;
}

/// Upper bound of the radius of A B - C whose errors of arithmetic are at most relative (|A||B| + |C|).
/// columns: of B, null where it is not sparse.
inline Eigen::MatrixXd product_radius(const EnclosedMatrix& a, const EnclosedMatrix& b,
                                      const SparseColumns* columns, double relative,
                                      const Eigen::MatrixXd* c) {
  const double terms = static_cast<double>(a.cols()) + 5.0;
  Eigen::MatrixXd a_error = magnitude(a.hi, relative);
  if (a.radius.size() != 0) {
    a_error += a.radius;
  }
  Eigen::MatrixXd radius;
  if (columns != nullptr) {
    radius = sparse_product(a_error, magnitude(*columns));
  } else {
    radius.noalias() = a_error * magnitude(b.hi);
  }
  if (b.radius.size() != 0) {
    if (a.radius.size() != 0) {
      radius.noalias() += (magnitude(a.hi) + a.radius) * b.radius;
    } else {
      radius.noalias() += magnitude(a.hi) * b.radius;
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
  const Eigen::VectorXd scale = balance(a.hi, b.hi);
  const Eigen::VectorXd a_size = row_norms(a.hi, scale);
  const Eigen::VectorXd b_size = column_norms(b.hi, scale);
  Eigen::VectorXd b_error = relative * b_size;
  if (b.radius.size() != 0) {
    b_error += column_norms(b.radius, scale);
  }
  Eigen::MatrixXd radius = a_size * b_error.transpose();
  if (a.radius.size() != 0) {
    radius += row_norms(a.radius, scale) * (b_size + b_error).transpose();
  }
  // Norms, sums and products round at most terms + 3 times; the trailing parts are below u of the leading.
  radius = ((1.0 + 8.0 * terms * kUnitRoundoff) * radius.array() + kUnderflow).matrix();
  if (!(entries_in_range(a.hi) && entries_in_range(b.hi))) {
    radius.setConstant(std::numeric_limits<double>::infinity());
  }
  return radius;
}

template <bool kLeftLow, bool kRightLow>
inline void multiply(const EnclosedMatrix& a, const SparseColumns& b, ProductPart part,
                     EnclosedMatrix& result) {
  PackedRows packed;
  for (Eigen::Index first = 0; first < a.rows(); first += kBlockRows) {
    const Eigen::Index count = std::min(kBlockRows, a.rows() - first);
    pack(a.hi, a.lo, first, count, packed);
    const Eigen::Index columns = part == ProductPart::kLower ? std::min(b.cols(), first + count) : b.cols();
    for (Eigen::Index j = 0; j < columns; ++j) {
      double* const hi_target = result.hi.data() + j * a.rows() + first;
      double* const lo_target = result.lo.data() + j * a.rows() + first;
      BlockColumn hi{};
      BlockColumn lo{};
      std::copy_n(hi_target, count, hi.begin());
      accumulate<kLeftLow, kRightLow>(packed, b, static_cast<std::size_t>(j), hi, lo);
      for (Eigen::Index r = 0; r < count; ++r) {
        const auto entry = static_cast<std::size_t>(r);
        const DoubleDouble normal = two_sum(hi[entry], lo[entry]);
        hi_target[r] = normal.hi;
        lo_target[r] = normal.lo;
      }
    }
  }
}

/// A B - C in double-double arithmetic; c null: C = 0.
inline EnclosedMatrix double_double_product(const EnclosedMatrix& a, const EnclosedMatrix& b, bool sparse,
                                            ProductPart part, const Eigen::MatrixXd* c) {
  EnclosedMatrix result;
  if (c != nullptr) {
    result.hi = -*c;
  } else {
    result.hi = Eigen::MatrixXd::Zero(a.rows(), b.cols());
  }
  result.lo = Eigen::MatrixXd::Zero(a.rows(), b.cols());
  const SparseColumns columns(b);
  const bool a_low = a.lo.size() != 0;
  const bool b_low = b.lo.size() != 0;
  if (a_low && b_low) {
    multiply<true, true>(a, columns, part, result);
  } else if (a_low) {
    multiply<true, false>(a, columns, part, result);
  } else if (b_low) {
    multiply<false, true>(a, columns, part, result);
  } else {
    multiply<false, false>(a, columns, part, result);
  }
  const double terms = static_cast<double>(a.cols()) + 5.0;
  result.radius =
      product_radius(a, b, sparse ? &columns : nullptr, terms * terms * kUnitRoundoff * kUnitRoundoff, c);
  return result;
}

/// A B in plain arithmetic.
inline EnclosedMatrix plain_product(const EnclosedMatrix& a, const EnclosedMatrix& b, bool sparse,
                                    ProductPart part) {
  EnclosedMatrix result;
  if (sparse) {
    const SparseColumns columns(b);
    result.hi = sparse_product(a.hi, columns);
    result.radius = product_radius(
        a, b, &columns, 2.0 * (static_cast<double>(columns.longest) + 5.0) * kUnitRoundoff, nullptr);
    return result;
  }
  result.hi = Eigen::MatrixXd::Zero(a.rows(), b.cols());
  add_product(a.hi, b.hi, part, result.hi);
  result.radius = plain_radius(a, b);
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
  const bool sparse = double_double_detail::is_sparse(b.hi);
  if (precision == Precision::kDouble) {
    return double_double_detail::plain_product(a, b, sparse, part);
  }
  return double_double_detail::double_double_product(a, b, sparse, part, nullptr);
}

TRAMMEL_INLINE EnclosedMatrix product_minus(const EnclosedMatrix& a, const EnclosedMatrix& b,
                                            const Eigen::MatrixXd& c) {
  return double_double_detail::double_double_product(a, b, double_double_detail::is_sparse(b.hi),
                                                     ProductPart::kFull, &c);
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
