// SPDX-License-Identifier: Apache-2.0
/// @file
/// Pieces of random guaranteed problems.
#pragma once

#include <Eigen/Core>

#include "trammel/core/random.hpp"

namespace trammel::test {

inline Eigen::MatrixXd random_matrix(RandomStream& random, Eigen::Index rows, Eigen::Index cols) {
  Eigen::MatrixXd matrix(rows, cols);
  for (double& entry : matrix.reshaped()) {
    entry = random.normal();
  }
  return matrix;
}

/// Rows selecting `count` coordinates from `first`, over a bound.
inline Eigen::MatrixXd block_bound(Eigen::Index p, Eigen::Index first, Eigen::Index count, double bound) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(count, p);
  rows.middleCols(first, count).diagonal().setConstant(1.0 / bound);
  return rows;
}

}  // namespace trammel::test
