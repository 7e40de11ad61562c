// SPDX-License-Identifier: Apache-2.0
#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "trammel/core/random.hpp"
#include "trammel/linalg/svd.hpp"
#include "trammel/trajectory/criterion_factor.hpp"
#include "trammel/trajectory/motion_parameters.hpp"
#include "trammel/trajectory/quadratic_spline.hpp"

namespace {

using namespace trammel;
using namespace trammel::trajectory;

constexpr std::uint64_t kSeed = 4711;

std::vector<double> irregular_knots() { return {-3.0, -2.5, 1.0, 1.25, 8.0, 20.0, 21.0}; }

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns) {
  RandomStream stream(kSeed);
  Eigen::MatrixXd result(rows, columns);
  for (double& x : result.reshaped()) {
    x = 100.0 * stream.normal();
  }
  return result;
}

/// x(t) of one axis by the definition: start, velocity, and accelerations integrated segment by segment.
struct ByHand {
  double position;
  double velocity;
  double acceleration;
};
ByHand by_hand(const SplineBasis& basis, const Eigen::VectorXd& motion, double t) {
  ByHand state{motion(0), motion(1), motion(2)};
  for (Eigen::Index i = 0; i < basis.segments(); ++i) {
    const double until = i + 1 == basis.segments() ? t : std::min(t, basis.knot(i + 1));
    const double dt = until - basis.knot(i);
    if (dt < 0 || (dt == 0 && i > 0 && i + 1 < basis.segments() && t < basis.knot(i))) {
      break;
    }
    state.acceleration = motion(2 + i);
    state.position += state.velocity * dt + state.acceleration * dt * dt / 2;
    state.velocity += state.acceleration * dt;
    if (t < basis.knot(i + 1)) {
      break;
    }
  }
  return state;
}

template <class Scalar>
class SplineOf : public testing::Test {};
using Scalars = testing::Types<float, double, ceres::Jet<double, 1>>;
TYPED_TEST_SUITE(SplineOf, Scalars);

double plain(double x) { return x; }
double plain(float x) { return static_cast<double>(x); }
double plain(const ceres::Jet<double, 1>& x) { return x.a; }

TYPED_TEST(SplineOf, AgreesWithTheIntegratedAccelerations) {
  using Scalar = TypeParam;
  const double tolerance = std::is_same_v<Scalar, float> ? 2e-3 : 1e-9;
  const SplineBasis basis(irregular_knots());
  const Eigen::MatrixXd c = random_matrix(3, basis.coefficients());
  const QuadraticSpline<Scalar> spline(basis, c.cast<Scalar>());
  const Eigen::MatrixXd motion = motion_from_coefficients(basis) * c.transpose();
  for (double t = -3.0; t <= 21.0; t += 0.375) {
    const Vector3<Scalar> x = spline.position(Scalar(t));
    const Vector3<Scalar> v = spline.velocity(Scalar(t));
    const Vector3<Scalar> w = spline.acceleration(Scalar(t));
    for (int axis = 0; axis < 3; ++axis) {
      const ByHand expected = by_hand(basis, motion.col(axis), t);
      EXPECT_NEAR(plain(x(axis)), expected.position, tolerance * 1e3) << t;
      EXPECT_NEAR(plain(v(axis)), expected.velocity, tolerance * 1e3) << t;
      EXPECT_NEAR(plain(w(axis)), expected.acceleration, tolerance * 1e4) << t;
    }
  }
}

TYPED_TEST(SplineOf, BasisSumsToOne) {
  const SplineBasis basis(irregular_knots());
  for (double t = -3.0; t <= 21.0; t += 0.25) {
    const LocalBasis<TypeParam> local = basis.at(TypeParam(t));
    EXPECT_NEAR(plain(local.value.sum()), 1.0, 1e-6);
    EXPECT_NEAR(plain(local.rate.sum()), 0.0, 1e-5);
    EXPECT_NEAR(plain(local.second_rate.sum()), 0.0, 1e-4);
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(plain(local.value(k)), -1e-6);
    }
  }
}

TEST(Spline, DualNumbersInTimeGiveVelocity) {
  using Dual = ceres::Jet<double, 1>;
  const SplineBasis basis(irregular_knots());
  const Eigen::MatrixXd c = random_matrix(3, basis.coefficients());
  const QuadraticSpline<Dual> dual(basis, c.cast<Dual>());
  const QuadraticSpline<double> spline(basis, c);
  for (double t = -2.9; t < 21.0; t += 0.7) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(dual.position(Dual(t, 0))(axis).v(0), spline.velocity(t)(axis), 1e-9);
      EXPECT_NEAR(dual.velocity(Dual(t, 0))(axis).v(0), spline.acceleration(t)(axis), 1e-9);
    }
  }
}

TEST(Spline, CoefficientsAndMotionAreInverse) {
  for (const std::vector<double>& knots : {irregular_knots(), {0.0, 2.0}, {0.0, 1e-3, 100.0}}) {
    const SplineBasis basis(knots);
    const Eigen::MatrixXd product = motion_from_coefficients(basis) * coefficients_from_motion(basis);
    // Row by row over what was added up: accelerations over short segments are large numbers.
    const Eigen::MatrixXd size =
        motion_from_coefficients(basis).cwiseAbs() * coefficients_from_motion(basis).cwiseAbs();
    const Eigen::MatrixXd gap =
        (product - Eigen::MatrixXd::Identity(product.rows(), product.cols())).cwiseAbs();
    EXPECT_LT((gap.array() - 1e-14 * size.array()).maxCoeff(), 1e-14);
  }
}

TEST(Spline, TruncatedPowersGiveTheSamePosition) {
  const SplineBasis basis(irregular_knots());
  const Eigen::MatrixXd c = random_matrix(basis.coefficients(), 1);
  const Eigen::VectorXd motion = motion_from_coefficients(basis) * c;
  for (double t = -3.0; t <= 21.0; t += 0.25) {
    const LocalBasis<double> local = basis.at(t);
    const double direct = local.value.dot(c.col(0).segment<3>(local.first));
    EXPECT_NEAR(motion_row(basis, t).dot(motion), direct, 1e-9) << t;
    EXPECT_NEAR(motion_row(basis, t).dot(motion), by_hand(basis, motion, t).position, 1e-9) << t;
  }
}

// Four hours in 100 segments: the factor of the mean square stays well conditioned.
TEST(Spline, StaysWellConditionedOnLongFlights) {
  std::vector<double> knots;
  for (int i = 0; i <= 100; ++i) {
    knots.push_back(144.0 * i);
  }
  const SplineBasis basis(knots);
  const linalg::Svd svd(integral_factor(basis, basis.begin_s(), basis.end_s()));
  EXPECT_LT(svd.singularValues()(0) / svd.singularValues().tail<1>()(0), 60.0);
}

/// Mean square of a spline by a fine midpoint rule with Richardson extrapolation.
double mean_square(const SplineBasis& basis, const Eigen::VectorXd& c, double from, double to) {
  const auto midpoint = [&](int parts) {
    double sum = 0.0;
    for (int i = 0; i < parts; ++i) {
      const LocalBasis<double> local = basis.at(from + (to - from) * (i + 0.5) / parts);
      sum += std::pow(local.value.dot(c.segment<3>(local.first)), 2);
    }
    return sum / parts;
  };
  return (4 * midpoint(400000) - midpoint(200000)) / 3;
}

TEST(Criterion, FactorsGiveTheMeanSquare) {
  const SplineBasis basis(irregular_knots());
  const Eigen::VectorXd c = random_matrix(basis.coefficients(), 1);
  for (const auto& [from, to] : {std::pair{-3.0, 21.0}, {-2.75, 20.5}, {2.0, 3.0}, {1.0, 1.25}}) {
    const double expected = mean_square(basis, c, from, to);
    EXPECT_NEAR((integral_factor(basis, from, to) * c).squaredNorm() / expected, 1.0, 1e-8) << from;
  }
  const std::vector<double> times{21.0, -3.0, 4.0, 4.0, 1.1};
  double sum = 0.0;
  for (const double t : times) {
    const LocalBasis<double> local = basis.at(t);
    sum += std::pow(local.value.dot(c.segment<3>(local.first)), 2);
  }
  EXPECT_NEAR((mean_factor(basis, times) * c).squaredNorm() / (sum / 5), 1.0, 1e-13);
}

TEST(Criterion, RefusesTimesOutsideTheKnots) {
  const SplineBasis basis(irregular_knots());
  EXPECT_THROW((void)integral_factor(basis, 5.0, 5.0), Error);
  EXPECT_THROW((void)integral_factor(basis, -3.1, 5.0), Error);
  EXPECT_THROW((void)integral_factor(basis, 0.0, std::nan("")), Error);
  EXPECT_THROW((void)mean_factor(basis, {}), Error);
  EXPECT_THROW((void)mean_factor(basis, {0.0, 22.0}), Error);
}

TEST(Spline, RefusesBadKnots) {
  EXPECT_THROW(SplineBasis({1.0}), Error);
  EXPECT_THROW(SplineBasis({0.0, 1.0, 1.0}), Error);
  EXPECT_THROW(SplineBasis({0.0, 2.0, 1.0}), Error);
  EXPECT_THROW(SplineBasis({0.0, std::nan("")}), Error);
  EXPECT_THROW(SplineBasis({0.0, std::numeric_limits<double>::infinity()}), Error);
  EXPECT_THROW(QuadraticSpline<double>(SplineBasis({0.0, 1.0}), Eigen::MatrixXd::Zero(3, 4)), Error);
}

}  // namespace
