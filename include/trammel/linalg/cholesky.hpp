// SPDX-License-Identifier: Apache-2.0
/// @file
/// Cholesky factorisations of dense matrices.
#pragma once

#include <Eigen/Cholesky>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// A = L L', A symmetric positive definite; info() tells whether it was.
using Cholesky = Eigen::LLT<Eigen::MatrixXd>;
/// The same without storage of its own: L overwrites the lower triangle of the matrix it is made from.
using InPlaceCholesky = Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>;
/// P A P' = L D L', A symmetric positive or negative semidefinite.
using PivotedCholesky = Eigen::LDLT<Eigen::MatrixXd>;

}  // namespace trammel::inline TRAMMEL_ABI::linalg

#ifdef TRAMMEL_COMPILED
extern template class Eigen::LLT<Eigen::MatrixXd>;
extern template class Eigen::LDLT<Eigen::MatrixXd>;
#endif
