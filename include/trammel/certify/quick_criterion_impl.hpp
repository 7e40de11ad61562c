// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of quick_criterion.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "trammel/certify/quick_criterion.hpp"
#include "trammel/linalg/error_norms.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

TRAMMEL_INLINE QuickCriterion::QuickCriterion(const Eigen::MatrixXd& factor) {
  const linalg::SparseColumns columns(factor);
  factor_transposed_ = columns.transpose();
  weights_ = linalg::room(factor.rows()) *
             (columns.norms(Eigen::VectorXd::Ones(factor.rows())).array() + linalg::kSmallestNorm);
  relative_ = linalg::entries_in_range(factor)
                  ? 2.0 * (static_cast<double>(factor_transposed_.longest()) + 8.0) * linalg::kUnitRoundoff
                  : std::numeric_limits<double>::infinity();
}

TRAMMEL_INLINE Eigen::VectorXd QuickCriterion::sizes(const Eigen::MatrixXd& x) const {
  return linalg::room(x.cols()) * linalg::sizes_times(x, weights_);
}

TRAMMEL_INLINE linalg::Enclosure QuickCriterion::squared_norm(const Eigen::MatrixXd& x,
                                                              const Eigen::VectorXd& errors) const {
  const Eigen::MatrixXd image = linalg::sparse_product(x, factor_transposed_);
  const Eigen::VectorXd squares = linalg::row_products(image, image);
  const Eigen::VectorXd error = relative_ * sizes(x) + errors;
  const double sums = 2.0 * static_cast<double>(image.cols() + x.rows() + 8) * linalg::kUnitRoundoff;
  linalg::Enclosure result;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    result.hi += squares(i);
    result.radius += sums * squares(i) + (2.0 * (1.0 + sums) * std::sqrt(squares(i)) + error(i)) * error(i);
  }
  result.radius = linalg::room(x.rows()) * result.radius + linalg::kSmallestNorm;
  return result;
}

TRAMMEL_INLINE void QuickCriterion::subtract_gram(const Eigen::MatrixXd& x, const Eigen::VectorXd& errors,
                                                  Eigen::Index terms, UncertainForm& form) const {
  const Eigen::MatrixXd image = linalg::sparse_product(x, factor_transposed_);
  form.middle.selfadjointView<Eigen::Lower>().rankUpdate(image, -1.0);
  const double room = linalg::room(image.cols());
  const Eigen::VectorXd error = room * ((relative_ * sizes(x) + errors).array() + linalg::kSmallestNorm);
  const Eigen::VectorXd size = room * (linalg::row_norms(image) + error);
  const Eigen::Index columns = form.left.cols();
  form.left.conservativeResize(x.rows(), columns + 1);
  form.right.conservativeResize(x.rows(), columns + 1);
  form.left.col(columns) = size;
  form.right.col(columns) = room * (static_cast<double>(terms + 8) * linalg::kUnitRoundoff * size + error);
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
