// SPDX-License-Identifier: Apache-2.0
/// @file
/// Schur complement of one dense block: B_ij += <F_i, X^-1 F_j Y>, product by product.
#pragma once

#include <cstdint>
#include <vector>

#include "trammel/linalg/dense_kernels.hpp"
#include "trammel/sdp/detail/coefficients.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp::detail {

/// Assembles the part of B that one dense block contributes.
///
/// For each F_i, fullest first, U = X^-1 F_i Y meets every F_j not yet met. Three ways (Fujisawa, Kojima,
/// Nakata 1997, formulas F1 to F3), here with r, the number of nonzero rows of F_i, where they have n:
///
/// | way         | what it forms                                       | operations |
/// |-------------|-----------------------------------------------------|---------------------------------------|
/// | kProduct    | all of U, as (n x r)(r x n)                         | 2 n f_i + 2 n^2 r + sum_j f_j | |
/// kDotProduct | the entries of U that an F_j needs, as dot products | 2 n f_i + 4 r sum_j f_j | | kEntries
/// | the same from the entries of F_i one by one         | 8 f_i sum_j f_j                       |
///
/// f is the number of stored entries. The choice is made once, from these counts and the cost of one
/// operation of each kind. A low-rank F_i = V D V' is a kDotProduct with X^-1 V and Y V D.
template <class Scalar>
class DenseSchur {
 public:
  using Matrix = MatrixOf<Scalar>;

  DenseSchur(const Coefficients& coefficients, const std::vector<LowRankTerm>& low_rank, Eigen::Index size)
      : coefficients_(coefficients), size_(size) {
    for (const LowRankTerm& term : low_rank) {
      vectors_.push_back(term.vectors.cast<Scalar>());
      weights_.push_back(term.weights.cast<Scalar>());
      low_rank_variable_.push_back(term.variable);
    }
    choose();
  }

  void add(const Matrix& x_inverse, const Matrix& y, Matrix& schur) {
    add_low_rank(x_inverse, y, schur);
    for (std::size_t i = 0; i < coefficients_.count(); ++i) {
      switch (way_[i]) {
        case Way::kProduct:
          add_product(i, x_inverse, y, schur);
          break;
        case Way::kDotProduct:
          add_dot_products(i, x_inverse, y, schur);
          break;
        case Way::kEntries:
          add_entries(i, x_inverse, y, schur);
          break;
      }
    }
  }

 private:
  enum class Way : std::uint8_t { kProduct, kDotProduct, kEntries };

  /// Cost of one operation relative to one of a scalar loop, measured in the orders of magnitude that matter.
  static constexpr double kVectorCost = 0.4;   // dot products and column updates
  static constexpr double kProductCost = 0.1;  // matrix products
  static constexpr double kGatherCost = 1.5;   // an entry picked out of a matrix
  static constexpr double kCallCost = 60.0;    // setting up a product

  void choose() {
    const std::size_t count = coefficients_.count();
    way_.resize(count);
    support_.resize(count);
    std::size_t total = coefficients_.start.back();
    std::vector<int> seen(static_cast<std::size_t>(size_), -1);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t e = coefficients_.start[i]; e < coefficients_.start[i + 1]; ++e) {
        for (const int r : {coefficients_.row[e], coefficients_.column[e]}) {
          if (seen[static_cast<std::size_t>(r)] != static_cast<int>(i)) {
            seen[static_cast<std::size_t>(r)] = static_cast<int>(i);
            support_[i].push_back(r);
          }
        }
      }
      std::sort(support_[i].begin(), support_[i].end());
      const auto n = static_cast<double>(size_);
      const auto rank = static_cast<double>(support_[i].size());
      const auto own = static_cast<double>(coefficients_.start[i + 1] - coefficients_.start[i]);
      const auto tail = static_cast<double>(total - coefficients_.start[i]);
      const double prepare = kCallCost + kVectorCost * n * (2.0 * own + 2.0 * rank);
      const double product = prepare + kProductCost * 2.0 * n * n * rank + kCallCost + kGatherCost * tail;
      const double dots = prepare + tail * (2.0 * kGatherCost + kVectorCost * 4.0 * rank);
      const double entries = tail * own * 4.0 * kGatherCost;
      way_[i] = entries <= dots && entries <= product ? Way::kEntries
                : dots <= product                     ? Way::kDotProduct
                                                      : Way::kProduct;
    }
  }

  void add_low_rank(const Matrix& x_inverse, const Matrix& y, Matrix& schur) {
    for (std::size_t t = 0; t < vectors_.size(); ++t) {
      const Eigen::Index rank = vectors_[t].cols();
      left_.setZero(rank, size_);
      right_.setZero(rank, size_);
      linalg::Dense<Scalar>::add_product_tn(vectors_[t], x_inverse, Scalar(1), left_);
      linalg::Dense<Scalar>::add_product_tn(vectors_[t], y, Scalar(1), right_);
      for (Eigen::Index c = 0; c < size_; ++c) {
        right_.col(c).array() *= weights_[t].array();
      }
      const int i = low_rank_variable_[t];
      for (std::size_t s = t; s < vectors_.size(); ++s) {
        Matrix a = Matrix::Zero(rank, vectors_[s].cols());
        Matrix b = a;
        linalg::Dense<Scalar>::add_product(left_, vectors_[s], Scalar(1), a);
        linalg::Dense<Scalar>::add_product(right_, vectors_[s], Scalar(1), b);
        Scalar value(0);
        for (Eigen::Index k = 0; k < a.cols(); ++k) {
          value += weights_[s][k] * a.col(k).dot(b.col(k));
        }
        // Two parts of the same F_i meet twice: <F', X^-1 F'' Y> and <F'', X^-1 F' Y>.
        schur(low_rank_variable_[s], i) += low_rank_variable_[s] == i && s != t ? value + value : value;
      }
      for (std::size_t j = 0; j < coefficients_.count(); ++j) {
        const Scalar value = dot_products(j);
        const int other = coefficients_.variable[j];
        schur(other, i) += other == i ? value + value : value;
      }
    }
  }

  /// columns_ <- [left right and r columns of room]: columns of X^-1 on the support of F_i, and of Y F_i.
  void prepare(std::size_t i, const Matrix& x_inverse, const Matrix& y) {
    const std::vector<int>& support = support_[i];
    const auto rank = static_cast<Eigen::Index>(support.size());
    place_.resize(static_cast<std::size_t>(size_));
    columns_.resize(size_, 3 * rank);
    auto left = columns_.leftCols(rank);
    auto right = columns_.middleCols(rank, rank);
    for (Eigen::Index s = 0; s < rank; ++s) {
      place_[static_cast<std::size_t>(support[static_cast<std::size_t>(s)])] = s;
      left.col(s) = x_inverse.col(support[static_cast<std::size_t>(s)]);
    }
    right.setZero();
    for (std::size_t e = coefficients_.start[i]; e < coefficients_.start[i + 1]; ++e) {
      const int r = coefficients_.row[e];
      const int c = coefficients_.column[e];
      const auto value = Scalar(coefficients_.value(e));
      right.col(place_[static_cast<std::size_t>(r)]) += value * y.col(c);
      if (r != c) {
        right.col(place_[static_cast<std::size_t>(c)]) += value * y.col(r);
      }
    }
  }

  void add_product(std::size_t i, const Matrix& x_inverse, const Matrix& y, Matrix& schur) {
    prepare(i, x_inverse, y);
    // U + U' = [left right] [right left]', lower triangle.
    const Eigen::Index rank = columns_.cols() / 3;
    columns_.rightCols(rank) = columns_.leftCols(rank);
    product_.setZero(size_, size_);
    linalg::Dense<Scalar>::add_symmetric_nt(columns_.leftCols(2 * rank), columns_.rightCols(2 * rank),
                                            Scalar(1), product_);
    const int variable = coefficients_.variable[i];
    for (std::size_t j = i; j < coefficients_.count(); ++j) {
      Scalar sum(0);
      for (std::size_t e = coefficients_.start[j]; e < coefficients_.start[j + 1]; ++e) {
        sum += Scalar(coefficients_.half[e]) * product_(coefficients_.column[e], coefficients_.row[e]);
      }
      schur(coefficients_.variable[j], variable) += sum;
    }
  }

  void add_dot_products(std::size_t i, const Matrix& x_inverse, const Matrix& y, Matrix& schur) {
    prepare(i, x_inverse, y);
    const Eigen::Index rank = columns_.cols() / 3;
    left_ = columns_.leftCols(rank).transpose();
    right_ = columns_.middleCols(rank, rank).transpose();
    for (std::size_t j = i; j < coefficients_.count(); ++j) {
      schur(coefficients_.variable[j], coefficients_.variable[i]) += dot_products(j);
    }
  }

  /// <F_j, left' right>.
  [[nodiscard]] Scalar dot_products(std::size_t j) const {
    Scalar sum(0);
    for (std::size_t e = coefficients_.start[j]; e < coefficients_.start[j + 1]; ++e) {
      const int r = coefficients_.row[e];
      const int c = coefficients_.column[e];
      sum +=
          Scalar(coefficients_.half[e]) * (left_.col(r).dot(right_.col(c)) + left_.col(c).dot(right_.col(r)));
    }
    return sum;
  }

  void add_entries(std::size_t i, const Matrix& x_inverse, const Matrix& y, Matrix& schur) {
    for (std::size_t own = coefficients_.start[i]; own < coefficients_.start[i + 1]; ++own) {
      const Scalar* x_row = x_inverse.col(coefficients_.row[own]).data();
      const Scalar* x_column = x_inverse.col(coefficients_.column[own]).data();
      const Scalar* y_row = y.col(coefficients_.row[own]).data();
      const Scalar* y_column = y.col(coefficients_.column[own]).data();
      const auto weight = Scalar(coefficients_.half[own]);
      for (std::size_t j = i; j < coefficients_.count(); ++j) {
        Scalar sum(0);
        for (std::size_t e = coefficients_.start[j]; e < coefficients_.start[j + 1]; ++e) {
          const int r = coefficients_.row[e];
          const int c = coefficients_.column[e];
          sum += Scalar(coefficients_.half[e]) * (x_row[r] * y_column[c] + x_column[r] * y_row[c] +
                                                  x_row[c] * y_column[r] + x_column[c] * y_row[r]);
        }
        schur(coefficients_.variable[j], coefficients_.variable[i]) += weight * sum;
      }
    }
  }

  const Coefficients& coefficients_;
  Eigen::Index size_;
  std::vector<Matrix> vectors_;
  std::vector<VectorOf<Scalar>> weights_;
  std::vector<int> low_rank_variable_;
  std::vector<Way> way_;
  std::vector<std::vector<int>> support_;
  std::vector<Eigen::Index> place_;
  Matrix columns_;
  Matrix left_;
  Matrix right_;
  Matrix product_;
};

}  // namespace trammel::inline TRAMMEL_ABI::sdp::detail
