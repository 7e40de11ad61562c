// SPDX-License-Identifier: Apache-2.0
/// @file
/// Columns without their zeros as the right factor of products, in plain and in double-double arithmetic.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/error_free.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// Which entries of a product are computed; the others are left zero.
enum class ProductPart { kFull, kLower };

/// Columns of a matrix B, n x q, without their zeros, one after the other.
class SparseColumns {
 public:
  SparseColumns() = default;

  /// Of hi + lo; lo empty: zero.
  explicit SparseColumns(const Eigen::MatrixXd& hi, const Eigen::MatrixXd& lo = {}) : rows_(hi.rows()) {
    start_.reserve(static_cast<std::size_t>(hi.cols()) + 1);
    for (Eigen::Index j = 0; j < hi.cols(); ++j) {
      start_.push_back(row_.size());
      for (Eigen::Index k = 0; k < hi.rows(); ++k) {
        if (hi(k, j) != 0.0) {  // |lo| <= u |hi|
          row_.push_back(k);
          hi_.push_back(hi(k, j));
          if (lo.size() != 0) {
            lo_.push_back(lo(k, j));
          }
        }
      }
    }
    start_.push_back(row_.size());
  }

  /// Of the transpose of B.
  [[nodiscard]] SparseColumns transpose() const {
    SparseColumns result;
    result.rows_ = cols();
    result.start_.assign(static_cast<std::size_t>(rows_) + 1, 0);
    for (const Eigen::Index k : row_) {
      ++result.start_[static_cast<std::size_t>(k) + 1];
    }
    for (std::size_t k = 0; k + 1 < result.start_.size(); ++k) {
      result.start_[k + 1] += result.start_[k];
    }
    result.row_.resize(row_.size());
    result.hi_.resize(hi_.size());
    result.lo_.resize(lo_.size());
    std::vector<std::size_t> next(result.start_.begin(), result.start_.end() - 1);
    for (Eigen::Index j = 0; j < cols(); ++j) {
      for (std::size_t t = begin(j); t < end(j); ++t) {
        const std::size_t place = next[static_cast<std::size_t>(row_[t])]++;
        result.row_[place] = j;
        result.hi_[place] = hi_[t];
        if (!lo_.empty()) {
          result.lo_[place] = lo_[t];
        }
      }
    }
    return result;
  }

  [[nodiscard]] Eigen::Index rows() const { return rows_; }
  [[nodiscard]] Eigen::Index cols() const { return static_cast<Eigen::Index>(start_.size()) - 1; }
  [[nodiscard]] bool has_low() const { return !lo_.empty(); }

  /// Entries begin(j) to end(j) - 1 are those of column j.
  [[nodiscard]] std::size_t begin(Eigen::Index j) const { return start_[static_cast<std::size_t>(j)]; }
  [[nodiscard]] std::size_t end(Eigen::Index j) const { return start_[static_cast<std::size_t>(j) + 1]; }
  [[nodiscard]] Eigen::Index row(std::size_t entry) const { return row_[entry]; }
  [[nodiscard]] double high(std::size_t entry) const { return hi_[entry]; }
  [[nodiscard]] double low(std::size_t entry) const { return lo_[entry]; }

  /// Most entries of a column.
  [[nodiscard]] std::size_t longest() const {
    std::size_t result = 0;
    for (std::size_t j = 0; j + 1 < start_.size(); ++j) {
      result = std::max(result, start_[j + 1] - start_[j]);
    }
    return result;
  }

  /// |B|' x, leading parts.
  [[nodiscard]] Eigen::VectorXd sizes_times(const Eigen::VectorXd& x) const {
    Eigen::VectorXd result = Eigen::VectorXd::Zero(cols());
    for (Eigen::Index j = 0; j < cols(); ++j) {
      for (std::size_t t = begin(j); t < end(j); ++t) {
        result(j) += std::abs(hi_[t]) * x(row_[t]);
      }
    }
    return result;
  }

  /// Euclidean norms of the columns of diag(scale) B, leading parts.
  [[nodiscard]] Eigen::VectorXd norms(const Eigen::VectorXd& scale) const {
    Eigen::VectorXd result = Eigen::VectorXd::Zero(cols());
    for (Eigen::Index j = 0; j < cols(); ++j) {
      for (std::size_t t = begin(j); t < end(j); ++t) {
        const double entry = scale(row_[t]) * hi_[t];
        result(j) += entry * entry;
      }
    }
    return result.cwiseSqrt();
  }

 private:
  Eigen::Index rows_ = 0;
  std::vector<std::size_t> start_;
  std::vector<Eigen::Index> row_;
  std::vector<double> hi_;
  std::vector<double> lo_;
};

namespace sparse_detail {

/// Rows computed together: a multiple of every vector length, few enough to stay in the registers.
inline constexpr Eigen::Index kBlockRows = 32;
using BlockColumn = Eigen::Array<double, kBlockRows, 1>;

/// One block of rows of a dense factor, column after column.
class PackedRows {
 public:
  void pack(const Eigen::MatrixXd& x, Eigen::Index first, Eigen::Index count) {
    values_.resize(kBlockRows, x.cols());
    zero_.resize(static_cast<std::size_t>(x.cols()));
    for (Eigen::Index k = 0; k < x.cols(); ++k) {
      values_.col(k).head(count) = x.col(k).segment(first, count);
      values_.col(k).tail(kBlockRows - count).setZero();
      zero_[static_cast<std::size_t>(k)] = static_cast<char>((values_.col(k).array() == 0.0).all());
    }
  }

  [[nodiscard]] bool is_zero(Eigen::Index k) const { return zero_[static_cast<std::size_t>(k)] != 0; }
  [[nodiscard]] const double* values(Eigen::Index k) const { return values_.data() + k * kBlockRows; }

 private:
  Eigen::Matrix<double, kBlockRows, Eigen::Dynamic> values_;
  std::vector<char> zero_;
};

/// (hi, lo) += packed rows times column j of the second factor.
template <bool kLeftLow, bool kRightLow>
inline void accumulate(const PackedRows& left, const PackedRows& left_low, const SparseColumns& right,
                       Eigen::Index j, BlockColumn& hi_out, BlockColumn& lo_out) {
  std::array<double, kBlockRows> hi{};
  std::array<double, kBlockRows> lo{};
  std::copy_n(hi_out.data(), kBlockRows, hi.begin());
  for (std::size_t t = right.begin(j); t < right.end(j); ++t) {
    if (left.is_zero(right.row(t))) {
      continue;  // |lo| <= u |hi|
    }
    const double b = right.high(t);
    const double* const a = left.values(right.row(t));
    [[maybe_unused]] const double b_lo = kRightLow ? right.low(t) : 0.0;
    [[maybe_unused]] const double* const a_lo = kLeftLow ? left_low.values(right.row(t)) : nullptr;
    for (std::size_t r = 0; r < hi.size(); ++r) {
      const DoubleDouble term = two_product(a[r], b);
      const DoubleDouble partial = two_sum(hi[r], term.hi);
      hi[r] = partial.hi;
      double low = term.lo;
      if constexpr (kLeftLow) {
        low = std::fma(a_lo[r], b, low);
      }
      if constexpr (kRightLow) {
        low = std::fma(a[r], b_lo, low);
      }
      lo[r] += partial.lo + low;
    }
  }
  std::copy_n(hi.begin(), kBlockRows, hi_out.data());
  std::copy_n(lo.begin(), kBlockRows, lo_out.data());
}

template <bool kLeftLow, bool kRightLow>
inline void multiply(const Eigen::MatrixXd& a, const Eigen::MatrixXd& a_low, const SparseColumns& b,
                     ProductPart part, Eigen::MatrixXd& hi, Eigen::MatrixXd& lo) {
  PackedRows packed;
  PackedRows packed_low;
  for (Eigen::Index first = 0; first < a.rows(); first += kBlockRows) {
    const Eigen::Index count = std::min(kBlockRows, a.rows() - first);
    packed.pack(a, first, count);
    if constexpr (kLeftLow) {
      packed_low.pack(a_low, first, count);
    }
    const Eigen::Index columns = part == ProductPart::kLower ? std::min(b.cols(), first + count) : b.cols();
    for (Eigen::Index j = 0; j < columns; ++j) {
      BlockColumn high = BlockColumn::Zero();
      BlockColumn low;
      high.head(count) = hi.col(j).segment(first, count).array();
      accumulate<kLeftLow, kRightLow>(packed, packed_low, b, j, high, low);
      for (Eigen::Index r = 0; r < count; ++r) {
        const DoubleDouble normal = two_sum(high(r), low(r));
        hi(first + r, j) = normal.hi;
        lo(first + r, j) = normal.lo;
      }
    }
  }
}

}  // namespace sparse_detail

/// A B in plain arithmetic, leading parts.
inline Eigen::MatrixXd sparse_product(const Eigen::MatrixXd& a, const SparseColumns& b) {
  using namespace sparse_detail;
  Eigen::MatrixXd result(a.rows(), b.cols());
  PackedRows packed;
  for (Eigen::Index first = 0; first < a.rows(); first += kBlockRows) {
    const Eigen::Index count = std::min(kBlockRows, a.rows() - first);
    packed.pack(a, first, count);
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
      BlockColumn total = BlockColumn::Zero();
      for (std::size_t t = b.begin(j); t < b.end(j); ++t) {
        total += b.high(t) * Eigen::Map<const BlockColumn>(packed.values(b.row(t)));
      }
      result.col(j).segment(first, count) = total.head(count).matrix();
    }
  }
  return result;
}

/// hi + lo <- hi + (A + A_low) B in double-double arithmetic, A_low empty or the trailing part of A. With n
/// the most entries of a column the error is at most (n + 5)^2 u^2 (|hi| + |A||B|), u = 2^-53 (Ogita, Rump,
/// Oishi 2005, "Accurate sum and dot product", section 5, kept as an unevaluated sum and with the trailing
/// parts included), but for underflow.
inline void add_sparse_product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& a_low, const SparseColumns& b,
                               ProductPart part, Eigen::MatrixXd& hi, Eigen::MatrixXd& lo) {
  if (a_low.size() != 0 && b.has_low()) {
    sparse_detail::multiply<true, true>(a, a_low, b, part, hi, lo);
  } else if (a_low.size() != 0) {
    sparse_detail::multiply<true, false>(a, a_low, b, part, hi, lo);
  } else if (b.has_low()) {
    sparse_detail::multiply<false, true>(a, a_low, b, part, hi, lo);
  } else {
    sparse_detail::multiply<false, false>(a, a_low, b, part, hi, lo);
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
