// SPDX-License-Identifier: Apache-2.0
/// @file
/// Quadratic forms of the criterion S = C'C with proved error radii.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/double_double.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// X'SX and tr X'SY for S = C'C. A criterion with more rows than columns (many outputs) is squared once, in
/// double-double arithmetic, so that the cost of the rest does not depend on the number of outputs.
class EnclosedCriterion {
 public:
  /// C: c x p.
  explicit EnclosedCriterion(const Eigen::MatrixXd& factor) : form_(factor) {
    squared_ = factor.rows() > factor.cols();
    if (squared_) {
      form_ = linalg::product(form_.transpose(), form_);
    }
  }

  /// X'SX, X: p x n; only the lower triangle is computed.
  [[nodiscard]] linalg::EnclosedMatrix gram(const linalg::EnclosedMatrix& x) const {
    const linalg::EnclosedMatrix image = linalg::product(form_, x);
    return linalg::product(squared_ ? x.transpose() : image.transpose(), image, linalg::ProductPart::kLower);
  }

  /// tr X'SY.
  [[nodiscard]] linalg::Enclosure trace(const linalg::EnclosedMatrix& x,
                                        const linalg::EnclosedMatrix& y) const {
    return linalg::inner_product(squared_ ? x : linalg::product(form_, x), linalg::product(form_, y));
  }

  /// tr X'SX.
  [[nodiscard]] linalg::Enclosure trace(const linalg::EnclosedMatrix& x) const {
    const linalg::EnclosedMatrix image = linalg::product(form_, x);
    return linalg::inner_product(squared_ ? x : image, image);
  }

 private:
  bool squared_ = false;
  linalg::EnclosedMatrix form_;  ///< C, or S where that is smaller
};

}  // namespace trammel::inline TRAMMEL_ABI::certify
