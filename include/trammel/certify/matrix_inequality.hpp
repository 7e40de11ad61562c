// SPDX-License-Identifier: Apache-2.0
/// @file
/// The matrix inequality of the upper bound, enclosed and proved in one basis.
#pragma once

#include <Eigen/Core>

#include "trammel/certify/enclosed_criterion.hpp"
#include "trammel/core/config.hpp"
#include "trammel/linalg/double_double.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// W'(H(lambda) - E'SE)W positive definite, in a square basis W.
///
/// | symbol   | argument   | shape  | meaning                                             |
/// |----------|------------|--------|-----------------------------------------------------|
/// | (A W)'   | bounded    | p x q  | transposed stacked factors of the bounds times W    |
/// | lambda   | rows       | q      | multiplier of each row of A                         |
/// | (E W)'   | bias       | p x p  | transposed (K J - I) W                              |
/// | (C E W)' | bias_image | p x c  | criterion.image(bias)                               |
///
/// The products are enclosed in the criterion's precision and the definiteness proved by
/// positive_definite(). If it holds for one W it holds for H(lambda) - E'SE, and W is invertible.
class MatrixInequality {
 public:
  MatrixInequality(const linalg::EnclosedMatrix& bounded, const Eigen::VectorXd& rows,
                   const linalg::EnclosedMatrix& bias, const linalg::EnclosedMatrix& bias_image,
                   const EnclosedCriterion& criterion);

  /// True only if it is proved as it stands.
  [[nodiscard]] bool holds() const;

  /// The inequality with multipliers lambda (1 + t) + t step; those of the first `growing` rows grow by
  /// `step`, all by the factor.
  class Growth {
   public:
    Growth(const MatrixInequality& inequality, double step, Eigen::Index growing);

    /// True only if it is proved.
    [[nodiscard]] bool holds_at(double t) const;

    /// Smallest t among the powers of two from 2^-50 to 2^24 found by bisection (to a sixteenth of it from
    /// 2^-36 on) for which it is proved; NaN if not for the largest.
    [[nodiscard]] double find_inflation() const;

    /// False if the inequality fails at t by itself, so that neither more digits nor another basis help; true
    /// if that is open.
    [[nodiscard]] bool may_hold_at(double t) const;

   private:
    const MatrixInequality& of_;
    Eigen::MatrixXd growth_;
    Eigen::MatrixXd radius_;
  };

 private:
  const linalg::EnclosedMatrix& bounded_;
  linalg::EnclosedMatrix bound_form_;  ///< W'H(lambda)W
  Eigen::MatrixXd base_;               ///< midpoint of W'(H(lambda) - E'SE)W
  Eigen::MatrixXd base_radius_;
};

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/matrix_inequality_impl.hpp"
#endif
