// SPDX-License-Identifier: Apache-2.0
/// @file
/// Cholesky factors of sparse symmetric matrices: CHOLMOD where the SuiteSparse component is linked, Eigen's
/// own method otherwise.
#pragma once

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#ifdef TRAMMEL_WITH_CHOLMOD
#include <Eigen/CholmodSupport>
#endif

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

using SparseMatrix = Eigen::SparseMatrix<double>;

/// P A P' = L L' of the lower triangle of A, P a fill-reducing ordering.
class SparseCholesky {
 public:
  /// Factorises A, stored by columns with its lower triangle; false where it is not positive definite.
  [[nodiscard]] bool compute(const SparseMatrix& A) {
    solver_.compute(A);
    return solver_.info() == Eigen::Success;
  }

  /// v <- A^-1 v.
  void solve_in_place(Eigen::VectorXd& v) const { v = solver_.solve(v).eval(); }

 private:
#ifdef TRAMMEL_WITH_CHOLMOD
  Eigen::CholmodSupernodalLLT<SparseMatrix, Eigen::Lower> solver_;
#else
  Eigen::SimplicialLLT<SparseMatrix, Eigen::Lower> solver_;
#endif
};

}  // namespace trammel::inline TRAMMEL_ABI::linalg
