// SPDX-License-Identifier: Apache-2.0
/// @file
/// Eigenvalues of dense matrices without symmetry.
#pragma once

#include <Eigen/Eigenvalues>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// Complex eigenvalues (and vectors) of a real square matrix by the QR algorithm.
using GeneralEigen = Eigen::EigenSolver<Eigen::MatrixXd>;

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifdef TRAMMEL_COMPILED
extern template class Eigen::EigenSolver<Eigen::MatrixXd>;
#endif
