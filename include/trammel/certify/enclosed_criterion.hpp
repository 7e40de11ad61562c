// SPDX-License-Identifier: Apache-2.0
/// @file
/// Quadratic forms of the criterion S = C'C with proved error radii.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/double_double.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// X'SX and tr X'SY for S = C'C. In double-double arithmetic a criterion with more rows than columns (many
/// outputs) is squared once, so that the cost of the rest does not depend on the number of outputs.
class EnclosedCriterion {
 public:
  /// factor: C, c x p.
  EnclosedCriterion(const Eigen::MatrixXd& factor, linalg::Precision precision)
      : precision_(precision),
        squared_(precision == linalg::Precision::kDoubleDouble && factor.rows() > factor.cols()),
        form_(factor) {
    if (squared_) {
      form_ = multiply(form_.transpose(), form_);
    }
  }

  [[nodiscard]] linalg::Precision precision() const { return precision_; }

  /// A B in this criterion's precision.
  [[nodiscard]] linalg::EnclosedMatrix multiply(const linalg::EnclosedMatrix& a,
                                                const linalg::EnclosedMatrix& b) const {
    return linalg::product(a, b, precision_);
  }

  /// X'SX, X: p x n; of which only the lower triangle is to be read.
  [[nodiscard]] linalg::EnclosedMatrix gram(const linalg::EnclosedMatrix& x) const {
    const linalg::EnclosedMatrix image = multiply(form_, x);
    return linalg::product(squared_ ? x.transpose() : image.transpose(), image, precision_,
                           linalg::ProductPart::kLower);
  }

  /// tr X'SY.
  [[nodiscard]] linalg::Enclosure trace(const linalg::EnclosedMatrix& x,
                                        const linalg::EnclosedMatrix& y) const {
    return linalg::inner_product(squared_ ? x : multiply(form_, x), multiply(form_, y));
  }

  /// tr X'SX.
  [[nodiscard]] linalg::Enclosure trace(const linalg::EnclosedMatrix& x) const {
    const linalg::EnclosedMatrix image = multiply(form_, x);
    return linalg::inner_product(squared_ ? x : image, image);
  }

 private:
  linalg::Precision precision_;
  bool squared_;
  linalg::EnclosedMatrix form_;  ///< C, or S where that is smaller
};

}  // namespace trammel::inline TRAMMEL_ABI::certify
