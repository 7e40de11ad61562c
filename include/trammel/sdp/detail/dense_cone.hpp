// SPDX-License-Identifier: Apache-2.0
/// @file
/// The cone of positive semidefinite matrices.
#pragma once

#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "trammel/linalg/dense_kernels.hpp"
#include "trammel/linalg/lanczos.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/sdp/detail/coefficients.hpp"
#include "trammel/sdp/detail/dense_schur.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp::detail {

/// One dense block: X and Y are symmetric n x n matrices, stored in full.
template <class ScalarType>
class DenseCone {
 public:
  using Scalar = ScalarType;
  using Vector = VectorOf<Scalar>;
  using Matrix = MatrixOf<Scalar>;
  using Dense = linalg::Dense<Scalar>;

  explicit DenseCone(const DenseData& data)
      : n_(data.size),
        coefficients_(data),
        low_rank_(data.low_rank),
        all_(coefficients_, 0, coefficients_.row.size(), data.size),
        needed_(coefficients_, 0, coefficients_.constant_begin, data.size),
        schur_(coefficients_, low_rank_, data.size) {
    constexpr double kSparseShare =
        1.0 / 12.0;  // a product with a sparse matrix runs that much slower per entry
    const double full = static_cast<double>(n_) * static_cast<double>(n_);
    const bool sparse = low_rank_.empty() && n_ > kAlwaysDense;
    sparse_x_ = sparse && 2.0 * static_cast<double>(all_.row.size()) < kSparseShare * full;
    sparse_adjoint_ = sparse && 2.0 * static_cast<double>(needed_.row.size()) < kSparseShare * full;
    for (const LowRankTerm& term : low_rank_) {
      vectors_.push_back(term.vectors.cast<Scalar>());
    }
    dx_ = dy_ = Matrix::Zero(n_, n_);
    second_ = dx_;
  }

  [[nodiscard]] Eigen::Index size() const { return n_; }
  [[nodiscard]] const Matrix& x() const { return x_; }
  [[nodiscard]] const Matrix& y() const { return y_; }

  void start(Scalar x, Scalar y) {
    x_ = Matrix::Identity(n_, n_) * x;
    y_ = Matrix::Identity(n_, n_) * y;
  }

  void set(const Matrix& x, const Matrix& y) {
    x_ = x;
    y_ = y;
  }

  void update_residual(const Vector& x) {
    d_ = -x_;
    add_operator(x, Scalar(1), d_);
    const Scalar norm = d_.norm();
    has_residual_ = norm > Scalar(kNegligible) * std::numeric_limits<Scalar>::epsilon() * x_.norm();
  }

  [[nodiscard]] bool factorise() {
    factor_x_ = x_;
    factor_y_ = y_;
    if (Dense::cholesky(factor_x_) != 0 || Dense::cholesky(factor_y_) != 0) {
      return false;
    }
    Dense::invert_lower(factor_x_);
    Dense::inverse_from_factor(factor_x_, x_inverse_);
    return x_inverse_.allFinite();
  }

  void add_adjoint_y(Vector& out, Scalar scale) const { add_adjoint(y_, scale, out); }

  void add_schur(Matrix& schur) { schur_.add(x_inverse_, y_, schur); }

  [[nodiscard]] Eigen::Index root_rows() const { return n_ * n_; }

  /// Rows of M with M'M = B: the column of F_i holds Lx^-1 F_i Ly, X = Lx Lx', Y = Ly Ly'.
  void fill_root(Eigen::Index first, Matrix& root) {
    const Matrix right = factor_y_.template triangularView<Eigen::Lower>();
    for (std::size_t k = 0; k < coefficients_.count(); ++k) {
      work_.setZero(n_, n_);
      for (std::size_t e = coefficients_.start[k]; e < coefficients_.start[k + 1]; ++e) {
        add_entry(e, Scalar(1), work_);
      }
      add_to_root(right, first, coefficients_.variable[k], root);
    }
    for (std::size_t t = 0; t < low_rank_.size(); ++t) {
      work_.setZero(n_, n_);
      add_low_rank(t, Scalar(1), work_);
      add_to_root(right, first, low_rank_[t].variable, root);
    }
  }

  void add_gram(Matrix& gram) {
    const Matrix identity = Matrix::Identity(n_, n_);
    schur_.add(identity, identity, gram);
  }

  void subtract_from_y(const Vector& z) {
    work_.setZero(n_, n_);
    add_operator(z, Scalar(0), work_);
    y_ -= work_;
  }

  /// Smallest eigenvalue of Y; 0 stands for any positive one.
  [[nodiscard]] double smallest_y() {
    work_ = y_;
    if (Dense::cholesky(work_) == 0) {
      return 0.0;
    }
    const Eigen::MatrixXd rounded = y_.template cast<double>();
    if (!rounded.allFinite()) {
      return -std::numeric_limits<double>::infinity();
    }
    return linalg::SymmetricEigen(rounded, Eigen::EigenvaluesOnly).eigenvalues()[0];
  }

  void begin_direction(Scalar mu, bool second_order, Vector& out) {
    mu_ = mu;
    has_second_ = second_order;
    if (second_order) {
      times_x_pattern(dy_, dx_, second_);
    }
    target_ = mu_ * x_inverse_ - y_;
    if (has_residual_ || has_second_) {
      work_.setZero(n_, n_);
      if (has_residual_) {
        times_x_pattern(y_, d_, work_);
      }
      if (has_second_) {
        work_ += second_;
      }
      subtract_needed();
    }
    add_adjoint(target_, Scalar(1), out);
  }

  void finish_direction(const Vector& dx) {
    if (has_residual_) {
      dx_ = d_;
    } else {
      dx_.setZero();
    }
    add_operator(dx, Scalar(0), dx_);
    times_x_pattern(y_, dx_, work_);
    if (has_second_) {
      work_ += second_;
    }
    multiply(work_, x_inverse_, product_);
    dy_ = mu_ * x_inverse_ - y_;
    subtract_symmetric_part(product_, dy_);
  }

  void refine_direction(const Vector& dx) {
    target_.setZero(n_, n_);
    add_operator(dx, Scalar(0), target_);
    dx_ += target_;
    times_x_pattern(y_, target_, work_);
    multiply(work_, x_inverse_, product_);
    subtract_symmetric_part(product_, dy_);
  }

  void add_adjoint_dy(Vector& out, Scalar scale) const { add_adjoint(dy_, scale, out); }

  /// The step is exact for small blocks; by Lanczos, and a little less, for large ones. `enough`: larger
  /// steps need not be told apart.
  [[nodiscard]] double max_step(Side side, Scalar enough) {
    const double smallest =
        n_ <= kExactSize || !std::is_same_v<Scalar, double> ? exact_smallest(side) : lanczos(side, enough);
    return smallest < 0.0 ? -1.0 / smallest : std::numeric_limits<double>::infinity();
  }

  void step(Side side, Scalar length) {
    if (side == Side::kX) {
      x_ += length * dx_;
    } else {
      y_ += length * dy_;
    }
  }

  [[nodiscard]] Scalar inner_product() const { return x_.cwiseProduct(y_).sum(); }
  [[nodiscard]] Scalar after_step(Scalar a, Scalar b) const {
    return (x_ + a * dx_).cwiseProduct(y_ + b * dy_).sum();
  }
  [[nodiscard]] Scalar residual_norm_squared() const { return d_.squaredNorm(); }
  /// ||sum x_i F_i - X||^2 = ||D + F_0||^2.
  [[nodiscard]] Scalar distance_to_ray_squared() {
    work_ = d_;
    for (std::size_t e = coefficients_.constant_begin; e < coefficients_.row.size(); ++e) {
      add_entry(e, Scalar(1), work_);
    }
    return work_.squaredNorm();
  }
  [[nodiscard]] Scalar constant_times_y() const {
    return coefficients_.inner(coefficients_.constant_begin, coefficients_.row.size(), y_);
  }

 private:
  static constexpr Eigen::Index kExactSize = 40;    // all eigenvalues cost no more than a few Lanczos steps
  static constexpr Eigen::Index kAlwaysDense = 24;  // no gain from sparse loops
  static constexpr double kNegligible = 16.0;       // residuals of this many rounding errors are none

  void multiply(const Matrix& a, const Matrix& b, Matrix& out) const {
    out.setZero(n_, n_);
    Dense::add_product(a, b, Scalar(1), out);
  }

  void add_adjoint(const Matrix& symmetric, Scalar scale, Vector& out) const {
    for (std::size_t k = 0; k < coefficients_.count(); ++k) {
      out[coefficients_.variable[k]] +=
          scale * coefficients_.inner(coefficients_.start[k], coefficients_.start[k + 1], symmetric);
    }
    for (std::size_t t = 0; t < low_rank_.size(); ++t) {
      Matrix product = Matrix::Zero(n_, vectors_[t].cols());
      Dense::add_product(symmetric, vectors_[t], Scalar(1), product);
      for (Eigen::Index k = 0; k < product.cols(); ++k) {
        out[low_rank_[t].variable] +=
            scale * Scalar(low_rank_[t].weights[k]) * product.col(k).dot(vectors_[t].col(k));
      }
    }
  }

  void add_entry(std::size_t e, Scalar factor, Matrix& out) const {
    const Scalar value = factor * Scalar(coefficients_.value(e));
    out(coefficients_.row[e], coefficients_.column[e]) += value;
    if (coefficients_.row[e] != coefficients_.column[e]) {
      out(coefficients_.column[e], coefficients_.row[e]) += value;
    }
  }

  /// out += sum x_i F_i - constant F_0.
  void add_operator(const Vector& x, Scalar constant, Matrix& out) const {
    for (std::size_t k = 0; k < coefficients_.count(); ++k) {
      const Scalar factor = x[coefficients_.variable[k]];
      for (std::size_t e = coefficients_.start[k]; e < coefficients_.start[k + 1]; ++e) {
        add_entry(e, factor, out);
      }
    }
    if (constant != Scalar(0)) {
      for (std::size_t e = coefficients_.constant_begin; e < coefficients_.row.size(); ++e) {
        add_entry(e, -constant, out);
      }
    }
    for (std::size_t t = 0; t < low_rank_.size(); ++t) {
      add_low_rank(t, x[low_rank_[t].variable], out);
    }
  }

  void add_low_rank(std::size_t t, Scalar factor, Matrix& out) const {
    const VectorOf<Scalar> weights = factor * low_rank_[t].weights.template cast<Scalar>();
    const Matrix scaled = vectors_[t] * weights.asDiagonal();
    Dense::add_product_nt(scaled, vectors_[t], Scalar(1), out);
  }

  /// Adds Lx^-1 F Ly, F in work_, to the column of a variable.
  void add_to_root(const Matrix& right, Eigen::Index first, int variable, Matrix& root) {
    multiply(work_, right, product_);
    multiply(factor_x_, product_, work_);
    root.col(variable).segment(first, n_ * n_) += work_.reshaped();
  }

  /// out = a b for a symmetric b with the sparsity of X.
  void times_x_pattern(const Matrix& a, const Matrix& b, Matrix& out) const {
    if (!sparse_x_) {
      multiply(a, b, out);
      return;
    }
    out.setZero(n_, n_);
    for (std::size_t e = 0; e < all_.row.size(); ++e) {
      const int r = all_.row[e];
      const int c = all_.column[e];
      out.col(c) += b(r, c) * a.col(r);
      if (r != c) {
        out.col(r) += b(r, c) * a.col(c);
      }
    }
  }

  static void subtract_symmetric_part(const Matrix& product, Matrix& from) {
    const Eigen::Index size = product.rows();
    for (Eigen::Index j = 0; j < size; ++j) {
      for (Eigen::Index i = 0; i <= j; ++i) {
        const Scalar value = from(i, j) - (product(i, j) + product(j, i)) / Scalar(2);
        from(i, j) = value;
        from(j, i) = value;
      }
    }
  }

  /// target_ -= sym(work_ X^-1), where an F_i needs it.
  void subtract_needed() {
    if (!sparse_adjoint_) {
      multiply(work_, x_inverse_, product_);
      subtract_symmetric_part(product_, target_);
      return;
    }
    product_ = work_.transpose();
    for (std::size_t e = 0; e < needed_.row.size(); ++e) {
      const int r = needed_.row[e];
      const int c = needed_.column[e];
      target_(r, c) -=
          (product_.col(r).dot(x_inverse_.col(c)) + product_.col(c).dot(x_inverse_.col(r))) / Scalar(2);
    }
  }

  /// Smallest eigenvalue of L^-1 dX L^-T, X = L L', or the same for Y.
  [[nodiscard]] double exact_smallest(Side side) {
    if (side == Side::kX) {
      multiply(factor_x_, dx_, product_);
      work_.setZero(n_, n_);
      Dense::add_product_nt(product_, factor_x_, Scalar(1), work_);
    } else {
      product_ = dy_;
      Dense::solve_right_transposed(factor_y_, product_);
      work_ = product_.transpose();
      Dense::solve_right_transposed(factor_y_, work_);
    }
    const Eigen::MatrixXd scaled = work_.template cast<double>();
    if (!scaled.allFinite()) {
      return -std::numeric_limits<double>::infinity();
    }
    return linalg::SymmetricEigen(scaled, Eigen::EigenvaluesOnly).eigenvalues()[0];
  }

  [[nodiscard]] double lanczos(Side side, Scalar enough) {
    if constexpr (std::is_same_v<Scalar, double>) {
      const linalg::LanczosSettings settings{.enough = -1.0 / enough};
      Eigen::VectorXd first(n_);
      Eigen::VectorXd second(n_);
      const auto scaled = [&](const auto& in, Eigen::VectorXd& out) {
        first.setZero();
        if (side == Side::kX) {
          Dense::add_vector_product_t(factor_x_, in, 1.0, first);
        } else {
          first = in;
          Dense::solve_lower_transposed(factor_y_, first);
        }
        second.setZero();
        Dense::add_vector_product(side == Side::kX ? dx_ : dy_, first, 1.0, second);
        if (side == Side::kX) {
          out.setZero();
          Dense::add_vector_product(factor_x_, second, 1.0, out);
        } else {
          out = second;
          Dense::solve_lower(factor_y_, out);
        }
      };
      return linalg::lanczos_smallest(n_, scaled, settings);
    } else {
      return exact_smallest(side);
    }
  }

  Eigen::Index n_;
  Coefficients coefficients_;
  const std::vector<LowRankTerm>& low_rank_;
  std::vector<Matrix> vectors_;
  Pattern all_;
  Pattern needed_;
  DenseSchur<Scalar> schur_;
  bool sparse_x_ = false;
  bool sparse_adjoint_ = false;
  bool has_residual_ = true;
  bool has_second_ = false;
  Scalar mu_{0};
  Matrix x_;
  Matrix y_;
  Matrix d_;
  Matrix dx_;
  Matrix dy_;
  Matrix second_;    ///< dY dX of the predictor
  Matrix factor_x_;  ///< inverse of the Cholesky factor of X
  Matrix factor_y_;  ///< Cholesky factor of Y, lower triangle
  Matrix x_inverse_;
  Matrix target_;
  Matrix work_;
  Matrix product_;
};

}  // namespace trammel::inline TRAMMEL_ABI::sdp::detail
