// SPDX-License-Identifier: Apache-2.0
/// @file
/// Quadratic forms of the criterion S = C'C with proved error radii.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/double_double.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// X S X' for S = C'C; rows of X are transposed parameters. A criterion with more rows than columns (many
/// outputs) is squared once, so that the cost of the rest does not depend on the number of outputs.
class EnclosedCriterion {
 public:
  /// factor: C, c x p.
  explicit EnclosedCriterion(const Eigen::MatrixXd& factor)
      : squared_(factor.rows() > factor.cols()), form_(factor.transpose()) {
    if (squared_) {
      form_ = linalg::product(form_, linalg::EnclosedMatrix(factor));
    }
  }

  /// X S X', X: n x p, of which only the lower triangle is to be read.
  [[nodiscard]] linalg::EnclosedMatrix gram(const linalg::EnclosedMatrix& x) const {
    const linalg::EnclosedMatrix image = linalg::product(x, form_);
    return linalg::product(image, squared_ ? x.transpose() : image.transpose(), linalg::ProductPart::kLower);
  }

 private:
  bool squared_;
  linalg::EnclosedMatrix form_;  ///< C', or S where that is smaller
};

}  // namespace trammel::inline TRAMMEL_ABI::certify
