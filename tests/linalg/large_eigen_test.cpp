// SPDX-License-Identifier: Apache-2.0
// Eigenvectors by divide and conquer, and singular vectors of graded matrices.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "trammel/core/random.hpp"
#include "trammel/linalg/gram_eigen.hpp"
#include "trammel/linalg/qr.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"

namespace {

using trammel::linalg::GramEigen;
using trammel::linalg::RepeatedSymmetricEigen;

Eigen::MatrixXd normal_matrix(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  trammel::RandomStream random(seed);
  Eigen::MatrixXd result(rows, columns);
  for (double& entry : result.reshaped()) {
    entry = random.normal();
  }
  return result;
}

double off_identity(const Eigen::MatrixXd& square) {
  return (square - Eigen::MatrixXd::Identity(square.rows(), square.cols())).cwiseAbs().maxCoeff();
}

/// A = U diag(w) U' to rounding, U orthogonal, w rising.
void expect_decomposition(const Eigen::MatrixXd& matrix, const char* name) {
  SCOPED_TRACE(name);
  constexpr double kRounding = 1e-13;
  RepeatedSymmetricEigen eigen(matrix.rows());
  eigen.compute(matrix);
  const Eigen::MatrixXd& U = eigen.eigenvectors();
  const Eigen::VectorXd& w = eigen.eigenvalues();
  EXPECT_LE(off_identity(U.transpose() * U), kRounding);
  EXPECT_LE((matrix * U - U * w.asDiagonal()).cwiseAbs().maxCoeff(),
            kRounding * std::max(w.cwiseAbs().maxCoeff(), 1e-300));
  EXPECT_TRUE(std::is_sorted(w.begin(), w.end()));
}

// Full spectra, clusters, rank deficiency, all equal: what deflation has to cope with; sizes on both sides of
// the change of method.
TEST(LargeEigen, DecomposesToRounding) {
  for (const Eigen::Index n : {41L, 128L, 129L, 260L}) {
    const Eigen::MatrixXd factor = normal_matrix(n, n, 1);
    expect_decomposition(factor * factor.transpose(), "full");
    expect_decomposition(1e-20 * (factor + factor.transpose()), "small entries");
    expect_decomposition(factor.leftCols(5) * factor.leftCols(5).transpose(), "rank five");
    expect_decomposition(Eigen::MatrixXd::Identity(n, n), "identity");
    expect_decomposition(Eigen::MatrixXd::Zero(n, n), "zero");
    Eigen::MatrixXd wilkinson = Eigen::MatrixXd::Zero(n, n);  // pairs of eigenvalues that nearly agree
    for (Eigen::Index i = 0; i < n; ++i) {
      wilkinson(i, i) = std::abs(static_cast<double>(i - n / 2));
    }
    wilkinson.diagonal<1>().setOnes();
    wilkinson.diagonal<-1>().setOnes();
    expect_decomposition(wilkinson, "Wilkinson");
  }
}

// The second difference has eigenvalues 4 sin^2 (k pi / (2 (n + 1))).
TEST(LargeEigen, FindsKnownEigenvalues) {
  constexpr Eigen::Index n = 300;
  Eigen::MatrixXd difference = 2.0 * Eigen::MatrixXd::Identity(n, n);
  difference.diagonal<1>().setConstant(-1.0);
  difference.diagonal<-1>().setConstant(-1.0);
  RepeatedSymmetricEigen eigen(n);
  eigen.compute(difference);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double sine = std::sin(static_cast<double>(k + 1) * std::numbers::pi / (2.0 * (n + 1)));
    EXPECT_NEAR(eigen.eigenvalues()[k], 4.0 * sine * sine, 1e-14);
  }
}

TEST(LargeEigen, ThreadsChangeNoBit) {
  const Eigen::MatrixXd factor = normal_matrix(420, 420, 2);
  GramEigen one(420, 420);
  GramEigen three(420, 420);
  one.compute(factor, 1);
  three.compute(factor, 3);
  EXPECT_EQ(one.norms(), three.norms());
  EXPECT_EQ(one.vectors(), three.vectors());
  EXPECT_EQ(one.images(), three.images());
}

// Norms from 1 down to 1e-11: each with the error eps of the largest, columns of Y orthogonal to what that
// allows.
TEST(GramEigen, KeepsWhatIsGraded) {
  for (const Eigen::Index n : {100L, 240L}) {
    const Eigen::MatrixXd left = trammel::linalg::Qr(normal_matrix(n, n, 3)).householderQ();
    const Eigen::MatrixXd right = trammel::linalg::Qr(normal_matrix(n, n, 4)).householderQ();
    const Eigen::VectorXd norms =
        Eigen::VectorXd::LinSpaced(n, -11.0, 0.0).unaryExpr([](double e) { return std::pow(10.0, e); });
    GramEigen eigen(n, n);
    eigen.compute(left * norms.asDiagonal() * right.transpose());
    const Eigen::VectorXd error = (eigen.norms() - norms).cwiseAbs();
    const double trusted = n > RepeatedSymmetricEigen::kLargest ? 1e-14 : 1e-8;  // the QL method alone
    EXPECT_LE(error.maxCoeff(), trusted);
    EXPECT_LE(off_identity(eigen.vectors().transpose() * eigen.vectors()), 1e-5);
    if (n > RepeatedSymmetricEigen::kLargest) {
      const Eigen::MatrixXd unit = eigen.images() * eigen.norms().cwiseInverse().asDiagonal();
      EXPECT_LE(off_identity(unit.transpose() * unit), 1e-4);
    }
  }
}

}  // namespace
