// SPDX-License-Identifier: Apache-2.0
/// @file
/// LU factorisation of dense square matrices.
#pragma once

#include <Eigen/LU>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// P A = L U with row pivoting, A invertible.
using Lu = Eigen::PartialPivLU<Eigen::MatrixXd>;
/// The same for complex matrices (frequency responses).
using ComplexLu = Eigen::PartialPivLU<Eigen::MatrixXcd>;
/// P A = L U of a 3 x 3 matrix, without allocation.
using Lu3 = Eigen::PartialPivLU<Eigen::Matrix3d>;

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifdef TRAMMEL_COMPILED
extern template class Eigen::PartialPivLU<Eigen::MatrixXd>;
extern template class Eigen::PartialPivLU<Eigen::MatrixXcd>;
#endif
