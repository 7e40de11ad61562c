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

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifdef TRAMMEL_COMPILED
extern template class Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;
#endif
