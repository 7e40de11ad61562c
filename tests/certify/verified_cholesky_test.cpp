// SPDX-License-Identifier: Apache-2.0
#include "trammel/certify/verified_cholesky.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "exact.hpp"
#include "trammel/core/random.hpp"

namespace {

using trammel::RandomStream;
using trammel::certify::positive_definite;
using trammel::certify::UncertainForm;
namespace exact = trammel::exact;

constexpr std::uint64_t kSeed = 4711;
constexpr int kMatrices = 10000;

/// A Gram matrix of fewer vectors than its size, plus a multiple of the identity near the size of rounding
/// errors and of either sign; badly scaled half of the time.
Eigen::MatrixXd nearly_singular(RandomStream& random) {
  const auto n = static_cast<Eigen::Index>(2 + random.uniform() * 11);
  Eigen::MatrixXd x(n, n - 1);
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    x.data()[i] = random.normal();
  }
  Eigen::MatrixXd a = x * x.transpose();
  const double shift = a.trace() * std::pow(10.0, -18.0 + 4.5 * random.uniform());
  a.diagonal().array() += (random.uniform() < 0.3 ? -1.0 : 1.0) * shift;
  if (random.uniform() < 0.5) {
    Eigen::VectorXd d(n);
    for (double& entry : d) {
      entry = std::exp2(std::round(20.0 * random.normal()));
    }
    a = (d.asDiagonal() * a * d.asDiagonal()).eval();
  }
  return a.selfadjointView<Eigen::Lower>();
}

TEST(VerifiedCholesky, NoMatrixThatIsNotDefiniteIsAccepted) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  RandomStream random(kSeed);
  int accepted = 0;
  int definite = 0;
  for (int count = 0; count < kMatrices; ++count) {
    const Eigen::MatrixXd a = nearly_singular(random);
    const bool truth = exact::positive_definite(a);
    const bool proved = positive_definite(a, Eigen::MatrixXd::Zero(a.rows(), a.cols()));
    EXPECT_FALSE(proved && !truth) << "matrix " << count;
    definite += truth ? 1 : 0;
    accepted += proved ? 1 : 0;
  }
  // The test means something: many of either kind, and the proof finds most of what it can.
  EXPECT_GT(definite, kMatrices / 3);
  EXPECT_LT(definite, kMatrices * 9 / 10);
  EXPECT_GT(accepted, definite / 4);
}

TEST(VerifiedCholesky, EveryMatrixWithinTheRadiusIsDefinite) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  RandomStream random(kSeed + 1);
  int accepted = 0;
  for (int count = 0; count < 2000; ++count) {
    Eigen::MatrixXd a = nearly_singular(random);
    const Eigen::Index n = a.rows();
    const Eigen::VectorXd root = a.diagonal().cwiseAbs().cwiseSqrt();
    const double relative = std::pow(10.0, -13.0 + 8.0 * random.uniform());
    a.diagonal() += (relative * 3.0 * static_cast<double>(n) * random.uniform() * root.cwiseAbs2());
    const Eigen::MatrixXd radius = relative * root * root.transpose();
    // Half of the time the same radius as a product of vectors.
    const bool proved = count % 2 == 0
                            ? positive_definite(a, radius)
                            : positive_definite(UncertainForm{
                                  .middle = a, .radius = {}, .left = root, .right = (relative / 2.0) * root});
    if (!proved) {
      continue;
    }
    ++accepted;
    // The worst member for a sign vector z subtracts radius_ij z_i z_j.
    for (int member = 0; member < 4; ++member) {
      Eigen::MatrixXd x = a;
      Eigen::VectorXd z(n);
      for (double& sign : z) {
        sign = random.uniform() < 0.5 ? -1.0 : 1.0;
      }
      for (Eigen::Index i = 0; i < n; ++i) {
        for (Eigen::Index j = 0; j < n; ++j) {
          // Towards a: rounding must not leave the interval.
          x(i, j) -= radius(i, j) * z(i) * z(j) * (1.0 - 1e-9);
        }
      }
      EXPECT_TRUE(exact::positive_definite(x)) << "matrix " << count;
    }
  }
  EXPECT_GT(accepted, 200);
}

TEST(VerifiedCholesky, NumbersThatAreNoneAndExtremesProveNothing) {
  const Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(2, 2);
  const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(2, 2);
  EXPECT_TRUE(positive_definite(unit, zero));
  EXPECT_FALSE(positive_definite(zero, zero));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e290}) {
    for (const Eigen::Index i : {0, 1}) {
      Eigen::MatrixXd a = unit;
      a(1, i) = bad;
      EXPECT_FALSE(positive_definite(a, zero)) << bad << " at 1, " << i;
      Eigen::MatrixXd radius = zero;
      radius(1, i) = bad;
      EXPECT_FALSE(positive_definite(unit, radius)) << bad;
      Eigen::VectorXd column = Eigen::VectorXd::Ones(2);
      column(i) = bad;
      EXPECT_FALSE(positive_definite(
          UncertainForm{.middle = unit, .radius = {}, .left = column, .right = Eigen::VectorXd::Ones(2)}))
          << bad;
    }
  }
}

}  // namespace
