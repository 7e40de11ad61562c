// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>

#include "small_problems.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/sdp/solve.hpp"

namespace {

using trammel::RandomStream;
using trammel::sdp::BlockKind;
using trammel::sdp::kConstant;
using trammel::sdp::Problem;
using trammel::sdp::Solution;
using trammel::sdp::Status;
using trammel::test::add_symmetric;

constexpr double kViolation = 1e-8;

/// F_i and a vector in the interior of what they leave out: no combination is positive definite.
std::vector<Eigen::MatrixXd> traceless(int count, int size, RandomStream& random) {
  std::vector<Eigen::MatrixXd> matrices;
  for (int i = 0; i < count; ++i) {
    matrices.push_back(trammel::test::random_symmetric(size, random));
    matrices.back() -= matrices.back().trace() / size * Eigen::MatrixXd::Identity(size, size);
  }
  return matrices;
}

TEST(SdpInfeasible, PrimalWithCheckedRay) {
  // sum x_i F_i - I with traces 0: never positive semidefinite, and Y = I proves it.
  RandomStream random(21);
  const int size = 8;
  const std::vector<Eigen::MatrixXd> matrices = traceless(5, size, random);
  Problem problem;
  problem.blocks = {{BlockKind::kDense, size}};
  problem.cost = Eigen::VectorXd::LinSpaced(5, -1.0, 2.0);
  add_symmetric(problem, kConstant, 0, Eigen::MatrixXd::Identity(size, size));
  for (int i = 0; i < 5; ++i) {
    add_symmetric(problem, i, 0, matrices[static_cast<std::size_t>(i)]);
  }
  const Solution solution = solve(problem);
  ASSERT_EQ(solution.status, Status::kPrimalInfeasible);
  const Eigen::MatrixXd& ray = solution.ray_y[0];
  EXPECT_NEAR(ray.trace(), 1.0, 1e-12);
  EXPECT_GE(trammel::linalg::SymmetricEigen(ray).eigenvalues()[0], 0.0);
  double squares = 0.0;
  for (const Eigen::MatrixXd& matrix : matrices) {
    squares += std::pow(matrix.cwiseProduct(ray).sum(), 2);
  }
  EXPECT_LE(std::sqrt(squares), kViolation);
  EXPECT_NEAR(solution.ray_violation, std::sqrt(squares), 1e-15);
}

TEST(SdpInfeasible, DualWithCheckedRay) {
  // c is not <F_i, Y> for any Y: x with sum x_i F_i positive definite and c'x < 0 exists.
  RandomStream random(22);
  const int size = 8;
  Problem problem;
  problem.blocks = {{BlockKind::kDense, size}};
  problem.cost = Eigen::VectorXd{{-1.0, 0.3, 0.2}};
  std::vector<Eigen::MatrixXd> matrices = traceless(3, size, random);
  matrices[0] = Eigen::MatrixXd::Identity(size, size);
  for (int i = 0; i < 3; ++i) {
    add_symmetric(problem, i, 0, matrices[static_cast<std::size_t>(i)]);
  }
  add_symmetric(problem, kConstant, 0, trammel::test::random_symmetric(size, random));
  const Solution solution = solve(problem);
  ASSERT_EQ(solution.status, Status::kDualInfeasible);
  EXPECT_NEAR(problem.cost.dot(solution.ray_x), -1.0, 1e-12);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size, size);
  for (int i = 0; i < 3; ++i) {
    sum += solution.ray_x[i] * matrices[static_cast<std::size_t>(i)];
  }
  EXPECT_GE(trammel::linalg::SymmetricEigen(sum).eigenvalues()[0], -kViolation);
}

TEST(SdpInfeasible, LinearProgramsBothWays) {
  Problem problem;  // x >= 1 and x <= 0
  problem.blocks = {{BlockKind::kDiagonal, 2}};
  problem.cost = Eigen::VectorXd::Ones(1);
  problem.entries = {{0, 0, 0, 0, 1.0}, {kConstant, 0, 0, 0, 1.0}, {0, 0, 1, 1, -1.0}};
  EXPECT_EQ(solve(problem).status, Status::kPrimalInfeasible);
  problem.entries = {{0, 0, 0, 0, -1.0}, {kConstant, 0, 0, 0, 1.0}, {0, 0, 1, 1, -2.0}};  // min x, x <= -1
  EXPECT_EQ(solve(problem).status, Status::kDualInfeasible);
}

TEST(SdpInfeasible, ContradictingEquations) {
  Problem problem = trammel::test::theta_of_cycle(5);
  problem.blocks.push_back({BlockKind::kFree, 2});
  problem.entries.insert(problem.entries.end(), {{1, 1, 0, 0, 1.0},
                                                 {kConstant, 1, 0, 0, 1.0},
                                                 {1, 1, 1, 1, 2.0},
                                                 {kConstant, 1, 1, 1, 3.0}});  // x_1 = 1 and 2 x_1 = 3
  EXPECT_EQ(solve(problem).status, Status::kPrimalInfeasible);
}

TEST(SdpInfeasible, VariableWithoutCoefficients) {
  Problem problem = trammel::test::theta_of_cycle(5);
  problem.cost.conservativeResize(7);
  problem.cost[6] = -2.0;
  const Solution solution = solve(problem);
  ASSERT_EQ(solution.status, Status::kDualInfeasible);
  EXPECT_EQ(solution.ray_violation, 0.0);
  EXPECT_DOUBLE_EQ(problem.cost.dot(solution.ray_x), -1.0);
}

TEST(SdpInfeasible, SmallDataAreNotTakenForARay) {
  // Costs of 1e-9 and a constant of 1e3: feasible both ways however small |c| is against <F_0, Y>.
  for (const double scale : {1e-9, 1e-6, 1e6}) {
    SCOPED_TRACE(scale);
    Problem problem = trammel::test::theta_of_cycle(5);
    problem.cost *= scale;
    EXPECT_EQ(solve(problem).status, Status::kOptimal);
  }
}

}  // namespace
