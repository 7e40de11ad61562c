// SPDX-License-Identifier: Apache-2.0
#include "trammel/linalg/dense_kernels.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "trammel/core/random.hpp"
#include "trammel/linalg/extended_double.hpp"

namespace {

using trammel::RandomStream;
using trammel::linalg::Dense;
using trammel::linalg::DenseMatrix;
using trammel::linalg::DenseVector;
using trammel::linalg::ExtendedDouble;

template <class Scalar>
DenseMatrix<Scalar> random_matrix(Eigen::Index rows, Eigen::Index columns, RandomStream& random) {
  DenseMatrix<Scalar> matrix(rows, columns);
  for (Eigen::Index j = 0; j < columns; ++j) {
    for (Eigen::Index i = 0; i < rows; ++i) {
      // Both halves of a ExtendedDouble carry digits, and rows differ in size.
      matrix(i, j) = Scalar(random.normal() * std::pow(10.0, i % 5)) + Scalar(random.normal() * 1e-18);
    }
  }
  return matrix;
}

template <class Scalar>
double largest(const DenseMatrix<Scalar>& matrix) {
  return matrix.template cast<double>().cwiseAbs().maxCoeff();
}

template <class Scalar>
class DenseKernels : public testing::Test {
 protected:
  static constexpr double kEpsilon = std::is_same_v<Scalar, double> ? 0x1p-52 : 0x1p-104;
};

using Scalars = testing::Types<double, ExtendedDouble>;
TYPED_TEST_SUITE(DenseKernels, Scalars);

TYPED_TEST(DenseKernels, ProductsAgreeWithTheirDefinition) {
  using Scalar = TypeParam;
  RandomStream random(51);
  for (const Eigen::Index size : {3, 20, 70, 300}) {
    const DenseMatrix<Scalar> a = random_matrix<Scalar>(size, size + 1, random);
    const DenseMatrix<Scalar> b = random_matrix<Scalar>(size + 1, 18, random);
    DenseMatrix<Scalar> expected = DenseMatrix<Scalar>::Zero(size, 18);
    for (Eigen::Index j = 0; j < 18; ++j) {
      for (Eigen::Index k = 0; k <= size; ++k) {
        for (Eigen::Index i = 0; i < size; ++i) {
          expected(i, j) += Scalar(3) * a(i, k) * b(k, j);
        }
      }
    }
    const double bound = 8.0 * static_cast<double>(size) * this->kEpsilon * largest<Scalar>(expected);
    DenseMatrix<Scalar> product = DenseMatrix<Scalar>::Zero(size, 18);
    Dense<Scalar>::add_product(a, b, Scalar(3), product);
    EXPECT_LE(largest<Scalar>(product - expected), bound) << size;
    product.setZero();
    Dense<Scalar>::add_product_tn(DenseMatrix<Scalar>(a.transpose()), b, Scalar(3), product);
    EXPECT_LE(largest<Scalar>(product - expected), bound) << size;
    product.setZero();
    Dense<Scalar>::add_product_nt(a, DenseMatrix<Scalar>(b.transpose()), Scalar(3), product);
    EXPECT_LE(largest<Scalar>(product - expected), bound) << size;
  }
}

TYPED_TEST(DenseKernels, CholeskyInverseAndSolves) {
  using Scalar = TypeParam;
  RandomStream random(52);
  for (const Eigen::Index size : {1, 24, 25, 131}) {
    DenseMatrix<Scalar> a = DenseMatrix<Scalar>::Identity(size, size);
    DenseMatrix<Scalar> root(size, size);
    for (Eigen::Index j = 0; j < size; ++j) {
      for (Eigen::Index i = 0; i < size; ++i) {
        root(i, j) = Scalar(random.normal());
      }
    }
    Dense<Scalar>::add_product_nt(root, root, Scalar(1), a);
    DenseMatrix<Scalar> factor = a;
    ASSERT_EQ(Dense<Scalar>::cholesky(factor), 0);
    DenseVector<Scalar> v = DenseVector<Scalar>::Ones(size);
    Dense<Scalar>::solve_lower(factor, v);
    Dense<Scalar>::solve_lower_transposed(factor, v);
    DenseVector<Scalar> residual = DenseVector<Scalar>::Ones(size);
    Dense<Scalar>::add_vector_product(a, v, Scalar(-1), residual);
    const double bound = 1e4 * static_cast<double>(size) * this->kEpsilon;
    EXPECT_LE(largest<Scalar>(residual), bound) << size;
    Dense<Scalar>::invert_lower(factor);
    DenseMatrix<Scalar> inverse;
    Dense<Scalar>::inverse_from_factor(factor, inverse);
    DenseMatrix<Scalar> difference = -DenseMatrix<Scalar>::Identity(size, size);
    Dense<Scalar>::add_product(a, inverse, Scalar(1), difference);
    EXPECT_LE(largest<Scalar>(difference), bound) << size;
  }
}

TYPED_TEST(DenseKernels, SmallPivotsFailOrAreHeld) {
  using Scalar = TypeParam;
  DenseMatrix<Scalar> a(3, 3);
  a << Scalar(4), Scalar(2), Scalar(2), Scalar(2), Scalar(1), Scalar(1), Scalar(2), Scalar(1), Scalar(5);
  DenseMatrix<Scalar> factor = a;  // the second row is half the first
  EXPECT_EQ(Dense<Scalar>::cholesky(factor), -1);
  factor = a;
  EXPECT_EQ(Dense<Scalar>::cholesky(factor, {.threshold = Scalar(1e-12), .replacement = Scalar(1e60)}), 1);
  DenseVector<Scalar> v(3);
  v << Scalar(8), Scalar(4), Scalar(8);  // a (1.5, 0, 1)
  Dense<Scalar>::solve_lower(factor, v);
  Dense<Scalar>::solve_lower_transposed(factor, v);
  EXPECT_NEAR(static_cast<double>(v[0]), 1.5, 1e-12);
  EXPECT_NEAR(static_cast<double>(v[1]), 0.0, 1e-12);
  EXPECT_NEAR(static_cast<double>(v[2]), 1.0, 1e-12);
}

TEST(ExtendedDouble, FieldOperationsTo31Digits) {
  RandomStream random(53);
  for (int k = 0; k < 1000; ++k) {
    const ExtendedDouble a = ExtendedDouble(random.normal()) + random.normal() * 1e-17;
    const ExtendedDouble b = ExtendedDouble(random.normal()) + random.normal() * 1e-17;
    const auto relative = [](const ExtendedDouble& error, const ExtendedDouble& size) {
      return std::abs(static_cast<double>(error)) / std::abs(static_cast<double>(size));
    };
    EXPECT_LE(relative((a / b) * b - a, a), 0x1p-100);
    EXPECT_LE(relative((a + b) * (a - b) - (a * a - b * b), a * a + b * b), 0x1p-99);
    const ExtendedDouble root = sqrt(a * a);
    EXPECT_LE(relative(root - abs(a), a), 0x1p-98);
  }
  EXPECT_TRUE(ExtendedDouble(1.0) + 0x1p-80 > ExtendedDouble(1.0));
  EXPECT_TRUE(std::isnan(static_cast<double>(ExtendedDouble(0.0) / ExtendedDouble(0.0))));
}

}  // namespace
