// SPDX-License-Identifier: Apache-2.0
/// @file
/// Products, Cholesky factors and triangular inverses of dense column-major matrices in place, for double and
/// ExtendedDouble. Everything of cubic cost rests on one product, so the code is small and its speed is that
/// of the product.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

template <class Scalar>
using DenseMatrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
template <class Scalar>
using DenseVector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

/// A matrix or a block of one.
template <class Scalar>
using BlockRef = Eigen::Ref<DenseMatrix<Scalar>, 0, Eigen::OuterStride<>>;
template <class Scalar>
using ConstBlockRef = Eigen::Ref<const DenseMatrix<Scalar>, 0, Eigen::OuterStride<>>;
template <class Scalar>
using VectorRef = Eigen::Ref<DenseVector<Scalar>>;
template <class Scalar>
using ConstVectorRef = Eigen::Ref<const DenseVector<Scalar>>;

/// What to do with pivots that are not larger than the threshold.
template <class Scalar>
struct PivotGuard {
  Scalar threshold{0};  ///< pivots up to this (or NaN) are too small
  /// Replaces a pivot too small, so that the variable stays where it is; 0: the factorisation fails instead.
  Scalar replacement{0};
};

/// Operations for one scalar type.
template <class Scalar>
struct Dense {
  using Matrix = DenseMatrix<Scalar>;
  using Block = BlockRef<Scalar>;
  using ConstBlock = ConstBlockRef<Scalar>;
  using Vector = VectorRef<Scalar>;
  using ConstVector = ConstVectorRef<Scalar>;

  /// c += scale a b, c += scale a' b, c += scale a b'.
  static void add_product(const ConstBlock& a, const ConstBlock& b, Scalar scale, Block c);
  static void add_product_tn(const ConstBlock& a, const ConstBlock& b, Scalar scale, Block c);
  static void add_product_nt(const ConstBlock& a, const ConstBlock& b, Scalar scale, Block c);
  /// y += scale a x, y += scale a' x.
  static void add_vector_product(const ConstBlock& a, const ConstVector& x, Scalar scale, Vector y);
  static void add_vector_product_t(const ConstBlock& a, const ConstVector& x, Scalar scale, Vector y);
  /// Lower triangle (with parts of the upper one) of c += scale a b', where the product is symmetric.
  static void add_symmetric_nt(const ConstBlock& a, const ConstBlock& b, Scalar scale, Block c);

  /// A = L L' in the lower triangle of `a`; the strict upper one is not read and becomes undefined. Returns
  /// the number of replaced pivots (0: A is numerically positive definite), -1 on failure. n^3/3 operations.
  [[nodiscard]] static Eigen::Index cholesky(Block a, const PivotGuard<Scalar>& guard = {});
  /// b <- b L^-T, L in the lower triangle of `factor`.
  static void solve_right_transposed(const ConstBlock& factor, Block b);
  /// v <- L^-1 v and v <- L^-T v.
  static void solve_lower(const ConstBlock& factor, Vector v);
  static void solve_lower_transposed(const ConstBlock& factor, Vector v);
  /// L^-1 in the place of L, with zeros above the diagonal.
  static void invert_lower(Block factor);
  /// Full symmetric A^-1 = L^-T L^-1 from L^-1 with zeros above the diagonal.
  static void inverse_from_factor(const Matrix& inverse_factor, Matrix& inverse);
};

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifdef TRAMMEL_COMPILED
#include "trammel/linalg/extended_double.hpp"
extern template struct trammel::linalg::Dense<double>;
extern template struct trammel::linalg::Dense<trammel::linalg::ExtendedDouble>;
#else
#include "trammel/linalg/dense_kernels_impl.hpp"
#endif
