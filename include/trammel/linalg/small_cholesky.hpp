// SPDX-License-Identifier: Apache-2.0
/// @file
/// Cholesky factorisation of 3 x 3 matrices, without memory on the heap.
#pragma once

#include <Eigen/Cholesky>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// A = L L', A symmetric positive definite of three rows; info() tells whether it was.
using Cholesky3 = Eigen::LLT<Eigen::Matrix3d>;

}  // namespace trammel::inline TRAMMEL_ABI::linalg
