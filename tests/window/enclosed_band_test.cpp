// SPDX-License-Identifier: Apache-2.0
#include "trammel/window/enclosed_band.hpp"

#include <gtest/gtest.h>

#include "trammel/core/random.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"

namespace {

using namespace trammel;
using linalg::BandedMatrix;
using LongMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

LongMatrix exact(const BandedMatrix& A) { return A.block(0, 0, A.size(), A.size()).cast<long double>(); }

BandedMatrix random_band(RandomStream& stream, Eigen::Index size, Eigen::Index lower, Eigen::Index upper) {
  BandedMatrix result(size, lower, upper);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = result.first(i); j < result.behind(i); ++j) {
      result.at(i, j) = stream.normal() * std::pow(10.0, 0.5 * stream.normal());
    }
  }
  return result;
}

/// Rows of `truth` lie within the radii of `enclosure`.
void expect_enclosed(const window::EnclosedBand& enclosure, const LongMatrix& truth) {
  const LongMatrix error = truth - exact(enclosure.value);
  for (Eigen::Index i = 0; i < error.rows(); ++i) {
    EXPECT_LE(static_cast<double>(error.row(i).norm()), enclosure.radius(i)) << "row " << i;
  }
}

TEST(EnclosedBand, HoldsWhatExtendedPrecisionComputes) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    RandomStream stream(seed);
    const BandedMatrix A = random_band(stream, 30, 4, 2);
    const BandedMatrix B = random_band(stream, 30, 1, 5);
    const BandedMatrix C = random_band(stream, 30, 3, 3);
    const window::EnclosedBand product = multiply(window::EnclosedBand(A), window::EnclosedBand(B));
    expect_enclosed(product, exact(A) * exact(B));
    const window::EnclosedBand chain = multiply(multiply(window::EnclosedBand(C), product), product);
    const LongMatrix truth = exact(C) * (exact(A) * exact(B)) * (exact(A) * exact(B));
    expect_enclosed(chain, truth);
    expect_enclosed(add_signed(1.0, chain, -1.0, product), truth - exact(A) * exact(B));
    const window::EnclosedNumber square = chain.squared_norm();
    EXPECT_GE(square.upper(), static_cast<double>(truth.squaredNorm()));
    EXPECT_LE(square.lower(), static_cast<double>(truth.squaredNorm()));
    EXPECT_LT(square.radius, 1e-10 * square.value);
  }
}

// Matrices whose least eigenvalue is close to zero on either side, as far as double precision can tell.
TEST(PositiveDefinite, IsNeverClaimedOfAMatrixThatIsNot) {
  int proved = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    RandomStream stream(seed);
    const Eigen::Index n = 24;
    BandedMatrix factor = random_band(stream, n, 3, 0);
    BandedMatrix A = factor * factor.transpose();
    const linalg::SymmetricEigen eigen(A.block(0, 0, n, n), Eigen::EigenvaluesOnly);
    const double target = std::pow(10.0, -16.0 + 4.0 * stream.uniform()) * eigen.eigenvalues()(n - 1);
    const double sign = seed % 2 == 0 ? 1.0 : -1.0;
    for (Eigen::Index i = 0; i < n; ++i) {
      A.at(i, i) += sign * target - eigen.eigenvalues()(0);
    }
    if (window::positive_definite(A, 0.0)) {
      ++proved;
      EXPECT_EQ(sign, 1.0) << seed;
    }
    EXPECT_FALSE(window::positive_definite(A, 2.0 * target)) << seed;
  }
  EXPECT_GT(proved, 20);
}

}  // namespace
