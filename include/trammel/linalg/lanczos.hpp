// SPDX-License-Identifier: Apache-2.0
/// @file
/// Smallest eigenvalue of a symmetric operator from below.
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

#include "trammel/core/random.hpp"
#include "trammel/linalg/dense_kernels.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// How far the iteration goes.
struct LanczosSettings {
  double relative_accuracy = 0.02;  ///< of the eigenvalue
  double enough = 0.0;              ///< stop as soon as the eigenvalue is seen to lie above this
  int max_steps = 60;
};

/// Estimate theta - residual of the smallest eigenvalue of the n x n operator `apply(in, out)`: a lower bound
/// of the eigenvalue the iteration found (Toh 2002, "A note on the calculation of step-lengths in
/// interior-point methods for semidefinite programming"). Full reorthogonalisation; the start is a fixed
/// pseudo-random vector.
template <class Apply>
[[nodiscard]] double lanczos_smallest(Eigen::Index size, Apply&& apply, const LanczosSettings& settings) {
  constexpr int kCheckEvery =
      4;  // an eigenvalue problem of the small matrix costs about as much as a product
  constexpr double kBreakdown = 1e-14;
  const auto steps = static_cast<int>(std::min<Eigen::Index>(settings.max_steps, size));
  Eigen::MatrixXd basis(size, steps);
  Eigen::VectorXd alpha(steps);
  Eigen::VectorXd beta(steps);
  Eigen::VectorXd next(size);
  RandomStream random(0x7472616dU);
  for (Eigen::Index i = 0; i < size; ++i) {
    next[i] = random.uniform() + 0.5;
  }
  basis.col(0) = next / next.norm();
  double bound = 0.0;
  SymmetricEigen eigen;
  for (int k = 0; k < steps; ++k) {
    apply(basis.col(k), next);
    alpha[k] = basis.col(k).dot(next);
    for (int pass = 0; pass < 2; ++pass) {
      Eigen::VectorXd overlap = Eigen::VectorXd::Zero(k + 1);
      Dense<double>::add_vector_product_t(basis.leftCols(k + 1), next, 1.0, overlap);
      Dense<double>::add_vector_product(basis.leftCols(k + 1), overlap, -1.0, next);
    }
    beta[k] = next.norm();
    const bool last = k + 1 == steps || !(beta[k] > kBreakdown * (std::abs(alpha[k]) + 1.0));
    if (last || (k + 1) % kCheckEvery == 0) {
      eigen.computeFromTridiagonal(alpha.head(k + 1), beta.head(k));
      const double theta = eigen.eigenvalues()[0];
      const double residual = std::abs(beta[k] * eigen.eigenvectors()(k, 0));
      bound = theta - residual;
      if (last || residual <= settings.relative_accuracy * std::abs(theta) || bound > settings.enough) {
        break;
      }
    }
    basis.col(k + 1) = next / beta[k];
  }
  return bound;
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
