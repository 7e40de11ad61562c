// SPDX-License-Identifier: Apache-2.0
/// @file
/// The linear system of one iteration: Schur complement and equations.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "trammel/linalg/dense_kernels.hpp"
#include "trammel/linalg/gmres.hpp"
#include "trammel/linalg/sparse_cholesky.hpp"
#include "trammel/sdp/detail/cone.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp::detail {

/// What to do with pivots of the Schur complement that are no larger than their rounding errors. They belong
/// to dependent constraints, and near the solution also to directions that hardly matter or, where a problem
/// has no interior points, to ones that do.
enum class SmallPivots {
  kHold,   ///< the variable does not move: stable, but the directions are lost
  kShift,  ///< add a multiple of the identity, just large enough: less stable, every direction is kept
  kNone,   ///< there are none: B = M'M is factorised through M, whose condition is the root of that of B
};

/// Solves
///   B dx - G df = r,   G' dx = e
/// for positive semidefinite B (m x m) and the equations' coefficients G (m x k) by the Cholesky factor of
/// K = B + rho G G', scaled to unit diagonal, and of G' K^-1 G, then refines the solution against the system
/// itself. Where few pairs of constraints meet, K is factorised as a sparse matrix. Near the solution of a
/// problem without interior points the condition of B exceeds the digits of any arithmetic; its root M then
/// takes its place.
template <class Scalar>
class SchurSystem {
 public:
  using Vector = VectorOf<Scalar>;
  using Matrix = MatrixOf<Scalar>;
  using Dense = linalg::Dense<Scalar>;

  /// `density` is the share of pairs (i, j) whose F_i and F_j meet in a block.
  SchurSystem(Matrix equations, double density) : equations_(std::move(equations)), density_(density) {}

  void treat_small_pivots(SmallPivots treatment) { small_pivots_ = treatment; }

  /// B with zeros, to be filled with each pair (i, j) once, in either triangle.
  [[nodiscard]] Matrix& clear() {
    matrix_.setZero(equations_.rows(), equations_.rows());
    return matrix_;
  }

  /// M with B = M'M, zero, to be filled by the cones; then `factorise_root` takes the place of `factorise`.
  [[nodiscard]] Matrix& clear_root(Eigen::Index rows) {
    root_.setZero(rows + equations_.cols(), equations_.rows());
    return root_;
  }

  /// Factorises M'M by Cholesky factors of shrinking condition (shifted CholeskyQR: Fukaya, Kannan,
  /// Nakatsukasa, Yamamoto, Yanagisawa 2020), whose errors are those of a QR factorisation of M.
  [[nodiscard]] bool factorise_root() {
    constexpr int kMaxPasses = 6;
    constexpr double kOrthogonal = 1e-3;
    const Eigen::Index m = root_.cols();
    const Eigen::Index k = equations_.cols();
    const Eigen::Index rows = root_.rows() - k;
    sparse_ = false;
    if (k > 0) {
      const Scalar norm = equations_.squaredNorm();
      const Scalar trace = root_.topRows(rows).squaredNorm();
      using std::sqrt;
      rho_ = norm > Scalar(0) ? std::max(trace, std::numeric_limits<Scalar>::epsilon()) / norm : Scalar(0);
      root_.bottomRows(k) = sqrt(rho_) * equations_.transpose();
    }
    Matrix basis = root_;
    scaling_.resize(m);
    for (Eigen::Index i = 0; i < m; ++i) {
      const Scalar length = basis.col(i).norm();
      scaling_[i] = length > Scalar(0) ? Scalar(1) / length : Scalar(length == length ? 1.0 : NAN);
      basis.col(i) *= scaling_[i];
    }
    if (!scaling_.allFinite()) {
      return false;
    }
    factor_ = Matrix::Identity(m, m);
    Matrix lower;
    for (int pass = 0; pass < kMaxPasses; ++pass) {
      Matrix gram = Matrix::Zero(m, m);
      Dense::add_product_tn(basis, basis, Scalar(1), gram);
      const bool orthogonal = static_cast<double>((gram - Matrix::Identity(m, m)).norm()) < kOrthogonal;
      if (!factor_shifted(gram, lower)) {
        return false;
      }
      Matrix product = Matrix::Zero(m, m);
      Dense::add_product(factor_, lower, Scalar(1), product);
      factor_ = product;
      if (orthogonal) {
        break;
      }
      Dense::solve_right_transposed(lower, basis);
    }
    if (k > 0) {
      return factor_equations();
    }
    return factor_.diagonal().allFinite();
  }

  /// Factorises what was filled in; false if it holds NaN or an infinity.
  [[nodiscard]] bool factorise() {
    fold();
    const Eigen::Index m = matrix_.rows();
    const Eigen::Index k = equations_.cols();
    if constexpr (std::is_same_v<Scalar, double>) {
      if (k == 0 && worth_sparse()) {
        sparse_ = factorise_sparse();
        if (sparse_) {
          return true;
        }
      }
    }
    sparse_ = false;
    factor_ = matrix_;
    rho_ = Scalar(0);
    if (k > 0) {
      const Scalar norm = equations_.squaredNorm();
      rho_ = norm > Scalar(0) ? std::max(matrix_.trace(), std::numeric_limits<Scalar>::epsilon()) / norm
                              : Scalar(0);
      Dense::add_symmetric_nt(equations_, equations_, rho_, factor_);
    }
    if (!factor_guarded(Matrix(factor_), factor_, scaling_, shift_)) {
      return false;
    }
    if (k > 0 && !factor_equations()) {
      return false;
    }
    return m == 0 || factor_.diagonal().allFinite();
  }

  /// Solution [dx; df] for the right-hand side [r; e].
  [[nodiscard]] Vector solve(const Vector& right) {
    const int max_steps = small_pivots_ == SmallPivots::kHold ? 8 : 40;
    constexpr double kRoundingErrors = 4.0;
    return linalg::gmres<Scalar>(
        right, [&](const auto& v) { return apply(v); }, [&](const auto& v) { return precondition(v); },
        max_steps, Scalar(kRoundingErrors) * std::numeric_limits<Scalar>::epsilon(), relative_residual_);
  }

  /// Whether the factors held are those of a sparse matrix.
  [[nodiscard]] bool is_sparse() const { return sparse_; }

  /// ||right - A solution|| / ||right|| of the last solution.
  [[nodiscard]] Scalar relative_residual() const { return relative_residual_; }

 private:
  [[nodiscard]] bool worth_sparse() const {
    constexpr Eigen::Index kSmall = 400;  // below, the dense factorisation takes no time
    constexpr double kFull = 0.05;        // more entries fill in to a dense factor
    return matrix_.rows() >= kSmall && density_ < kFull;
  }

  /// Factor of G' K^-1 G.
  [[nodiscard]] bool factor_equations() {
    const Eigen::Index k = equations_.cols();
    Matrix half = equations_.transpose() * scaling_.asDiagonal();
    Dense::solve_right_transposed(factor_, half);
    equation_factor_.setZero(k, k);
    Dense::add_symmetric_nt(half, half, Scalar(1), equation_factor_);
    return factor_guarded(Matrix(equation_factor_), equation_factor_, equation_scaling_, equation_shift_);
  }

  /// Cholesky factor of gram + shift I, the shift as small as rounding errors allow; upper triangle zero.
  [[nodiscard]] static bool factor_shifted(const Matrix& gram, Matrix& lower) {
    constexpr double kStep = 10.0;
    constexpr double kLargest = 1e-4;
    const Scalar eps = std::numeric_limits<Scalar>::epsilon();
    for (Scalar shift(0); shift < Scalar(kLargest);
         shift = std::max(Scalar(kStep) * eps, shift * Scalar(kStep))) {
      lower = gram;
      lower.diagonal().array() += shift;
      if (Dense::cholesky(lower) == 0 && lower.diagonal().allFinite()) {
        lower.template triangularView<Eigen::StrictlyUpper>().setZero();
        return true;
      }
    }
    return false;
  }

  /// Sparse factor of S B S with unit diagonal, shifted as little as makes it positive definite.
  [[nodiscard]] bool factorise_sparse() {
    constexpr double kStep = 10.0;
    constexpr double kLargest = 1e-8;  // more: left to the dense method, which holds single variables
    const Eigen::Index m = matrix_.rows();
    scaling_.resize(m);
    for (Eigen::Index i = 0; i < m; ++i) {
      if (!(matrix_(i, i) > Scalar(0))) {
        return false;
      }
      scaling_[i] = 1.0 / std::sqrt(matrix_(i, i));
    }
    std::vector<Eigen::Triplet<double>> entries;
    for (Eigen::Index j = 0; j < m; ++j) {
      for (Eigen::Index i = j; i < m; ++i) {
        if (matrix_(i, j) != Scalar(0) || i == j) {
          entries.emplace_back(i, j, matrix_(i, j) * scaling_[i] * scaling_[j]);
        }
      }
    }
    linalg::SparseMatrix scaled(m, m);
    scaled.setFromTriplets(entries.begin(), entries.end());
    for (double shift = 0.0; shift < kLargest;
         shift = std::max(kStep * std::numeric_limits<double>::epsilon(), kStep * shift)) {
      for (Eigen::Index i = 0; i < m; ++i) {
        scaled.coeffRef(i, i) = 1.0 + shift;
      }
      if (sparse_factor_.compute(scaled)) {
        return true;
      }
    }
    return false;
  }

  /// Cholesky factor of S A S with unit diagonal, small pivots treated as asked for.
  [[nodiscard]] bool factor_guarded(const Matrix& a, Matrix& factor, Vector& scaling, Scalar& shift) {
    constexpr double kStep = 10.0;
    constexpr double kLargest = 1e-4;
    const Scalar eps = std::numeric_limits<Scalar>::epsilon();
    shift = shift > Scalar(kStep) * eps ? shift / Scalar(kStep) : Scalar(0);
    for (;;) {
      factor = a;
      scale(factor, scaling);
      if (!scaling.allFinite()) {
        return false;
      }
      if (small_pivots_ != SmallPivots::kShift) {
        const linalg::PivotGuard<Scalar> guard{Scalar(kPivotRoundingErrors) * eps, Scalar(kHeld)};
        return Dense::cholesky(factor, guard) >= 0;
      }
      factor.diagonal().array() += shift;
      if (Dense::cholesky(factor, {.threshold = Scalar(kPivotRoundingErrors) * eps}) == 0) {
        return true;
      }
      shift = std::max(Scalar(kStep) * eps, shift * Scalar(kStep));
      if (!(shift < Scalar(kLargest))) {
        return false;
      }
    }
  }

  /// a <- S a S with unit diagonal, lower triangle.
  static void scale(Matrix& a, Vector& scaling) {
    using std::sqrt;
    scaling.resize(a.rows());
    for (Eigen::Index i = 0; i < a.rows(); ++i) {
      scaling[i] = a(i, i) > Scalar(0) ? Scalar(1) / sqrt(a(i, i)) : Scalar(a(i, i) == a(i, i) ? 1.0 : NAN);
    }
    for (Eigen::Index j = 0; j < a.cols(); ++j) {
      a.col(j).tail(a.rows() - j).array() *= scaling.tail(a.rows() - j).array() * scaling[j];
    }
  }

  /// Adds both triangles and makes the matrix symmetric, tile by tile.
  void fold() {
    constexpr Eigen::Index kTile = 32;
    const Eigen::Index m = matrix_.rows();
    for (Eigen::Index j = 0; j < m; j += kTile) {
      for (Eigen::Index i = j; i < m; i += kTile) {
        for (Eigen::Index c = j; c < std::min(j + kTile, m); ++c) {
          for (Eigen::Index r = std::max(i, c + 1); r < std::min(i + kTile, m); ++r) {
            const Scalar sum = matrix_(r, c) + matrix_(c, r);
            matrix_(r, c) = sum;
            matrix_(c, r) = sum;
          }
        }
      }
    }
  }

  [[nodiscard]] Vector apply(const Vector& v) const {
    const Eigen::Index m = equations_.rows();
    const Eigen::Index k = equations_.cols();
    Vector out(m + k);
    out.setZero();
    if (small_pivots_ == SmallPivots::kNone) {
      const Eigen::Index rows = root_.rows() - k;
      Vector image = Vector::Zero(rows);
      Dense::add_vector_product(root_.topRows(rows), v.head(m), Scalar(1), image);
      Dense::add_vector_product_t(root_.topRows(rows), image, Scalar(1), out.head(m));
    } else {
      Dense::add_vector_product(matrix_, v.head(m), Scalar(1), out.head(m));
    }
    if (k > 0) {
      Dense::add_vector_product(equations_, v.tail(k), Scalar(-1), out.head(m));
      Dense::add_vector_product_t(equations_, v.head(m), Scalar(1), out.tail(k));
    }
    return out;
  }

  static void solve_factored(const Matrix& factor, const Vector& scaling, Vector& v) {
    v.array() *= scaling.array();
    Dense::solve_lower(factor, v);
    Dense::solve_lower_transposed(factor, v);
    v.array() *= scaling.array();
  }

  [[nodiscard]] Vector precondition(const Vector& v) const {
    const Eigen::Index m = equations_.rows();
    const Eigen::Index k = equations_.cols();
    Vector dx = v.head(m);
    if constexpr (std::is_same_v<Scalar, double>) {
      if (sparse_) {
        dx.array() *= scaling_.array();
        sparse_factor_.solve_in_place(dx);
        dx.array() *= scaling_.array();
        return dx;
      }
    }
    if (k == 0) {
      solve_factored(factor_, scaling_, dx);
      return dx;
    }
    Dense::add_vector_product(equations_, v.tail(k), rho_, dx);
    const Vector right = dx;
    solve_factored(factor_, scaling_, dx);
    Vector df = v.tail(k);
    Dense::add_vector_product_t(equations_, dx, Scalar(-1), df);
    solve_factored(equation_factor_, equation_scaling_, df);
    dx = right;
    Dense::add_vector_product(equations_, df, Scalar(1), dx);
    solve_factored(factor_, scaling_, dx);
    Vector out(m + k);
    out << dx, df;
    return out;
  }

  Matrix equations_;
  Matrix matrix_;
  Matrix root_;  ///< M with M'M = B, below it room for the equations
  Matrix factor_;
  Vector scaling_;
  Matrix equation_factor_;
  Vector equation_scaling_;
  static constexpr double kPivotRoundingErrors = 8.0;  // smaller pivots are rounding errors
  static constexpr double kHeld = 1e60;                // pivot of a variable that does not move

  linalg::SparseCholesky sparse_factor_;
  bool sparse_ = false;
  double density_;
  SmallPivots small_pivots_ = SmallPivots::kHold;
  Scalar rho_{0};
  Scalar shift_{0};
  Scalar equation_shift_{0};
  Scalar relative_residual_{0};
};

}  // namespace trammel::inline TRAMMEL_ABI::sdp::detail
