// SPDX-License-Identifier: Apache-2.0
#include "trammel/linalg/double_double.hpp"

#include <cmath>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

#include "exact.hpp"
#include "trammel/core/random.hpp"

namespace {

using trammel::RandomStream;
using trammel::exact::Rational;
using trammel::linalg::EnclosedMatrix;
using trammel::linalg::Enclosure;
namespace linalg = trammel::linalg;
namespace exact = trammel::exact;

constexpr std::uint64_t kSeed = 20240611;

/// Entries of widely different size and sign; some zero.
Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index cols, RandomStream& random, double decades) {
  Eigen::MatrixXd result(rows, cols);
  for (Eigen::Index i = 0; i < result.size(); ++i) {
    result.data()[i] =
        random.uniform() < 0.1 ? 0.0 : random.normal() * std::pow(10.0, decades * (random.uniform() - 0.5));
  }
  return result;
}

/// Largest error over radius; above 1 the enclosure is wrong. Also tells how wide it is.
void expect_encloses(const EnclosedMatrix& found, const exact::Matrix& truth, bool lower_only = false) {
  for (Eigen::Index j = 0; j < found.cols(); ++j) {
    for (Eigen::Index i = lower_only ? j : 0; i < found.rows(); ++i) {
      const double low = found.lo.size() != 0 ? found.lo(i, j) : 0.0;
      const Rational error = Rational(found.hi(i, j)) + Rational(low) - truth(i, j);
      EXPECT_LE(abs(error), Rational(found.radius(i, j))) << "entry " << i << ", " << j;
    }
  }
}

TEST(DoubleDouble, TransformationsAreExact) {
  RandomStream random(kSeed);
  for (int n = 0; n < 2000; ++n) {
    const double a = random.normal() * std::ldexp(1.0, static_cast<int>(random.uniform() * 80) - 40);
    const double b = random.normal();
    const auto sum = linalg::two_sum(a, b);
    EXPECT_EQ(Rational(sum.hi) + Rational(sum.lo), Rational(a) + Rational(b));
    EXPECT_EQ(sum.hi, a + b);
    const auto product = linalg::two_product(a, b);
    EXPECT_EQ(Rational(product.hi) + Rational(product.lo), Rational(a) * Rational(b));
  }
}

TEST(DoubleDouble, ProductsEncloseTheExactOnesAndAreNarrow) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  RandomStream random(kSeed);
  for (int n = 0; n < 30; ++n) {
    const auto rows = static_cast<Eigen::Index>(1 + random.uniform() * 40);
    const auto inner = static_cast<Eigen::Index>(1 + random.uniform() * 12);
    const auto cols = static_cast<Eigen::Index>(1 + random.uniform() * 6);
    const Eigen::MatrixXd a = random_matrix(rows, inner, random, 20.0);
    const Eigen::MatrixXd b = random_matrix(inner, cols, random, 20.0);
    const Eigen::MatrixXd c = random_matrix(cols, cols, random, 20.0);
    const EnclosedMatrix ab = linalg::product(EnclosedMatrix(a), EnclosedMatrix(b));
    const exact::Matrix ab_exact = exact::Matrix(a) * exact::Matrix(b);
    expect_encloses(ab, ab_exact);
    expect_encloses(linalg::product(ab, EnclosedMatrix(c)), ab_exact * exact::Matrix(c));
    expect_encloses(linalg::product(ab.transpose(), ab, linalg::ProductPart::kLower),
                    exact::transpose(ab_exact) * ab_exact, true);
    expect_encloses(linalg::difference(ab, linalg::scale_rows(ab, a.col(0))), [&] {
      exact::Matrix result = ab_exact;
      for (Eigen::Index i = 0; i < rows; ++i) {
        for (Eigen::Index j = 0; j < cols; ++j) {
          result(i, j) -= Rational(a(i, 0)) * ab_exact(i, j);
        }
      }
      return result;
    }());
    // A B - fl(A B): all leading digits cancel.
    const EnclosedMatrix rest = linalg::product_minus(EnclosedMatrix(a), EnclosedMatrix(b), ab.hi);
    expect_encloses(rest, ab_exact - exact::Matrix(ab.hi));
    const Eigen::MatrixXd sizes = a.cwiseAbs() * b.cwiseAbs();
    for (Eigen::Index i = 0; i < sizes.size(); ++i) {
      EXPECT_LE(rest.radius.data()[i], 1e-28 * sizes.data()[i] + 1e-170);
    }
    const Enclosure trace = linalg::inner_product(ab, ab);
    const Rational trace_exact = exact::trace(exact::transpose(ab_exact) * ab_exact);
    EXPECT_LE(Rational(trace.lower()), trace_exact);
    EXPECT_GE(Rational(trace.upper()), trace_exact);
    EXPECT_LE(trace.upper() - trace.lower(), 8e-16 * trace.hi);
  }
}

TEST(DoubleDouble, RadiiOfTheFactorsArePassedOn) {
  EnclosedMatrix a(Eigen::MatrixXd::Constant(1, 2, 3.0));
  a.radius = Eigen::MatrixXd::Constant(1, 2, 0.25);
  EnclosedMatrix b(Eigen::MatrixXd::Constant(2, 1, -2.0));
  b.radius = Eigen::MatrixXd::Constant(2, 1, 0.5);
  const EnclosedMatrix ab = linalg::product(a, b);
  EXPECT_EQ(ab.hi(0, 0), -12.0);
  // Extremes of (3 +- 1/4)(2 +- 1/2) are 4.375 and 8.125, twice.
  EXPECT_GE(ab.radius(0, 0), 2.0 * (8.125 - 6.0));
  EXPECT_LE(ab.radius(0, 0), 2.0 * (8.125 - 6.0) * (1.0 + 1e-12));
}

TEST(DoubleDouble, HugeEntriesProveNothing) {
  const EnclosedMatrix a(Eigen::MatrixXd::Constant(2, 2, 1e200));
  EXPECT_FALSE(std::isfinite(linalg::product(a, a).radius(0, 0)));
  EXPECT_FALSE(std::isfinite(linalg::inner_product(a, a).radius));
}

TEST(DoubleDouble, TinyEntriesAreStillEnclosed) {
  const EnclosedMatrix a(Eigen::MatrixXd::Constant(2, 2, 1.1e-170));
  const exact::Matrix a_exact(a.hi);
  expect_encloses(linalg::product(a, a), a_exact * a_exact);
}

}  // namespace
