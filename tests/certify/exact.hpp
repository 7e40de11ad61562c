// SPDX-License-Identifier: Apache-2.0
/// @file
/// Exact arithmetic on matrices of doubles, for checking proofs.
#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <boost/multiprecision/cpp_int.hpp>

namespace trammel::exact {

using Rational = boost::multiprecision::cpp_rational;
using Integer = boost::multiprecision::cpp_int;

/// Dense matrix of rationals, row after row.
struct Matrix {
  Eigen::Index rows = 0;
  Eigen::Index cols = 0;
  std::vector<Rational> entries;

  Matrix(Eigen::Index r, Eigen::Index c) : rows(r), cols(c), entries(static_cast<std::size_t>(r * c)) {}
  explicit Matrix(const Eigen::MatrixXd& values) : Matrix(values.rows(), values.cols()) {
    for (Eigen::Index i = 0; i < rows; ++i) {
      for (Eigen::Index j = 0; j < cols; ++j) {
        (*this)(i, j) = Rational(values(i, j));
      }
    }
  }
  Rational& operator()(Eigen::Index i, Eigen::Index j) {
    return entries[static_cast<std::size_t>(i * cols + j)];
  }
  const Rational& operator()(Eigen::Index i, Eigen::Index j) const {
    return entries[static_cast<std::size_t>(i * cols + j)];
  }
};

inline Matrix operator*(const Matrix& a, const Matrix& b) {
  Matrix result(a.rows, b.cols);
  for (Eigen::Index i = 0; i < a.rows; ++i) {
    for (Eigen::Index j = 0; j < b.cols; ++j) {
      for (Eigen::Index k = 0; k < a.cols; ++k) {
        result(i, j) += a(i, k) * b(k, j);
      }
    }
  }
  return result;
}

inline Matrix operator-(const Matrix& a, const Matrix& b) {
  Matrix result(a.rows, a.cols);
  for (std::size_t i = 0; i < a.entries.size(); ++i) {
    result.entries[i] = a.entries[i] - b.entries[i];
  }
  return result;
}

inline Matrix operator+(const Matrix& a, const Matrix& b) {
  Matrix result(a.rows, a.cols);
  for (std::size_t i = 0; i < a.entries.size(); ++i) {
    result.entries[i] = a.entries[i] + b.entries[i];
  }
  return result;
}

inline Matrix operator*(const Rational& factor, const Matrix& a) {
  Matrix result = a;
  for (Rational& entry : result.entries) {
    entry *= factor;
  }
  return result;
}

inline Matrix transpose(const Matrix& a) {
  Matrix result(a.cols, a.rows);
  for (Eigen::Index i = 0; i < a.rows; ++i) {
    for (Eigen::Index j = 0; j < a.cols; ++j) {
      result(j, i) = a(i, j);
    }
  }
  return result;
}

inline Rational trace(const Matrix& a) {
  Rational result = 0;
  for (Eigen::Index i = 0; i < a.rows; ++i) {
    result += a(i, i);
  }
  return result;
}

/// Gaussian elimination; `a` symmetric. Positive definite exactly if all pivots are positive.
inline bool positive_definite(Matrix a) {
  for (Eigen::Index k = 0; k < a.rows; ++k) {
    if (a(k, k) <= 0) {
      return false;
    }
    for (Eigen::Index i = k + 1; i < a.rows; ++i) {
      const Rational factor = a(i, k) / a(k, k);
      for (Eigen::Index j = k + 1; j < a.cols; ++j) {
        a(i, j) -= factor * a(k, j);
      }
    }
  }
  return true;
}

/// A^-1 B for a positive definite A.
inline Matrix solve(Matrix a, Matrix b) {
  const Eigen::Index n = a.rows;
  for (Eigen::Index k = 0; k < n; ++k) {
    for (Eigen::Index i = 0; i < n; ++i) {
      if (i == k) {
        continue;
      }
      const Rational factor = a(i, k) / a(k, k);
      for (Eigen::Index j = k; j < n; ++j) {
        a(i, j) -= factor * a(k, j);
      }
      for (Eigen::Index j = 0; j < b.cols; ++j) {
        b(i, j) -= factor * b(k, j);
      }
    }
  }
  for (Eigen::Index k = 0; k < n; ++k) {
    for (Eigen::Index j = 0; j < b.cols; ++j) {
      b(k, j) /= a(k, k);
    }
  }
  return b;
}

/// The same test as positive_definite() by fraction-free elimination (Bareiss 1968): the pivots are the
/// leading minors. Fast enough for thousands of matrices.
inline bool positive_definite(const Eigen::MatrixXd& a) {
  const Eigen::Index n = a.rows();
  const int exponent = std::ilogb(a.cwiseAbs().maxCoeff());
  int lowest = exponent;
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    if (a.data()[i] != 0.0) {
      lowest = std::min(lowest, std::ilogb(a.data()[i]) - 52);
    }
  }
  std::vector<Integer> m(static_cast<std::size_t>(n * n));
  const auto at = [&m, n](Eigen::Index i, Eigen::Index j) -> Integer& {
    return m[static_cast<std::size_t>(i * n + j)];
  };
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      int shift = 0;
      const double mantissa = std::frexp(a(i, j), &shift);
      Integer value = static_cast<long long>(std::ldexp(mantissa, 53));
      const int power = shift - 53 - lowest;
      at(i, j) = power >= 0 ? Integer(value << static_cast<unsigned>(power))
                            : Integer(value / (Integer(1) << static_cast<unsigned>(-power)));
    }
  }
  Integer previous = 1;
  for (Eigen::Index k = 0; k < n; ++k) {
    if (at(k, k) <= 0) {
      return false;
    }
    for (Eigen::Index i = k + 1; i < n; ++i) {
      for (Eigen::Index j = k + 1; j < n; ++j) {
        at(i, j) = (at(i, j) * at(k, k) - at(i, k) * at(k, j)) / previous;
      }
    }
    previous = at(k, k);
  }
  return true;
}

}  // namespace trammel::exact
