// SPDX-License-Identifier: Apache-2.0
#include "trammel/filter/general_method.hpp"

#include <complex>

#include <gtest/gtest.h>

#include "filter/filter_cases.hpp"
#include "trammel/filter/design.hpp"
#include "trammel/linalg/lu.hpp"

namespace {

using namespace trammel::filter;
using trammel::RandomStream;
using trammel::test::design_of;
using trammel::test::error_of;
using trammel::test::expect_near;
using trammel::test::vec;
using Complex = std::complex<double>;

constexpr double kExactly = 1e-12;

PolynomialMatrix diagonal(const Polynomial& first, const Polynomial& second) {
  PolynomialMatrix matrix(static_cast<std::size_t>(std::max(first.size(), second.size())),
                          Eigen::MatrixXd::Zero(2, 2));
  for (Eigen::Index i = 0; i < first.size(); ++i) {
    matrix[static_cast<std::size_t>(i)](0, 0) = first[i];
  }
  for (Eigen::Index i = 0; i < second.size(); ++i) {
    matrix[static_cast<std::size_t>(i)](1, 1) = second[i];
  }
  return matrix;
}

/// The published example: A = diag(d^2, d), B = diag(b0 d^2, b0' d).
GeneralMethod published_example(double b0, double b1) {
  const Polynomial square = vec({1.0, -2.0, 1.0});
  const Polynomial single = vec({1.0, -1.0});
  return GeneralMethod::from_matrices(diagonal(square, single), diagonal(b0 * square, b1 * single), 2, 1.0);
}

TEST(GeneralMethod, PublishedExample) {
  const double b0 = 0.5;
  const double b1 = 0.7;
  const GeneralMethod method = published_example(b0, b1);
  EXPECT_TRUE(method.commutes());
  const Complex q(0.3, 0.4);
  const Eigen::MatrixXcd c = method.characteristic(q);
  EXPECT_LE(std::abs(c(0, 0) - (1.0 - 2.0 * b0 * q + b0 * q * q)), kExactly);
  EXPECT_LE(std::abs(c(1, 1) - (1.0 - b1 * q)), kExactly);
  // Scalar closure: the diagonal form of synthesise.
  const FilterDesign literal = design_of(2, 1.0, vec({1 - b0, 1 - b1}), FilterMode::kDifferences);
  const Eigen::MatrixXd pulse = method.scalar_closure_response(10);
  for (int row = 0; row < 2; ++row) {
    const Polynomial expected =
        divide_series(literal.numerators[static_cast<std::size_t>(row)], literal.denominator, 10);
    expect_near(pulse.row(row).transpose(), expected, kExactly, "scalar closure");
  }
  // "The vector of innovations is H_P times the innovation" would need equal A_i/C_i: not so.
  const Complex first = (1.0 - q) * (1.0 - q) / c(0, 0);
  const Complex second = (1.0 - q) / c(1, 1);
  EXPECT_GT(std::abs(first - second), 0.1);
}

TEST(GeneralMethod, SolvesTheSteinEquationForAdmissibleMatrices) {
  constexpr std::uint64_t kSeed = 11;
  RandomStream random(kSeed);
  for (int order = 1; order <= 3; ++order) {
    for (int trial = 0; trial < 5; ++trial) {
      const double t_s = 0.3 + random.uniform();
      const PolynomialMatrix a = difference_operator(order, t_s);
      PolynomialMatrix m(2, Eigen::MatrixXd::Zero(order, order));
      for (auto& coefficient : m) {
        coefficient = coefficient.unaryExpr([&](double) { return 0.4 * random.normal(); });
      }
      const PolynomialMatrix b = multiply_series(m, a, 3);
      const GeneralMethod method = GeneralMethod::from_matrices(a, b, order, t_s);
      const RightQuotient quotient = divide_right(b, a);
      EXPECT_LE(quotient.remainder, kExactly);
      const Complex q(random.uniform(), random.uniform());
      const Eigen::MatrixXcd identity = Eigen::MatrixXcd::Identity(order, order);
      const Eigen::MatrixXcd at_a = evaluate(a, q);
      const Eigen::MatrixXcd at_b = evaluate(b, q);
      const Eigen::MatrixXcd f = identity - at_a;
      const Eigen::MatrixXcd x = method.inverse_characteristic(q);
      const Eigen::MatrixXcd s = method.residual_operator(q);
      const Eigen::MatrixXcd c = method.characteristic(q);
      const double scale = 1e-11 * (1.0 + x.norm() * (1.0 + at_b.norm()));
      EXPECT_LE((identity - f - (x * at_a - f * x * at_b)).norm(), scale) << "eq. (17), seed " << kSeed;
      EXPECT_LE((c - (identity - f * s)).norm(), scale * c.norm()) << "C = I - F S, seed " << kSeed;
      EXPECT_LE((c * x - identity).norm(), scale * c.norm());
      EXPECT_LE(((identity - x * at_b) * at_a.inverse() * c - at_a.inverse() * (identity - s)).norm(),
                scale * c.norm() * at_a.inverse().norm());
      // The series is the same function.
      const Complex small(0.02, 0.03);
      EXPECT_LE(
          (evaluate(method.inverse_characteristic_series(40), small) - method.inverse_characteristic(small))
              .norm(),
          1e-11);
    }
  }
}

TEST(GeneralMethod, AlphaBetaThroughTheResidualOperator) {
  const double alpha = 0.5;
  const double beta = 0.3;
  const PolynomialMatrix s{(Eigen::Matrix2d() << 1 - alpha, 0, 0, 1 - beta).finished()};
  const GeneralMethod method = GeneralMethod::from_operator(difference_operator(2, 1.0), s, 2, 1.0);
  expect_near(method.scalar_denominator(), vec({1.0, -1.2, 0.5}), 1e-11, "alpha-beta filter");
  expect_near(method.vector_denominator(), vec({1.0, -1.2, 0.35}), 1e-11, "poles 1 - alpha, 1 - beta");
  const FilterDesign design = design_of(2, 1.0, vec({alpha, beta}));
  const Eigen::MatrixXd pulse = method.scalar_closure_response(12);
  for (int row = 0; row < 2; ++row) {
    expect_near(pulse.row(row).transpose(),
                divide_series(design.numerators[static_cast<std::size_t>(row)], design.denominator, 12),
                kExactly, "pulse response");
  }
  // B from S leads back to the same method.
  const Complex q(0.2, -0.5);
  EXPECT_LE((method.estimate_accuracy(q) - method.characteristic(q) * evaluate(s, q) *
                                               method.inverse_characteristic(q) *
                                               evaluate(difference_operator(2, 1.0), q))
                .norm(),
            1e-12);
}

TEST(GeneralMethod, ClosuresDiffer) {
  // Coupled A, diagonal B of the publication: reference pulse responses of both closures.
  const GeneralMethod method = GeneralMethod::from_matrices(
      difference_operator(2, 1.0), diagonal(0.5 * vec({1.0, -2.0, 1.0}), 0.7 * vec({1.0, -1.0})), 2, 1.0);
  EXPECT_FALSE(method.commutes());
  expect_near(method.vector_closure_response(6).row(0).transpose(),
              vec({0.5, 0.26, 0.069, 0.1292, 0.14707, 0.06259}), kExactly, "vector closure");
  expect_near(method.scalar_closure_response(6).row(0).transpose(),
              vec({0.5, 0.26, -0.176, -0.0164, 0.15064, 0.116336}), kExactly, "scalar closure");
}

TEST(GeneralMethod, RejectsMatricesThatAreNotInvariant) {
  const PolynomialMatrix a = difference_operator(2, 1.0);
  PolynomialMatrix b = a;
  b[1](0, 0) += 0.1;
  EXPECT_NE(error_of([&] { (void)GeneralMethod::from_matrices(a, b, 2, 1.0); }).find("B"), std::string::npos);
  PolynomialMatrix twice = a;
  twice[0] *= 2.0;
  twice[1] *= 2.0;
  EXPECT_NE(error_of([&] { (void)GeneralMethod::from_matrices(twice, a, 2, 1.0); }).find("A(0)"),
            std::string::npos);
  EXPECT_GT(invariance_residual(difference_operator(2, 1.0), 3, 1.0), 1e-3) << "not exact at degree 2";
}

}  // namespace
