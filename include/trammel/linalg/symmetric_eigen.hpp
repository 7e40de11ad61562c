// SPDX-License-Identifier: Apache-2.0
/// @file
/// Eigenvalues and eigenvectors of dense symmetric matrices.
#pragma once

#include <algorithm>
#include <optional>

#include <Eigen/Eigenvalues>

#include "trammel/core/config.hpp"
#include "trammel/linalg/tridiagonal_eigen.hpp"
#include "trammel/linalg/tridiagonal_form.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// A = U diag(w) U', w ascending.
using SymmetricEigen = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;
/// The same for 3 x 3, without memory on the heap.
using SymmetricEigen3 = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>;

/// Eigenvalues and eigenvectors of many symmetric matrices of one size. Tridiagonal form by Householder
/// reflections, then the implicit QL method, which takes memory only at construction; above kLargest by
/// blocked reflections and divide and conquer (TridiagonalForm, TridiagonalEigen): about four products
/// instead of ten at n = 300.
class RepeatedSymmetricEigen {
 public:
  /// The largest size left to the QL method.
  static constexpr Eigen::Index kLargest = 128;

  explicit RepeatedSymmetricEigen(Eigen::Index size) {
    if (size <= kLargest) {
      small_.emplace(size);
    } else {
      large_.emplace(size);
    }
  }

  /// Of the lower triangle of `matrix`, n x n with n >= 1. The same bits for any number of threads.
  void compute(const Eigen::MatrixXd& matrix, unsigned threads = 1) {
    if (small_) {
      small_->compute(matrix);
    } else {
      large_->form.compute(matrix, threads);
      large_->eigen.compute(large_->form.diagonal(), large_->form.off_diagonal(), threads);
      large_->form.apply_basis(large_->eigen.eigenvectors(), threads);
    }
  }

  [[nodiscard]] const Eigen::VectorXd& eigenvalues() const {  ///< rising
    return small_ ? small_->values : large_->eigen.eigenvalues();
  }
  [[nodiscard]] const Eigen::MatrixXd& eigenvectors() const {  ///< columns, orthonormal
    return small_ ? small_->vectors : large_->eigen.eigenvectors();
  }

 private:
  struct Small {
    explicit Small(Eigen::Index size)
        : tridiagonal(size),
          basis(size, size),
          vectors(size, size),
          values(size),
          diagonal(size),
          off_diagonal(size - 1),
          reflections(size - 1),
          workspace(size) {}

    void compute(const Eigen::MatrixXd& matrix) {
      // Eigen takes off-diagonal entries for zero by a rule that supposes entries of size one.
      double scale = 0.0;
      for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
        scale = std::max(scale, matrix.col(j).tail(matrix.rows() - j).cwiseAbs().maxCoeff());
      }
      scale = scale > 0.0 ? scale : 1.0;
      basis = matrix / scale;
      // Eigen's class around this function takes memory for its basis every time.
      Eigen::internal::tridiagonalization_inplace(basis, reflections);
      diagonal = basis.diagonal();
      off_diagonal = basis.diagonal<-1>();
      Eigen::HouseholderSequence<Eigen::MatrixXd, Eigen::VectorXd>(basis, reflections)
          .setLength(basis.rows() - 1)
          .setShift(1)
          .evalTo(basis, workspace);
      tridiagonal.computeFromTridiagonal(diagonal, off_diagonal, Eigen::ComputeEigenvectors);
      vectors.noalias() = basis * tridiagonal.eigenvectors();
      values = scale * tridiagonal.eigenvalues();
    }

    SymmetricEigen tridiagonal;
    Eigen::MatrixXd basis, vectors;
    Eigen::VectorXd values, diagonal, off_diagonal, reflections, workspace;
  };
  struct Large {
    explicit Large(Eigen::Index size) : form(size), eigen(size) {}

    TridiagonalForm form;
    TridiagonalEigen eigen;
  };

  std::optional<Small> small_;
  std::optional<Large> large_;
};

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifdef TRAMMEL_COMPILED
extern template class Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;
#endif
