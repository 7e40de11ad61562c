// SPDX-License-Identifier: Apache-2.0
/// @file
/// Square banded matrices: products, transposes, Cholesky factors, and what an inverse holds within a band.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// n x n matrix whose entry (i, j) is zero unless i - lower <= j <= i + upper, stored row by row. Places of
/// the band outside the matrix are kept and are zero, so that rows can be added without looking at the ends.
/// Memory: n (lower + upper + 1) numbers. Products and transposes keep to the band: linear cost in n.
class BandedMatrix {
 public:
  using Row = Eigen::Map<Eigen::RowVectorXd>;
  using ConstRow = Eigen::Map<const Eigen::RowVectorXd>;

  BandedMatrix() = default;
  BandedMatrix(Eigen::Index size, Eigen::Index lower, Eigen::Index upper)
      : size_(size), lower_(lower), upper_(upper) {
    require(size >= 0 && lower >= 0 && upper >= 0, "band",
            std::to_string(size) + " rows, " + std::to_string(lower) + " below, " + std::to_string(upper) +
                " above the diagonal",
            "none negative");
    entries_.assign(static_cast<std::size_t>(size * width()), 0.0);
  }

  [[nodiscard]] Eigen::Index size() const noexcept { return size_; }
  [[nodiscard]] Eigen::Index lower() const noexcept { return lower_; }
  [[nodiscard]] Eigen::Index upper() const noexcept { return upper_; }
  [[nodiscard]] Eigen::Index width() const noexcept { return lower_ + upper_ + 1; }

  /// Row i: columns i - lower .. i + upper.
  [[nodiscard]] Row row(Eigen::Index i) { return {entries_.data() + i * width(), width()}; }
  [[nodiscard]] ConstRow row(Eigen::Index i) const { return {entries_.data() + i * width(), width()}; }

  /// Columns of row i that are within the matrix: first and one behind the last.
  [[nodiscard]] Eigen::Index first(Eigen::Index i) const { return std::max<Eigen::Index>(0, i - lower_); }
  [[nodiscard]] Eigen::Index behind(Eigen::Index i) const { return std::min(size_, i + upper_ + 1); }

  [[nodiscard]] bool holds(Eigen::Index i, Eigen::Index j) const {
    return j - i >= -lower_ && j - i <= upper_;
  }
  /// Entry within the band.
  [[nodiscard]] double& at(Eigen::Index i, Eigen::Index j) {
    return entries_[static_cast<std::size_t>(i * width() + j - i + lower_)];
  }
  [[nodiscard]] double at(Eigen::Index i, Eigen::Index j) const {
    return entries_[static_cast<std::size_t>(i * width() + j - i + lower_)];
  }
  /// Entry anywhere.
  [[nodiscard]] double operator()(Eigen::Index i, Eigen::Index j) const {
    return holds(i, j) ? at(i, j) : 0.0;
  }

  /// Rows i0.. and columns j0.. as a dense matrix.
  [[nodiscard]] Eigen::MatrixXd block(Eigen::Index i0, Eigen::Index j0, Eigen::Index rows,
                                      Eigen::Index columns) const {
    Eigen::MatrixXd result(rows, columns);
    for (Eigen::Index i = 0; i < rows; ++i) {
      for (Eigen::Index j = 0; j < columns; ++j) {
        result(i, j) = (*this)(i0 + i, j0 + j);
      }
    }
    return result;
  }

  /// Adds `values` to row i, columns j0..; what falls outside the band is left out.
  void add(Eigen::Index i, Eigen::Index j0, const Eigen::RowVectorXd& values) {
    const Eigen::Index begin = std::max(j0, first(i));
    const Eigen::Index end = std::min(j0 + values.size(), behind(i));
    if (begin < end) {
      row(i).segment(begin - i + lower_, end - begin) += values.segment(begin - j0, end - begin);
    }
  }

  [[nodiscard]] BandedMatrix transpose() const {
    BandedMatrix result(size_, upper_, lower_);
    for (Eigen::Index i = 0; i < size_; ++i) {
      for (Eigen::Index j = first(i); j < behind(i); ++j) {
        result.at(j, i) = at(i, j);
      }
    }
    return result;
  }

  /// A x for a vector or the columns of a matrix.
  [[nodiscard]] Eigen::MatrixXd operator*(const Eigen::MatrixXd& x) const {
    Eigen::MatrixXd result(size_, x.cols());
    for (Eigen::Index i = 0; i < size_; ++i) {
      const Eigen::Index begin = first(i);
      const Eigen::Index count = behind(i) - begin;
      result.row(i) = row(i).segment(begin - i + lower_, count) * x.middleRows(begin, count);
    }
    return result;
  }

  [[nodiscard]] BandedMatrix operator*(const BandedMatrix& b) const {
    BandedMatrix result(size_, lower_ + b.lower_, upper_ + b.upper_);
    for (Eigen::Index i = 0; i < size_; ++i) {
      Row target = result.row(i);
      for (Eigen::Index k = first(i); k < behind(i); ++k) {
        const double factor = at(i, k);
        if (factor != 0.0) {
          // Column k - b.lower of b's row k is place k - i + lower of the result's row.
          target.segment(k - i + lower_, b.width()) += factor * b.row(k);
        }
      }
    }
    return result;
  }

 private:
  Eigen::Index size_ = 0, lower_ = 0, upper_ = 0;
  std::vector<double> entries_;
};

/// a A + b B, in a band that holds both.
[[nodiscard]] inline BandedMatrix combine(double a, const BandedMatrix& A, double b, const BandedMatrix& B) {
  BandedMatrix result(A.size(), std::max(A.lower(), B.lower()), std::max(A.upper(), B.upper()));
  for (Eigen::Index i = 0; i < A.size(); ++i) {
    result.row(i).segment(result.lower() - A.lower(), A.width()) += a * A.row(i);
    result.row(i).segment(result.lower() - B.lower(), B.width()) += b * B.row(i);
  }
  return result;
}

/// <A, B> = tr A'B.
[[nodiscard]] inline double inner_product(const BandedMatrix& A, const BandedMatrix& B) {
  const Eigen::Index lower = std::min(A.lower(), B.lower());
  const Eigen::Index width = lower + std::min(A.upper(), B.upper()) + 1;
  double sum = 0.0;
  for (Eigen::Index i = 0; i < A.size(); ++i) {
    sum += A.row(i).segment(A.lower() - lower, width).dot(B.row(i).segment(B.lower() - lower, width));
  }
  return sum;
}

/// Overwrites the lower triangle of a symmetric A by L with A = L L'; false at the first pivot that is not
/// positive and finite. True division and square root, plain sums: what proofs by factorisation ask for.
/// Cost: n lower^2 operations.
[[nodiscard]] inline bool cholesky_in_place(BandedMatrix& A) {
  const Eigen::Index lower = A.lower();
  for (Eigen::Index i = 0; i < A.size(); ++i) {
    BandedMatrix::Row row = A.row(i);
    for (Eigen::Index j = A.first(i); j < i; ++j) {
      const Eigen::Index begin = std::max(A.first(i), A.first(j));
      const Eigen::Index count = j - begin;
      const double sum =
          row.segment(begin - i + lower, count).dot(A.row(j).segment(begin - j + lower, count));
      row(j - i + lower) = (row(j - i + lower) - sum) / A.at(j, j);
    }
    const double pivot = row(lower) - row.head(lower).squaredNorm();
    if (!(pivot > 0.0 && std::isfinite(pivot))) {
      return false;
    }
    row(lower) = std::sqrt(pivot);
  }
  return true;
}

/// x <- (R'R)^-1 x for an upper triangle R (R.lower() may be 0).
inline void solve_normal_in_place(const BandedMatrix& R, Eigen::MatrixXd& x) {
  const Eigen::Index n = R.size();
  for (Eigen::Index i = 0; i < n; ++i) {  // R' y = x
    x.row(i) /= R.at(i, i);
    for (Eigen::Index j = i + 1; j < R.behind(i); ++j) {
      x.row(j) -= R.at(i, j) * x.row(i);
    }
  }
  for (Eigen::Index i = n; i-- > 0;) {
    for (Eigen::Index j = i + 1; j < R.behind(i); ++j) {
      x.row(i) -= R.at(i, j) * x.row(j);
    }
    x.row(i) /= R.at(i, i);
  }
}

/// (R'R)^-1 within `reach` places of the diagonal, at least the band of R'R, for an upper triangle R: row by
/// row from the last (Takahashi, Fagan, Chin 1973, "Formation of a sparse bus impedance matrix and its
/// application to short circuit study"). Cost: n upper reach operations.
[[nodiscard]] inline BandedMatrix inverse_within_band(const BandedMatrix& R, Eigen::Index reach = 0) {
  reach = std::max(reach, R.upper());
  BandedMatrix Z(R.size(), reach, reach);
  Eigen::RowVectorXd behind(reach);
  for (Eigen::Index i = R.size(); i-- > 0;) {
    const Eigen::Index count = Z.behind(i) - i - 1;
    behind.head(count).setZero();
    for (Eigen::Index k = i + 1; k < R.behind(i); ++k) {  // columns i + 1 .. i + count of row k
      behind.head(count) -= R.at(i, k) / R.at(i, i) * Z.row(k).segment(i + 1 - k + reach, count);
    }
    double own = 1.0 / R.at(i, i);
    for (Eigen::Index j = i + 1; j <= i + count; ++j) {
      Z.at(i, j) = Z.at(j, i) = behind(j - i - 1);
      own -= R(i, j) * Z.at(i, j);
    }
    Z.at(i, i) = own / R.at(i, i);
  }
  return Z;
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
