// SPDX-License-Identifier: Apache-2.0
#include "trammel/linalg/banded_triangle.hpp"

#include <gtest/gtest.h>

#include "trammel/core/random.hpp"

namespace {

using namespace trammel;

class BandedTriangle : public testing::TestWithParam<Eigen::Index> {};

// Rows in any order, gaps, scales from 1e-6 to 1e6: the same normal equations as dense sums.
TEST_P(BandedTriangle, KeepsTheNormalEquations) {
  constexpr std::uint64_t kSeed = 99;
  RandomStream stream(kSeed);
  const Eigen::Index blocks = 7;
  const Eigen::Index border = GetParam();
  linalg::BandedRows<5, 2> rows(blocks, border);
  const Eigen::Index p = rows.columns();
  ASSERT_EQ(p, 17 + border);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(200, p);
  Eigen::VectorXd b(200);
  for (Eigen::Index i = 0; i < A.rows(); ++i) {
    const auto block = static_cast<Eigen::Index>(stream() % blocks);
    const double scale = block % 2 == 0 ? 1e-3 : 1.0;
    Eigen::Matrix<double, 1, 5> row;
    for (double& x : row) {
      x = scale * stream.normal();
    }
    b(i) = scale * stream.normal();
    if (block == 3) {
      row.setZero();  // nothing seen
    }
    A.row(i).segment<5>(2 * block) = row;
    Eigen::RowVectorXd last(border);
    for (double& x : last) {
      x = i % 3 == 0 ? 0.0 : stream.normal();
    }
    A.row(i).tail(border) = last;
    rows.add(block, row, last, b(i));
  }
  const linalg::ReducedRows reduced = rows.reduce();
  EXPECT_LE(reduced.factor.rows(), p);
  EXPECT_LT((reduced.factor.transpose() * reduced.factor - A.transpose() * A).norm(),
            1e-13 * A.squaredNorm());
  EXPECT_LT((reduced.factor.transpose() * reduced.rhs - A.transpose() * b).norm(),
            1e-13 * A.norm() * b.norm());
  EXPECT_NEAR(reduced.rhs.squaredNorm() + reduced.residual, b.squaredNorm(), 1e-13 * b.squaredNorm());
  EXPECT_TRUE(reduced.factor.isUpperTriangular(0.0));
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutBorder, BandedTriangle, testing::Values(0, 1, 3));

TEST(BandedTriangleRows, AreAsManyAsWereSeen) {
  linalg::BandedRows<3, 1> rows(10);
  EXPECT_EQ(rows.reduce().factor.rows(), 0);
  rows.add(4, Eigen::RowVector3d(0.0, 2.0, 1.0), 5.0);
  rows.add(8, Eigen::RowVector3d(1.0, 0.0, 0.0), 1.0);
  rows.add(8, Eigen::RowVector3d(1.0, 0.0, 0.0), 3.0);
  const linalg::ReducedRows reduced = rows.reduce();
  EXPECT_EQ(reduced.factor.rows(), 2);
  EXPECT_EQ(reduced.factor.cols(), 12);
  EXPECT_NEAR(reduced.residual, 2.0, 1e-14);
  // Rows of very different size: the small ones are not lost.
  linalg::BandedRows<3, 1> uneven(1);
  uneven.add(0, 1e-6 * Eigen::RowVector3d(1.0, 2.0, 3.0), 0.0);
  uneven.add(0, 1e-6 * Eigen::RowVector3d(0.0, 1.0, 5.0), 0.0);
  uneven.add(0, 1e6 * Eigen::RowVector3d(1.0, 1.0, 1.0), 0.0);
  const Eigen::MatrixXd R = uneven.reduce().factor;
  EXPECT_NEAR(std::abs(R(0, 0) * R(1, 1) * R(2, 2)) / 1e-6, 3.0, 1e-8);  // |det|
}

}  // namespace
