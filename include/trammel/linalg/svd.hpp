// SPDX-License-Identifier: Apache-2.0
/// @file
/// Singular values of dense matrices (one-sided Jacobi: slow for large matrices, small ones to full relative
/// accuracy).
#pragma once

#include <Eigen/SVD>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// A = U diag(s) V', s descending.
using Svd = Eigen::JacobiSVD<Eigen::MatrixXd>;

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifdef TRAMMEL_COMPILED
extern template class Eigen::JacobiSVD<Eigen::MatrixXd>;
#endif
