// SPDX-License-Identifier: Apache-2.0
/// @file
/// Quadratic forms of the criterion S = C'C with proved error radii.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/double_double.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// X S X' and tr X S Y' for S = C'C; rows of X and Y are transposed parameters. Beyond plain arithmetic a
/// criterion with more rows than columns (many outputs) is squared once, so that the cost of the rest does
/// not depend on the number of outputs.
class EnclosedCriterion {
 public:
  /// factor: C, c x p.
  EnclosedCriterion(const Eigen::MatrixXd& factor, linalg::Precision precision)
      : precision_(precision),
        squared_(precision != linalg::Precision::kDouble && factor.rows() > factor.cols()),
        form_(factor.transpose()) {
    if (squared_) {
      form_ = multiply(form_, linalg::EnclosedMatrix(factor));
    }
  }

  [[nodiscard]] linalg::Precision precision() const { return precision_; }

  /// A B in this criterion's precision.
  [[nodiscard]] linalg::EnclosedMatrix multiply(const linalg::EnclosedMatrix& a,
                                                const linalg::EnclosedMatrix& b,
                                                linalg::ProductPart part = linalg::ProductPart::kFull) const {
    return linalg::product(a, b, precision_, part);
  }

  /// X C', or X S where that is smaller: what the criterion makes of X.
  [[nodiscard]] linalg::EnclosedMatrix image(const linalg::EnclosedMatrix& x) const {
    return multiply(x, form_);
  }

  /// X S X', X: n x p, of which only the lower triangle is to be read; image_x: image(x).
  [[nodiscard]] linalg::EnclosedMatrix gram(const linalg::EnclosedMatrix& x,
                                            const linalg::EnclosedMatrix& image_x) const {
    return multiply(image_x, squared_ ? x.transpose() : image_x.transpose(), linalg::ProductPart::kLower);
  }

  /// tr X S Y' from the images.
  [[nodiscard]] linalg::Enclosure trace(const linalg::EnclosedMatrix& x,
                                        const linalg::EnclosedMatrix& image_x,
                                        const linalg::EnclosedMatrix& image_y) const {
    return linalg::inner_product(squared_ ? x : image_x, image_y);
  }

  /// tr X S X'.
  [[nodiscard]] linalg::Enclosure trace(const linalg::EnclosedMatrix& x) const {
    const linalg::EnclosedMatrix image_x = image(x);
    return trace(x, image_x, image_x);
  }

 private:
  linalg::Precision precision_;
  bool squared_;
  linalg::EnclosedMatrix form_;  ///< C', or S where that is smaller
};

}  // namespace trammel::inline TRAMMEL_ABI::certify
