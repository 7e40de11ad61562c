// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of dense_kernels.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <vector>

#include "trammel/linalg/dense_kernels.hpp"
#include "trammel/linalg/extended_double.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

namespace detail {

inline constexpr Eigen::Index kSmall = 24;  // recursion ends where loops over columns are as fast as products
inline constexpr Eigen::Index kPanel = 96;  // columns per product where only a triangle is wanted
inline constexpr Eigen::Index kVectorPanel = 64;  // columns per product with a vector

/// Half of `size`, a multiple of kSmall where possible.
inline Eigen::Index split(Eigen::Index size) {
  return size <= 2 * kSmall ? size / 2 : (size / 2 + kSmall - 1) / kSmall * kSmall;
}

}  // namespace detail

namespace detail {

/// A ExtendedDouble matrix as a sum of double matrices whose products are exact: slice p holds multiples of
/// 2^(e - kSliceBits (p + 1)), e the exponent of the largest entry of a row (or column).
struct Slices {
  static constexpr int kSliceBits = 22;  // 2 (22 - 1) bits of a product, 8 of a sum of kDepth, 3 of kCount
  static constexpr int kCount = 5;       // 110 bits in all
  static constexpr Eigen::Index kDepth = 256;  // terms of one sum

  /// `by_row`: one exponent per row, otherwise one per column.
  Slices(const ConstBlockRef<ExtendedDouble>& a, bool by_row) {
    parts.assign(kCount, Eigen::MatrixXd(a.rows(), a.cols()));
    Eigen::VectorXd largest = Eigen::VectorXd::Zero(by_row ? a.rows() : a.cols());
    for (Eigen::Index j = 0; j < a.cols(); ++j) {
      for (Eigen::Index i = 0; i < a.rows(); ++i) {
        double& line = largest[by_row ? i : j];
        line = std::max(line, std::abs(a(i, j).high()));
      }
    }
    for (double& line : largest) {
      line = std::isfinite(line) ? std::ldexp(1.5, std::ilogb(line) + 1 + kMantissaBits) : line;
    }
    for (Eigen::Index j = 0; j < a.cols(); ++j) {
      for (Eigen::Index i = 0; i < a.rows(); ++i) {
        ExtendedDouble rest = a(i, j);
        double anchor = largest[by_row ? i : j];
        for (Eigen::MatrixXd& part : parts) {
          anchor *= kSliceUnit;
          const double piece = (rest.high() + anchor) - anchor;
          part(i, j) = piece;
          rest -= piece;
        }
      }
    }
  }

  std::vector<Eigen::MatrixXd> parts;

 private:
  static constexpr int kMantissaBits = 52;
  static constexpr double kSliceUnit = 1.0 / (1 << kSliceBits);
};

/// c += scale a b to nearly full precision from products of doubles (Ozaki, Ogita, Oishi, Rump 2012).
inline void add_sliced_product(const ConstBlockRef<ExtendedDouble>& a, const ConstBlockRef<ExtendedDouble>& b,
                               ExtendedDouble scale, BlockRef<ExtendedDouble> c) {
  Eigen::MatrixXd sum(c.rows(), c.cols());
  for (Eigen::Index k = 0; k < a.cols(); k += Slices::kDepth) {
    const Eigen::Index depth = std::min(Slices::kDepth, a.cols() - k);
    const Slices left(a.middleCols(k, depth), true);
    const Slices right(b.middleRows(k, depth), false);
    for (int order = Slices::kCount - 1; order >= 0; --order) {
      sum.setZero();
      for (int p = 0; p <= order; ++p) {
        Dense<double>::add_product(left.parts[static_cast<std::size_t>(p)],
                                   right.parts[static_cast<std::size_t>(order - p)], 1.0, sum);
      }
      for (Eigen::Index j = 0; j < c.cols(); ++j) {
        for (Eigen::Index i = 0; i < c.rows(); ++i) {
          c(i, j) += scale * ExtendedDouble(sum(i, j));
        }
      }
    }
  }
}

}  // namespace detail

template <class Scalar>
void Dense<Scalar>::add_product(const ConstBlock& a, const ConstBlock& b, Scalar scale, Block c) {
  if constexpr (std::is_same_v<Scalar, double>) {
    c.noalias() += scale * a * b;
  } else {
    constexpr Eigen::Index kThin = 16;  // below, slicing costs more than it saves
    if (a.rows() >= kThin && a.cols() >= kThin && b.cols() >= kThin) {
      detail::add_sliced_product(a, b, scale, c);
      return;
    }
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
      for (Eigen::Index k = 0; k < a.cols(); ++k) {
        const Scalar factor = scale * b(k, j);
        for (Eigen::Index i = 0; i < a.rows(); ++i) {
          c(i, j) += a(i, k) * factor;
        }
      }
    }
  }
}

template <class Scalar>
void Dense<Scalar>::add_product_tn(const ConstBlock& a, const ConstBlock& b, Scalar scale, Block c) {
  if constexpr (std::is_same_v<Scalar, double>) {
    c.noalias() += scale * a.transpose() * b;
  } else {
    add_product(a.transpose().eval(), b, scale, c);
  }
}

template <class Scalar>
void Dense<Scalar>::add_product_nt(const ConstBlock& a, const ConstBlock& b, Scalar scale, Block c) {
  if constexpr (std::is_same_v<Scalar, double>) {
    c.noalias() += scale * a * b.transpose();
  } else {
    add_product(a, b.transpose().eval(), scale, c);
  }
}

template <class Scalar>
void Dense<Scalar>::add_vector_product(const ConstBlock& a, const ConstVector& x, Scalar scale, Vector y) {
  if constexpr (std::is_same_v<Scalar, double>) {
    y.noalias() += scale * a * x;
  } else {
    for (Eigen::Index k = 0; k < a.cols(); ++k) {
      const Scalar factor = scale * x[k];
      for (Eigen::Index i = 0; i < a.rows(); ++i) {
        y[i] += a(i, k) * factor;
      }
    }
  }
}

template <class Scalar>
void Dense<Scalar>::add_vector_product_t(const ConstBlock& a, const ConstVector& x, Scalar scale, Vector y) {
  if constexpr (std::is_same_v<Scalar, double>) {
    y.noalias() += scale * a.transpose() * x;
  } else {
    for (Eigen::Index k = 0; k < a.cols(); ++k) {
      Scalar sum(0);
      for (Eigen::Index i = 0; i < a.rows(); ++i) {
        sum += a(i, k) * x[i];
      }
      y[k] += scale * sum;
    }
  }
}

template <class Scalar>
void Dense<Scalar>::add_symmetric_nt(const ConstBlock& a, const ConstBlock& b, Scalar scale, Block c) {
  const Eigen::Index size = c.rows();
  for (Eigen::Index j = 0; j < size; j += detail::kPanel) {
    const Eigen::Index width = std::min(detail::kPanel, size - j);
    add_product_nt(a.bottomRows(size - j), b.middleRows(j, width), scale, c.block(j, j, size - j, width));
  }
}

template <class Scalar>
Eigen::Index Dense<Scalar>::cholesky(Block a, const PivotGuard<Scalar>& guard) {
  using std::sqrt;
  const Eigen::Index size = a.rows();
  if (size > detail::kSmall) {
    const Eigen::Index half = detail::split(size);
    const Eigen::Index rest = size - half;
    const Eigen::Index first = cholesky(a.topLeftCorner(half, half), guard);
    if (first < 0) {
      return -1;
    }
    solve_right_transposed(a.topLeftCorner(half, half), a.bottomLeftCorner(rest, half));
    add_symmetric_nt(a.bottomLeftCorner(rest, half), a.bottomLeftCorner(rest, half), Scalar(-1),
                     a.bottomRightCorner(rest, rest));
    const Eigen::Index second = cholesky(a.bottomRightCorner(rest, rest), guard);
    return second < 0 ? -1 : first + second;
  }
  Eigen::Index replaced = 0;
  for (Eigen::Index k = 0; k < size; ++k) {
    Scalar pivot = a(k, k);
    if (!(pivot > guard.threshold)) {
      if (!(guard.replacement > Scalar(0))) {
        return -1;
      }
      pivot = guard.replacement;
      ++replaced;
    }
    pivot = sqrt(pivot);
    a(k, k) = pivot;
    for (Eigen::Index i = k + 1; i < size; ++i) {
      a(i, k) /= pivot;
    }
    for (Eigen::Index j = k + 1; j < size; ++j) {
      const Scalar factor = a(j, k);
      for (Eigen::Index i = j; i < size; ++i) {
        a(i, j) -= factor * a(i, k);
      }
    }
  }
  return replaced;
}

template <class Scalar>
void Dense<Scalar>::solve_right_transposed(const ConstBlock& factor, Block b) {
  const Eigen::Index size = factor.rows();
  if (size > detail::kSmall) {
    const Eigen::Index half = detail::split(size);
    const Eigen::Index rest = size - half;
    solve_right_transposed(factor.topLeftCorner(half, half), b.leftCols(half));
    add_product_nt(b.leftCols(half), factor.bottomLeftCorner(rest, half), Scalar(-1), b.rightCols(rest));
    solve_right_transposed(factor.bottomRightCorner(rest, rest), b.rightCols(rest));
    return;
  }
  constexpr Eigen::Index kRows =
      128;  // rows at a time: all columns of the part stay in the first-level cache
  for (Eigen::Index top = 0; top < b.rows(); top += kRows) {
    Block part = b.middleRows(top, std::min(kRows, b.rows() - top));
    for (Eigen::Index k = 0; k < size; ++k) {
      const Scalar pivot = factor(k, k);
      for (Eigen::Index i = 0; i < part.rows(); ++i) {
        part(i, k) /= pivot;
      }
      for (Eigen::Index j = k + 1; j < size; ++j) {
        const Scalar scale = factor(j, k);
        Scalar* target = &part(0, j);
        const Scalar* source = &part(0, k);
        for (Eigen::Index i = 0; i < part.rows(); ++i) {
          target[i] -= scale * source[i];
        }
      }
    }
  }
}

template <class Scalar>
void Dense<Scalar>::solve_lower(const ConstBlock& factor, Vector v) {
  const Eigen::Index size = factor.rows();
  for (Eigen::Index top = 0; top < size; top += detail::kVectorPanel) {
    const Eigen::Index width = std::min(detail::kVectorPanel, size - top);
    for (Eigen::Index k = top; k < top + width; ++k) {
      v[k] /= factor(k, k);
      const Scalar value = v[k];
      for (Eigen::Index i = k + 1; i < top + width; ++i) {
        v[i] -= value * factor(i, k);
      }
    }
    const Eigen::Index rest = size - top - width;
    if (rest > 0) {
      add_vector_product(factor.block(top + width, top, rest, width), v.segment(top, width), Scalar(-1),
                         v.tail(rest));
    }
  }
}

template <class Scalar>
void Dense<Scalar>::solve_lower_transposed(const ConstBlock& factor, Vector v) {
  const Eigen::Index size = factor.rows();
  for (Eigen::Index end = size; end > 0;) {
    const Eigen::Index width = (end - 1) % detail::kVectorPanel + 1;
    const Eigen::Index top = end - width;
    const Eigen::Index rest = size - end;
    if (rest > 0) {
      add_vector_product_t(factor.block(end, top, rest, width), v.tail(rest), Scalar(-1),
                           v.segment(top, width));
    }
    for (Eigen::Index k = end; k-- > top;) {
      Scalar sum = v[k];
      for (Eigen::Index i = k + 1; i < end; ++i) {
        sum -= factor(i, k) * v[i];
      }
      v[k] = sum / factor(k, k);
    }
    end = top;
  }
}

template <class Scalar>
void Dense<Scalar>::invert_lower(Block factor) {
  const Eigen::Index size = factor.rows();
  if (size > detail::kSmall) {
    // The lower left part of the inverse is -L22^-1 L21 L11^-1.
    const Eigen::Index half = detail::split(size);
    const Eigen::Index rest = size - half;
    invert_lower(factor.topLeftCorner(half, half));
    invert_lower(factor.bottomRightCorner(rest, rest));
    factor.topRightCorner(half, rest).setZero();
    Matrix product = Matrix::Zero(rest, half);
    add_product(factor.bottomLeftCorner(rest, half), factor.topLeftCorner(half, half), Scalar(1), product);
    factor.bottomLeftCorner(rest, half).setZero();
    add_product(factor.bottomRightCorner(rest, rest), product, Scalar(-1),
                factor.bottomLeftCorner(rest, half));
    return;
  }
  Matrix inverse = Matrix::Zero(size, size);
  for (Eigen::Index j = 0; j < size; ++j) {
    inverse(j, j) = Scalar(1) / factor(j, j);
    for (Eigen::Index k = j; k < size; ++k) {
      if (k > j) {
        inverse(k, j) /= factor(k, k);
      }
      const Scalar value = inverse(k, j);
      for (Eigen::Index i = k + 1; i < size; ++i) {
        inverse(i, j) -= factor(i, k) * value;
      }
    }
  }
  factor = inverse;
}

template <class Scalar>
void Dense<Scalar>::inverse_from_factor(const Matrix& inverse_factor, Matrix& inverse) {
  const Eigen::Index size = inverse_factor.rows();
  inverse.setZero(size, size);
  for (Eigen::Index k = 0; k < size; k += detail::kPanel) {
    const Eigen::Index width = std::min(detail::kPanel, size - k);
    add_product_tn(inverse_factor.block(k, k, size - k, width),
                   inverse_factor.block(k, 0, size - k, k + width), Scalar(1),
                   inverse.block(k, 0, width, k + width));
  }
  for (Eigen::Index j = 0; j < size; ++j) {
    for (Eigen::Index i = j + 1; i < size; ++i) {
      inverse(j, i) = inverse(i, j);
    }
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
