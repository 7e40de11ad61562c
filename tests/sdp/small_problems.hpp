// SPDX-License-Identifier: Apache-2.0
/// @file
/// Small semidefinite programs for the tests.
#pragma once

#include <Eigen/Core>

#include "trammel/core/random.hpp"
#include "trammel/sdp/problem.hpp"

namespace trammel::test {

inline void add_symmetric(sdp::Problem& problem, int variable, int block, const Eigen::MatrixXd& matrix) {
  for (int c = 0; c < matrix.cols(); ++c) {
    for (int r = 0; r <= c; ++r) {
      if (matrix(r, c) != 0.0) {
        problem.entries.push_back({variable, block, r, c, matrix(r, c)});
      }
    }
  }
}

inline Eigen::MatrixXd random_symmetric(int size, RandomStream& random) {
  Eigen::MatrixXd matrix(size, size);
  for (int c = 0; c < size; ++c) {
    for (int r = 0; r <= c; ++r) {
      matrix(r, c) = matrix(c, r) = random.normal();
    }
  }
  return matrix;
}

/// Lovasz' number of the cycle with `size` vertices: max <J, Y>, tr Y = 1, Y_ij = 0 on edges. For odd sizes
/// it is n cos(pi/n) / (1 + cos(pi/n)) (Lovasz 1979, corollary 5).
inline sdp::Problem theta_of_cycle(int size) {
  sdp::Problem problem;
  problem.blocks = {{sdp::BlockKind::kDense, size}};
  problem.cost = Eigen::VectorXd::Zero(size + 1);
  problem.cost[0] = 1.0;
  add_symmetric(problem, sdp::kConstant, 0, Eigen::MatrixXd::Ones(size, size));
  add_symmetric(problem, 0, 0, Eigen::MatrixXd::Identity(size, size));
  for (int k = 0; k < size; ++k) {
    problem.entries.push_back({k + 1, 0, k, (k + 1) % size, 1.0});
  }
  return problem;
}

/// min sum x_i, diag(x) - F_0 positive semidefinite, F_0 a quarter of the Laplacian of a random graph: the
/// bound of the maximum cut.
inline sdp::Problem cut_bound(int size, RandomStream& random) {
  constexpr double kShareOfEdges = 0.1;
  Eigen::MatrixXd laplacian = Eigen::MatrixXd::Zero(size, size);
  for (int c = 0; c < size; ++c) {
    for (int r = 0; r < c; ++r) {
      if (random.uniform() < kShareOfEdges || r + 1 == c) {
        laplacian(r, c) = -0.25;
        laplacian(r, r) += 0.25;
        laplacian(c, c) += 0.25;
      }
    }
  }
  sdp::Problem problem;
  problem.blocks = {{sdp::BlockKind::kDense, size}};
  problem.cost = Eigen::VectorXd::Ones(size);
  add_symmetric(problem, sdp::kConstant, 0, laplacian);
  for (int k = 0; k < size; ++k) {
    problem.entries.push_back({k, 0, k, k, 1.0});
  }
  return problem;
}

}  // namespace trammel::test
