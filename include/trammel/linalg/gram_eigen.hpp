// SPDX-License-Identifier: Apache-2.0
/// @file
/// Singular values and right singular vectors of matrices whose columns are of very different size.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// B U = Y, the columns of Y orthogonal with norms b that rise, U orthogonal: the singular value
/// decomposition without the division by b.
///
/// Method: eigenvectors of B'B, which are good for the large b only (b^2 gets an error of eps b_max^2). The
/// columns of Y whose b is below kTrusted of the largest are made orthogonal to the others and decomposed
/// by themselves, and so on, so that a column's error is eps b_max as it is in a singular value decomposition
/// of B, at half the cost. Up to RepeatedSymmetricEigen::kLargest columns the first step is the only one (the
/// QL method keeps what is graded), and no memory is taken. The result is the same to the last bit for any
/// number of threads. Cost: five to eight n x n products.
class GramEigen {
 public:
  GramEigen(Eigen::Index rows, Eigen::Index columns)
      : eigen_(columns), square_(columns, columns), vectors_(columns, columns), images_(rows, columns) {}

  void compute(const Eigen::MatrixXd& B, unsigned threads = 1);

  [[nodiscard]] const Eigen::VectorXd& norms() const { return norms_; }      ///< b
  [[nodiscard]] const Eigen::MatrixXd& vectors() const { return vectors_; }  ///< U
  [[nodiscard]] const Eigen::MatrixXd& images() const { return images_; }    ///< Y

 private:
  void refine(Eigen::Index small, unsigned threads);

  RepeatedSymmetricEigen eigen_;
  Eigen::MatrixXd square_, vectors_, images_;
  Eigen::VectorXd norms_;
};

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifndef TRAMMEL_COMPILED
#include "trammel/linalg/gram_eigen_impl.hpp"
#endif
