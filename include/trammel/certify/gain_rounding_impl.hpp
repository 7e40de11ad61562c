// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of gain_rounding.hpp.
#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "trammel/certify/gain_rounding.hpp"
#include "trammel/core/error.hpp"
#include "trammel/linalg/dense_kernels.hpp"
#include "trammel/linalg/extended_double.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace gain_rounding_detail {

using Number = linalg::ExtendedDouble;
using Dense = linalg::Dense<Number>;
using Matrix = linalg::DenseMatrix<Number>;
using Vector = linalg::DenseVector<Number>;

inline Matrix product(const Matrix& a, const Matrix& b) {
  Matrix c = Matrix::Zero(a.rows(), b.cols());
  Dense::add_product(a, b, Number(1), c);
  return c;
}

/// K = (L N)(L N)' with N'N = (I + (F L)'(F L))^-1; empty on failure.
inline Matrix optimal_gain(const Matrix& prior_factor, const Matrix& seen) {
  Matrix posterior = Matrix::Identity(seen.cols(), seen.cols());
  Dense::add_product_tn(seen, seen, Number(1), posterior);
  if (Dense::cholesky(posterior) != 0) {
    return {};
  }
  Matrix root = prior_factor;
  Dense::solve_right_transposed(posterior, root);
  Matrix gain = Matrix::Zero(root.rows(), root.rows());
  Dense::add_product_nt(root, root, Number(1), gain);
  return gain;
}

/// Rows g_j of G in the order a = 0, 1, ... as combinations of orthonormal vectors q_b, b <= a.
struct OrderedFactor {
  std::vector<Eigen::Index> order;  ///< row of G at place a
  Matrix triangle;                  ///< upper: column a holds <g_order[a], q_b>
};

/// Modified Gram-Schmidt; next comes the row whose rest, times its weight, is smallest.
inline OrderedFactor factorise(Matrix rows_transposed, const Eigen::VectorXd& weight) {
  const Eigen::Index p = rows_transposed.cols();
  OrderedFactor result;
  Matrix coefficients = Matrix::Zero(p, p);  // column j: those of g_j
  std::vector<char> placed(static_cast<std::size_t>(p), 0);
  for (Eigen::Index place = 0; place < p; ++place) {
    Eigen::Index next = -1;
    double smallest = std::numeric_limits<double>::infinity();
    for (Eigen::Index j = 0; j < p; ++j) {
      const double size = placed[static_cast<std::size_t>(j)] != 0
                              ? std::numeric_limits<double>::infinity()
                              : weight(j) * rows_transposed.col(j).template cast<double>().norm();
      if (size < smallest || (next < 0 && placed[static_cast<std::size_t>(j)] == 0)) {
        smallest = size;
        next = j;
      }
    }
    placed[static_cast<std::size_t>(next)] = 1;
    result.order.push_back(next);
    const Vector rest = rows_transposed.col(next);
    const Number length = sqrt(rest.dot(rest));
    if (!(length > Number(0))) {
      continue;
    }
    const Vector direction = rest / length;
    coefficients(place, next) = length;
    for (Eigen::Index j = 0; j < p; ++j) {
      if (placed[static_cast<std::size_t>(j)] == 0) {
        const Number share = direction.dot(rows_transposed.col(j));
        coefficients(place, j) = share;
        rows_transposed.col(j) -= share * direction;
      }
    }
  }
  result.triangle.resize(p, p);
  for (Eigen::Index a = 0; a < p; ++a) {
    result.triangle.col(a) = coefficients.col(result.order[static_cast<std::size_t>(a)]);
  }
  return result;
}

}  // namespace gain_rounding_detail

TRAMMEL_INLINE Eigen::MatrixXd round_gain(const GuaranteedProblem& problem,
                                          const Eigen::MatrixXd& prior_factor) {
  using namespace gain_rounding_detail;
  const Eigen::Index p = problem.parameters();
  require(prior_factor.rows() == p, "prior_factor", std::to_string(prior_factor.rows()) + " rows",
          std::to_string(p));
  if (prior_factor.cols() != p) {
    return {};
  }
  const Matrix factor = problem.information_factor.cast<Number>();
  const Matrix prior = prior_factor.cast<Number>();
  const Matrix seen = product(factor, prior);
  const Matrix gain = optimal_gain(prior, seen);
  Eigen::MatrixXd rounded = gain.cast<double>();
  if (gain.size() == 0 || !rounded.allFinite()) {
    return {};
  }
  Matrix image = Matrix::Zero(p, p);  // (J L)'
  Dense::add_product_tn(seen, factor, Number(1), image);
  const Eigen::VectorXd units = rounded.cwiseAbs().colwise().maxCoeff();
  const OrderedFactor ordered = factorise(std::move(image), units);
  Vector error(p);
  for (Eigen::Index row = 0; row < p; ++row) {
    error.setZero();  // of the row of K J L so far, in terms of the orthonormal vectors
    for (Eigen::Index a = p - 1; a >= 0; --a) {
      const Eigen::Index column = ordered.order[static_cast<std::size_t>(a)];
      const Number pivot = ordered.triangle(a, a);
      const Number wanted =
          pivot > Number(0) ? gain(row, column) - error(a) / pivot : Number(gain(row, column));
      rounded(row, column) = static_cast<double>(wanted);
      const Number moved = Number(rounded(row, column)) - gain(row, column);
      for (Eigen::Index b = 0; b <= a; ++b) {
        error(b) += moved * ordered.triangle(b, a);
      }
    }
  }
  return rounded.allFinite() ? rounded : Eigen::MatrixXd();
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
