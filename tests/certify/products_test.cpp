// SPDX-License-Identifier: Apache-2.0
// Products of which a certificate's proof is made, against rational arithmetic.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "exact.hpp"
#include "trammel/certify/quick_criterion.hpp"
#include "trammel/certify/quick_proof.hpp"
#include "trammel/core/random.hpp"
#include "trammel/linalg/coarse_product.hpp"
#include "trammel/linalg/error_norms.hpp"
#include "trammel/linalg/sparse_columns.hpp"

namespace {

using trammel::RandomStream;
using trammel::exact::Rational;
namespace certify = trammel::certify;
namespace exact = trammel::exact;
namespace linalg = trammel::linalg;

constexpr std::uint64_t kSeed = 20240917;

/// Sizes spread over `decades`; a share of the entries is zero.
Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index cols, RandomStream& random, double decades,
                              double zeros) {
  Eigen::MatrixXd result(rows, cols);
  for (double& entry : result.reshaped()) {
    entry =
        random.uniform() < zeros ? 0.0 : random.normal() * std::pow(10.0, decades * (random.uniform() - 0.5));
  }
  return result;
}

Eigen::Index random_size(RandomStream& random, int most) {
  return static_cast<Eigen::Index>(1 + random.uniform() * most);
}

exact::Matrix sum(const Eigen::MatrixXd& hi, const Eigen::MatrixXd& lo) {
  return exact::Matrix(hi) + exact::Matrix(lo);
}

/// Errors against what the documentation of CoarseProduct allows; the largest share of it that was needed.
double expect_encloses(const linalg::CoarseProduct& found, const exact::Matrix& a) {
  const exact::Matrix truth = a * exact::Matrix(found.factor);
  double largest = 0.0;
  for (Eigen::Index j = 0; j < found.product.cols(); ++j) {
    for (Eigen::Index i = 0; i < found.product.rows(); ++i) {
      const Rational error = abs(Rational(found.product(i, j)) - truth(i, j));
      const Rational radius = Rational(found.row_error(i)) * Rational(found.column_size(j)) +
                              Rational(0x1p-53) * Rational(std::abs(found.product(i, j))) +
                              Rational(0x1p-600);
      EXPECT_LE(error, radius) << "entry " << i << ", " << j;
      largest = std::max(largest, static_cast<double>(Rational(error / radius)));
    }
  }
  return largest;
}

/// Coarse: every column of D^-1 W is a multiple of 2^-b of the power of two above its largest entry, b as the
/// documentation says, and next to that of B.
void expect_coarse(const linalg::CoarseProduct& found, const Eigen::MatrixXd& b,
                   const Eigen::VectorXd& scale) {
  const auto length = static_cast<double>(b.rows());
  const int bits = std::min(28, 32 - static_cast<int>(std::ceil(std::log2(length))));
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    const Eigen::VectorXd wanted = b.col(j).cwiseQuotient(scale);
    const Eigen::VectorXd column = found.factor.col(j).cwiseQuotient(scale);
    const double unit = std::ldexp(1.0, std::ilogb(wanted.cwiseAbs().maxCoeff()) + 1 - bits);
    for (Eigen::Index i = 0; i < b.rows(); ++i) {
      EXPECT_EQ(std::nearbyint(column(i) / unit) * unit, column(i));
      EXPECT_LE(std::abs(column(i) - wanted(i)), unit / 2.0);
    }
  }
}

TEST(CoarseProduct, EnclosesTheExactOne) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  RandomStream random(kSeed);
  for (int n = 0; n < 60; ++n) {
    const Eigen::Index rows = random_size(random, 20);
    const Eigen::Index inner = random_size(random, n % 10 == 0 ? 400 : 30);
    const Eigen::Index cols = random_size(random, 6);
    const double decades = n % 3 == 0 ? 2.0 : 30.0;
    const Eigen::MatrixXd hi = random_matrix(rows, inner, random, decades, 0.1);
    const Eigen::MatrixXd lo = hi.cwiseProduct(0x1p-54 * random_matrix(rows, inner, random, 0.0, 0.1));
    const Eigen::MatrixXd b = random_matrix(inner, cols, random, decades, 0.1) +
                              1e-30 * Eigen::MatrixXd::Ones(inner, cols);  // no column of zeros
    const Eigen::VectorXd scale = linalg::balance(hi, b);
    const linalg::CoarseProduct found = linalg::coarse_product(hi, lo, b, scale);
    static_cast<void>(expect_encloses(found, sum(hi, lo)));
    expect_coarse(found, b, scale);
    // Beyond double precision by far: 2^-60 of the norms.
    for (Eigen::Index i = 0; i < rows; ++i) {
      EXPECT_LE(found.row_error(i), 0x1p-60 * linalg::row_norms(hi, scale)(i));
    }
  }
}

TEST(CoarseProduct, CancellationOfAllLeadingDigits) {
  RandomStream random(kSeed + 1);
  // Rows (x, -x) times columns (y, y): only lo is left.
  const Eigen::MatrixXd x = random_matrix(5, 12, random, 4.0, 0.0);
  const Eigen::MatrixXd y = random_matrix(12, 3, random, 4.0, 0.0);
  Eigen::MatrixXd hi(5, 24);
  hi << x, -x;
  Eigen::MatrixXd b(24, 3);
  b << y, y;
  Eigen::MatrixXd lo = Eigen::MatrixXd::Zero(5, 24);
  lo.rightCols(12) = 0x1p-55 * x;
  const linalg::CoarseProduct found = linalg::coarse_product(hi, lo, b, linalg::balance(hi, b));
  // The rounding of A W itself is nothing here: the bound of the products is no empty one.
  EXPECT_GT(expect_encloses(found, sum(hi, lo)), 1e-4);
  const Eigen::MatrixXd rest = 0x1p-55 * x * found.factor.bottomRows(12);
  EXPECT_LE((found.product - rest).norm(), 1e-3 * rest.norm());
}

TEST(CoarseProduct, ExtremesAreEnclosedOrProveNothing) {
  RandomStream random(kSeed + 2);
  for (const double size : {1e-300, 4.9e-324, 1e-160, 1e100}) {
    const Eigen::MatrixXd a = size * random_matrix(4, 7, random, 0.0, 0.0);
    const Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(4, 7);
    const Eigen::MatrixXd b = random_matrix(7, 3, random, 3.0, 0.0);
    static_cast<void>(
        expect_encloses(linalg::coarse_product(a, zero, b, linalg::balance(a, b)), exact::Matrix(a)));
    static_cast<void>(
        expect_encloses(linalg::coarse_product(a, zero, b, Eigen::VectorXd::Ones(7)), exact::Matrix(a)));
  }
  const Eigen::MatrixXd huge = Eigen::MatrixXd::Constant(2, 2, 1e200);
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(2);
  EXPECT_FALSE(
      std::isfinite(linalg::coarse_product(huge, Eigen::MatrixXd::Zero(2, 2), huge, ones).row_error(0)));
}

TEST(SparseColumns, ProductsErrNoMoreThanStated) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  RandomStream random(kSeed + 3);
  for (int n = 0; n < 40; ++n) {
    const Eigen::Index rows = random_size(random, 70);
    const Eigen::Index inner = random_size(random, 20);
    const Eigen::Index cols = random_size(random, 6);
    const Eigen::MatrixXd hi = random_matrix(rows, inner, random, 20.0, n % 2 == 0 ? 0.7 : 0.0);
    const Eigen::MatrixXd lo = 0x1p-54 * hi;
    const Eigen::MatrixXd b = random_matrix(inner, cols, random, 20.0, 0.7);
    const Eigen::MatrixXd b_low = -0x1p-55 * b;
    const Eigen::MatrixXd start = random_matrix(rows, cols, random, 20.0, 0.5);
    const linalg::SparseColumns columns(b, b_low);
    const double terms = static_cast<double>(columns.longest()) + 5.0;
    const Rational share = Rational(terms * terms) * Rational(0x1p-106);
    const exact::Matrix sizes =
        exact::Matrix(Eigen::MatrixXd(hi.cwiseAbs())) * exact::Matrix(Eigen::MatrixXd(b.cwiseAbs()));
    Eigen::MatrixXd found = start;
    Eigen::MatrixXd low(rows, cols);
    linalg::add_sparse_product(hi, lo, columns, linalg::ProductPart::kFull, found, low);
    const exact::Matrix truth = exact::Matrix(start) + sum(hi, lo) * sum(b, b_low);
    // The same factor by way of its transpose.
    const linalg::SparseColumns again = columns.transpose().transpose();
    const Eigen::MatrixXd plain = linalg::sparse_product(hi, again);
    const exact::Matrix plain_truth = exact::Matrix(hi) * exact::Matrix(b);
    for (Eigen::Index j = 0; j < cols; ++j) {
      for (Eigen::Index i = 0; i < rows; ++i) {
        const Rational size = sizes(i, j) + abs(Rational(start(i, j)));
        EXPECT_LE(abs(Rational(found(i, j)) + Rational(low(i, j)) - truth(i, j)), share * size);
        EXPECT_LE(abs(Rational(plain(i, j)) - plain_truth(i, j)), Rational(terms * 0x1p-53) * sizes(i, j));
      }
    }
  }
}

TEST(QuickCriterion, SquaredNormIsEnclosedForAllRowsWithinTheErrors) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  RandomStream random(kSeed + 4);
  for (int n = 0; n < 40; ++n) {
    const Eigen::Index p = random_size(random, 12);
    Eigen::MatrixXd factor = random_matrix(random_size(random, 20), 2 * p, random, 6.0, 0.6);
    Eigen::MatrixXd x = random_matrix(random_size(random, 8), 2 * p, random, 6.0, 0.0);
    if (n % 4 == 1) {  // nearly everything cancels in C x
      factor.rightCols(p) = -(1.0 + 0x1p-50) * factor.leftCols(p);
      x.rightCols(p) = x.leftCols(p);
    }
    const certify::QuickCriterion criterion(factor);
    // One entry of each row moved as far as the error allows.
    Eigen::VectorXd errors = Eigen::VectorXd::Zero(x.rows());
    Eigen::MatrixXd moved = x;
    if (n % 2 == 0) {
      for (Eigen::Index i = 0; i < x.rows(); ++i) {
        const auto j = static_cast<Eigen::Index>(random.uniform() * static_cast<double>(2 * p));
        const double move = 1e-9 * x(i, j);
        moved(i, j) += move;
        errors(i) = (1.0 + 1e-6) * std::abs(move) * criterion.weights()(j);
      }
    }
    const exact::Matrix image = exact::Matrix(moved) * exact::transpose(exact::Matrix(factor));
    const Rational truth = exact::trace(image * exact::transpose(image));
    const linalg::Enclosure found = criterion.squared_norm(x, errors);
    EXPECT_LE(Rational(found.lower()), truth);
    EXPECT_GE(Rational(found.upper()), truth);
    const Eigen::VectorXd sizes = criterion.sizes(x) + errors;
    EXPECT_LE(found.radius, 1e-12 * sizes.squaredNorm() + 4.0 * errors.dot(sizes) + 1e-100);
  }
}

/// For an arbitrary estimator and prior: lower_bound() against tr C L (I/share + L'JL)^-1 L'C', inequality()
/// against the exact form.
TEST(QuickProof, EveryStatementHoldsInRationalArithmetic) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  RandomStream random(kSeed + 5);
  int definite = 0;
  for (int n = 0; n < 30; ++n) {
    const Eigen::Index p = 1 + random_size(random, 4);
    trammel::GuaranteedProblem problem;
    problem.information_factor = random_matrix(random_size(random, 8), p, random, 1.0, 0.3);
    problem.criterion_factor = random_matrix(random_size(random, 8), p, random, 1.0, 0.3);
    const Eigen::MatrixXd bounds = random_matrix(p + 1, p, random, 0.0, 0.0);
    const Eigen::MatrixXd gain = 0.1 * random_matrix(p, p, random, 0.0, 0.0);
    const Eigen::MatrixXd factor = random_matrix(p, p, random, 1.0, 0.0);
    const certify::QuickProof proof(problem, gain);
    const exact::Matrix f(problem.information_factor);
    const exact::Matrix c(problem.criterion_factor);
    const exact::Matrix unit(Eigen::MatrixXd::Identity(p, p));
    const exact::Matrix seen = f * exact::Matrix(factor);
    const exact::Matrix image = c * exact::Matrix(factor);
    const exact::Matrix m = unit + exact::transpose(seen) * seen;
    const Rational value = exact::trace(image * exact::solve(m, exact::transpose(image)));
    const auto around = proof.image(factor, bounds);
    const double lower = proof.lower_bound({.factor = factor, .share = 1.0}, around, 1e300);
    const double infinity = std::numeric_limits<double>::infinity();
    const double careful = proof.lower_bound({.factor = factor, .share = 1.0}, around, -infinity);
    EXPECT_LE(Rational(lower), value);
    EXPECT_LE(Rational(careful), value);
    EXPECT_GE(Rational(careful), value * Rational(1.0 - 1e-9) - Rational(1e-12));

    const Eigen::VectorXd rows = Eigen::VectorXd::Constant(p + 1, 300.0 * random.uniform());
    const exact::Matrix error = exact::Matrix(gain) * exact::transpose(f) * f - unit;
    const exact::Matrix seen_error = c * error;
    const exact::Matrix form =
        Rational(rows(0)) * (exact::transpose(exact::Matrix(bounds)) * exact::Matrix(bounds)) -
        exact::transpose(seen_error) * seen_error;
    const bool proved = proof.inequality(around, rows).holds();
    const bool truth = exact::positive_definite(form);
    EXPECT_FALSE(proved && !truth);
    EXPECT_EQ(proved, truth);  // none of these is close to singular
    definite += proved ? 1 : 0;
  }
  EXPECT_GT(definite, 3);
  EXPECT_LT(definite, 27);
}

}  // namespace
