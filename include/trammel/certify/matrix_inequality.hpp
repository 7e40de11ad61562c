// SPDX-License-Identifier: Apache-2.0
/// @file
/// The matrix inequality of the upper bound, enclosed and proved in one basis.
#pragma once

#include <utility>

#include <Eigen/Core>

#include "trammel/certify/verified_cholesky.hpp"
#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// W'(H(lambda) - E'SE)W positive definite, in a square basis W.
///
/// | symbol | argument | shape | meaning                                                          |
/// |--------|----------|-------|------------------------------------------------------------------|
/// | X      | form     | p x p | W'(H(lambda) - E'SE)W                                            |
/// | (A W)' | bounded  | p x q | transposed stacked factors of the bounds times W                 |
/// |        | error    | p     | Euclidean norms of the errors of its rows, beside u of each norm |
/// | lambda | rows     | q     | multiplier of each row of A                                      |
///
/// Definiteness is proved by positive_definite(). If it holds for one W it holds for H(lambda) - E'SE, and W
/// is invertible.
class MatrixInequality {
 public:
  MatrixInequality(UncertainForm form, Eigen::MatrixXd bounded, Eigen::VectorXd error, Eigen::VectorXd rows)
      : form_(std::move(form)),
        bounded_(std::move(bounded)),
        error_(std::move(error)),
        rows_(std::move(rows)) {}

  /// True only if it is proved as it stands.
  [[nodiscard]] bool holds() const { return positive_definite(form_); }

  /// The inequality with multipliers lambda (1 + t) + t step; those of the first `growing` rows grow by
  /// `step`, all by the factor.
  class Growth {
   public:
    Growth(const MatrixInequality& inequality, double step, Eigen::Index growing);

    /// True only if it is proved.
    [[nodiscard]] bool holds_at(double t) const;

    /// Smallest t among the powers of two from 2^-40 to 2^24 found by bisection (to a sixteenth of it from
    /// 2^-36 on) for which it is proved; NaN if for none.
    [[nodiscard]] double find_inflation() const;

    /// False if the inequality fails at t by itself, so that neither more digits nor another basis help; true
    /// if that is open.
    [[nodiscard]] bool may_hold_at(double t) const;

   private:
    const MatrixInequality& of_;
    UncertainForm growth_;  ///< W'(H(lambda) + step sum H_l)W
  };

 private:
  UncertainForm form_;
  Eigen::MatrixXd bounded_;
  Eigen::VectorXd error_;
  Eigen::VectorXd rows_;
};

/// (A W)' diag(lambda) A W, lower triangle, in plain arithmetic; arguments as above. terms: number of
/// products that will be added to each entry in all.
[[nodiscard]] UncertainForm weighted_gram(const Eigen::MatrixXd& bounded, const Eigen::VectorXd& error,
                                          const Eigen::VectorXd& rows, Eigen::Index terms);

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/matrix_inequality_impl.hpp"
#endif
