// SPDX-License-Identifier: Apache-2.0
#include "trammel/linalg/banded_matrix.hpp"

#include <gtest/gtest.h>

#include "trammel/core/random.hpp"
#include "trammel/linalg/banded_triangle.hpp"
#include "trammel/linalg/cholesky.hpp"

namespace {

using namespace trammel;
using linalg::BandedMatrix;

BandedMatrix random_band(Eigen::Index size, Eigen::Index lower, Eigen::Index upper, std::uint64_t seed) {
  RandomStream stream(seed);
  BandedMatrix result(size, lower, upper);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = result.first(i); j < result.behind(i); ++j) {
      result.at(i, j) = stream.normal();
    }
  }
  return result;
}

Eigen::MatrixXd dense(const BandedMatrix& A) { return A.block(0, 0, A.size(), A.size()); }

constexpr double kRounding = 1e-12;

// Bands wider than the matrix are among them: their places outside must stay without effect.
TEST(BandedMatrix, ProductsAndTransposesAreThoseOfDenseMatrices) {
  for (const auto& [lower, upper] : {std::pair<int, int>{0, 3}, {2, 1}, {9, 9}}) {
    const BandedMatrix A = random_band(7, lower, upper, 1);
    const BandedMatrix B = random_band(7, 1, 2, 2);
    EXPECT_LT((dense(A * B) - dense(A) * dense(B)).norm(), kRounding);
    EXPECT_EQ(dense(A.transpose()), dense(A).transpose());
    const Eigen::MatrixXd x = Eigen::MatrixXd::Random(7, 2);
    EXPECT_LT((A * x - dense(A) * x).norm(), kRounding);
    EXPECT_LT((dense(linalg::combine(2.0, A, -1.0, B)) - 2.0 * dense(A) + dense(B)).norm(), kRounding);
    EXPECT_NEAR(linalg::inner_product(A, B), dense(A).cwiseProduct(dense(B)).sum(), kRounding);
  }
}

TEST(BandedMatrix, FactorsAndInvertsWithinTheBand) {
  const BandedMatrix R = [] {
    BandedMatrix upper = random_band(12, 0, 3, 3);
    for (Eigen::Index i = 0; i < 12; ++i) {
      upper.at(i, i) = 4.0 + upper.at(i, i);
    }
    return upper;
  }();
  const Eigen::MatrixXd square = dense(R).transpose() * dense(R);
  const Eigen::MatrixXd inverse = linalg::Cholesky(square).solve(Eigen::MatrixXd::Identity(12, 12));
  const BandedMatrix within = linalg::inverse_within_band(R);
  for (Eigen::Index i = 0; i < 12; ++i) {
    for (Eigen::Index j = within.first(i); j < within.behind(i); ++j) {
      EXPECT_NEAR(within.at(i, j), inverse(i, j), kRounding);
    }
  }
  Eigen::MatrixXd x = Eigen::MatrixXd::Random(12, 2);
  const Eigen::MatrixXd b = x;
  linalg::solve_normal_in_place(R, x);
  EXPECT_LT((square * x - b).norm(), kRounding);

  BandedMatrix factor = R.transpose() * R;
  ASSERT_TRUE(linalg::cholesky_in_place(factor));
  const Eigen::MatrixXd L = dense(factor).triangularView<Eigen::Lower>();
  EXPECT_LT((L * L.transpose() - square).norm(), kRounding * square.norm());
  BandedMatrix indefinite = R.transpose() * R;
  indefinite.at(5, 5) = -1.0;
  EXPECT_FALSE(linalg::cholesky_in_place(indefinite));
}

TEST(BandedRows, PartsHoldTheRowsOfTheirBlocks) {
  linalg::BandedRows<3, 1> rows(6);
  linalg::BandedRows<3, 1> inner(3);
  RandomStream stream(4);
  for (int k = 0; k < 60; ++k) {
    const Eigen::RowVector3d row(stream.normal(), stream.normal(), stream.normal());
    const double rhs = stream.normal();
    rows.add(k % 6, row, rhs);
    if (k % 6 >= 2 && k % 6 < 5) {
      inner.add(k % 6 - 2, row, rhs);
    }
  }
  const linalg::ReducedRows part = rows.part(2, 3).reduce();
  const linalg::ReducedRows expected = inner.reduce();
  EXPECT_LT((part.factor - expected.factor).norm(), kRounding);
  EXPECT_LT((part.rhs - expected.rhs).norm(), kRounding);
}

}  // namespace
