// SPDX-License-Identifier: Apache-2.0
#include "trammel/linalg/stacked_triangle.hpp"

#include <gtest/gtest.h>

#include "trammel/core/random.hpp"

namespace {

using trammel::linalg::StackedTriangle;

TEST(StackedTriangle, IsAFactorOfIdentityPlusSquare) {
  trammel::RandomStream random(1);
  for (const Eigen::Index rows : {0, 1, 5, 60}) {
    for (const Eigen::Index columns : {1, 2, 23, 24, 25, 61}) {
      Eigen::MatrixXd A(rows, columns);
      for (double& entry : A.reshaped()) {
        entry = 10.0 * random.normal();
      }
      StackedTriangle stacked(rows, columns);
      stacked.compute(Eigen::MatrixXd::Ones(rows, columns));  // what was there before does not matter
      stacked.compute(A);
      const Eigen::MatrixXd R = stacked.triangle();
      const Eigen::MatrixXd expected = Eigen::MatrixXd::Identity(columns, columns) + A.transpose() * A;
      EXPECT_LE((R.transpose() * R - expected).norm(), 1e-14 * expected.norm()) << rows << " x " << columns;
    }
  }
}

// Rows of very different size: R keeps the small ones, where the square of A would lose them.
TEST(StackedTriangle, KeepsWhatSquaringWouldLose) {
  const Eigen::MatrixXd A = (Eigen::MatrixXd(2, 2) << 1e12, 1e12, 0.0, 3.0).finished();
  StackedTriangle stacked(2, 2);
  stacked.compute(A);
  const Eigen::MatrixXd R = stacked.triangle();
  // det(I + A'A) = 1 + |A|^2 + det(A)^2; R_11^2 = 1 + 1e24.
  EXPECT_NEAR(std::abs(R(1, 1)), std::sqrt(10.0 + 1.0), 1e-3);
}

}  // namespace
