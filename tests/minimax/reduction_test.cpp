// SPDX-License-Identifier: Apache-2.0
#include "trammel/minimax/reduction.hpp"

#include <gtest/gtest.h>

#include "trammel/core/random.hpp"

namespace {

using trammel::GuaranteedProblem;
using trammel::minimax::reduce;
using trammel::minimax::ReducedProblem;

TEST(Reduction, UnboundedDirectionsDoNotMeetTheBoundsAndAreSeenWithUnitNoise) {
  trammel::RandomStream random(3);
  GuaranteedProblem problem;
  const auto fill = [&](Eigen::MatrixXd& matrix, Eigen::Index rows) {
    matrix.resize(rows, 8);
    for (double& entry : matrix.reshaped()) {
      entry = random.normal();
    }
  };
  fill(problem.information_factor, 10);
  fill(problem.criterion_factor, 5);
  problem.ellipsoids.resize(2);
  fill(problem.ellipsoids[0], 3);
  fill(problem.ellipsoids[1], 2);
  const ReducedProblem reduced = reduce(problem);
  EXPECT_EQ(reduced.size(), 5);
  ASSERT_EQ(reduced.free_basis.cols(), 3);
  EXPECT_LT((problem.ellipsoids[0] * reduced.free_basis).norm(), 1e-13);
  EXPECT_LT((problem.ellipsoids[1] * reduced.free_basis).norm(), 1e-13);
  const Eigen::MatrixXd seen = problem.information_factor * reduced.free_basis;
  EXPECT_LT((seen.transpose() * seen - Eigen::MatrixXd::Identity(3, 3)).norm(), 1e-13);
  EXPECT_LT((reduced.bounds.transpose() * reduced.bounds - Eigen::MatrixXd::Identity(5, 5)).norm(), 1e-13);
  EXPECT_NEAR(reduced.free_error, (problem.criterion_factor * reduced.free_basis).squaredNorm(), 1e-12);
  // The design as seen through the free directions is orthogonal to them.
  EXPECT_LT((seen.transpose() * problem.information_factor * reduced.basis).norm(), 1e-12);
}

TEST(Reduction, EllipsoidsWithoutEffectAreLeftOut) {
  GuaranteedProblem problem;
  problem.information_factor = Eigen::MatrixXd::Identity(2, 2);
  problem.criterion_factor = Eigen::MatrixXd::Identity(2, 2);
  problem.ellipsoids = {Eigen::MatrixXd::Zero(1, 2), Eigen::MatrixXd::Identity(2, 2), Eigen::MatrixXd(0, 2)};
  const ReducedProblem reduced = reduce(problem);
  ASSERT_EQ(reduced.ellipsoids(), 1U);
  EXPECT_EQ(reduced.owner[0], 1U);
}

}  // namespace
