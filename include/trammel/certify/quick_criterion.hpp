// SPDX-License-Identifier: Apache-2.0
/// @file
/// The criterion in plain arithmetic, with errors of whole rows.
#pragma once

#include <Eigen/Core>

#include "trammel/certify/verified_cholesky.hpp"
#include "trammel/core/config.hpp"
#include "trammel/linalg/double_double.hpp"
#include "trammel/linalg/sparse_columns.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// X S X' and tr X S X' for S = C'C; rows of X are transposed parameters. The error of a row x is measured by
/// sum |x_j| |C e_j|, which bounds |C x|: `errors` below.
class QuickCriterion {
 public:
  /// factor: C, c x p.
  explicit QuickCriterion(const Eigen::MatrixXd& factor);

  /// |C e_j|, rounded up.
  [[nodiscard]] const Eigen::VectorXd& weights() const { return weights_; }

  /// sum |x_j| |C e_j| of each row, rounded up.
  [[nodiscard]] Eigen::VectorXd sizes(const Eigen::MatrixXd& x) const;

  /// tr X S X' for every matrix whose rows are as near to those of X as `errors` says.
  [[nodiscard]] linalg::Enclosure squared_norm(const Eigen::MatrixXd& x, const Eigen::VectorXd& errors) const;

  /// form - X S X'; `terms` are the products added to each entry of the form in all.
  void subtract_gram(const Eigen::MatrixXd& x, const Eigen::VectorXd& errors, Eigen::Index terms,
                     UncertainForm& form) const;

  /// Products in an entry of X S X'.
  [[nodiscard]] Eigen::Index terms() const { return factor_transposed_.cols(); }

 private:
  linalg::SparseColumns factor_transposed_;  ///< C'
  double relative_;                          ///< error of X C', as a share of the sizes of its rows
  Eigen::VectorXd weights_;
};

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/quick_criterion_impl.hpp"
#endif
