// SPDX-License-Identifier: Apache-2.0
/// @file
/// Eigenvalues and eigenvectors of dense symmetric matrices.
#pragma once

#include <Eigen/Eigenvalues>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// A = U diag(w) U', w ascending.
using SymmetricEigen = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;
/// The same for 3 x 3, without memory on the heap.
using SymmetricEigen3 = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>;

/// Eigenvalues and eigenvectors of many symmetric matrices of one size: as SymmetricEigen, but takes memory
/// only at construction. Tridiagonal form by Householder reflections, then the implicit QL method.
class RepeatedSymmetricEigen {
 public:
  explicit RepeatedSymmetricEigen(Eigen::Index size)
      : tridiagonal_(size),
        basis_(size, size),
        vectors_(size, size),
        diagonal_(size),
        off_diagonal_(size - 1),
        reflections_(size - 1),
        workspace_(size) {}

  /// Of the lower triangle of `matrix`, n x n with n >= 1.
  void compute(const Eigen::MatrixXd& matrix) {
    basis_ = matrix;
    // Eigen's class around this function takes memory for its basis every time.
    Eigen::internal::tridiagonalization_inplace(basis_, reflections_);
    diagonal_ = basis_.diagonal();
    off_diagonal_ = basis_.diagonal<-1>();
    Eigen::HouseholderSequence<Eigen::MatrixXd, Eigen::VectorXd>(basis_, reflections_)
        .setLength(basis_.rows() - 1)
        .setShift(1)
        .evalTo(basis_, workspace_);
    tridiagonal_.computeFromTridiagonal(diagonal_, off_diagonal_, Eigen::ComputeEigenvectors);
    vectors_.noalias() = basis_ * tridiagonal_.eigenvectors();
  }

  [[nodiscard]] const Eigen::VectorXd& eigenvalues() const { return tridiagonal_.eigenvalues(); }  ///< rising
  [[nodiscard]] const Eigen::MatrixXd& eigenvectors() const { return vectors_; }  ///< columns, orthonormal

 private:
  SymmetricEigen tridiagonal_;
  Eigen::MatrixXd basis_, vectors_;
  Eigen::VectorXd diagonal_, off_diagonal_, reflections_, workspace_;
};

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifdef TRAMMEL_COMPILED
extern template class Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;
#endif
