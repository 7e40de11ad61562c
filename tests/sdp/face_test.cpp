// SPDX-License-Identifier: Apache-2.0
// Single constraints <F, Y> = 0 with semidefinite F, which put Y on a face of the cone.
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/QR>

#include "small_problems.hpp"
#include "trammel/core/random.hpp"
#include "trammel/sdp/solve.hpp"

namespace {

using trammel::RandomStream;
using trammel::sdp::BlockKind;
using trammel::sdp::Problem;
using trammel::sdp::Solution;
using trammel::sdp::Status;

Eigen::MatrixXd random_matrix(int rows, int columns, RandomStream& random) {
  Eigen::MatrixXd matrix(rows, columns);
  for (double& value : matrix.reshaped()) {
    value = random.normal();
  }
  return matrix;
}

void expect_small_errors(const Solution& solution) {
  for (const double error : solution.dimacs) {
    EXPECT_LE(std::abs(error), 1e-7);
  }
}

/// Two blocks coupled by all variables but the last ones; interior points on both sides but for the faces.
struct Instance {
  Problem whole;
  Problem on_face;  ///< in an orthonormal basis of the null space, without the last variables
};

Instance make(std::uint64_t seed) {
  RandomStream random(seed);
  const int n = 4 + static_cast<int>(random() % 16);
  const int other = 3 + static_cast<int>(random() % 5);
  const int confining = 1 + static_cast<int>(random() % 3);
  const int rank = 1 + static_cast<int>(random() % std::min(3, (n - 1) / confining));
  const int left = n - confining * rank;
  const int m = 1 + static_cast<int>(random() % ((left * (left + 1) + other * (other + 1)) / 4));
  const bool low_rank = random() % 2 == 0;
  std::vector<Eigen::MatrixXd> factors;
  Eigen::MatrixXd all(n, 0);
  for (int k = 0; k < confining; ++k) {
    factors.push_back(random_matrix(n, rank, random));
    all.conservativeResize(Eigen::NoChange, all.cols() + rank);
    all.rightCols(rank) = factors.back();
  }
  const Eigen::MatrixXd q = Eigen::HouseholderQR<Eigen::MatrixXd>(all).householderQ();
  const Eigen::MatrixXd null = q.rightCols(n - all.cols());

  Instance made;
  made.whole.blocks = {{BlockKind::kDense, n}, {BlockKind::kDense, other}};
  made.on_face.blocks = {{BlockKind::kDense, static_cast<int>(null.cols())}, {BlockKind::kDense, other}};
  made.whole.cost = Eigen::VectorXd::Zero(m + confining);
  made.on_face.cost = Eigen::VectorXd::Zero(m);
  const auto add = [&](int variable, const Eigen::MatrixXd& first, const Eigen::MatrixXd& second) {
    trammel::test::add_symmetric(made.whole, variable, 0, first);
    trammel::test::add_symmetric(made.whole, variable, 1, second);
    trammel::test::add_symmetric(made.on_face, variable, 0, null.transpose() * first * null);
    trammel::test::add_symmetric(made.on_face, variable, 1, second);
  };
  Eigen::MatrixXd constant = -Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixXd constant_other = -Eigen::MatrixXd::Identity(other, other);
  for (int i = 0; i < m; ++i) {
    const Eigen::MatrixXd first = trammel::test::random_symmetric(n, random);
    const Eigen::MatrixXd second = trammel::test::random_symmetric(other, random);
    add(i, first, second);
    const double cost = (null.transpose() * first * null).trace() + second.trace();
    made.whole.cost[i] = made.on_face.cost[i] = cost;
    const double share = random.normal();
    constant += share * first;
    constant_other += share * second;
  }
  add(trammel::sdp::kConstant, constant, constant_other);
  for (int k = 0; k < confining; ++k) {
    const double sign = random() % 2 == 0 ? 1.0 : -1.0;
    if (low_rank) {
      made.whole.low_rank.push_back(
          {m + k, 0, factors[static_cast<std::size_t>(k)], Eigen::VectorXd::Constant(rank, sign)});
    } else {
      const Eigen::MatrixXd& factor = factors[static_cast<std::size_t>(k)];
      trammel::test::add_symmetric(made.whole, m + k, 0, sign * factor * factor.transpose());
    }
  }
  return made;
}

class Face : public testing::TestWithParam<std::uint64_t> {};

TEST_P(Face, HasTheOptimumOfTheProblemOnIt) {
  const Instance instance = make(GetParam());
  const Solution solution = solve(instance.whole);
  const Solution reduced = solve(instance.on_face);
  ASSERT_EQ(reduced.status, Status::kOptimal);
  EXPECT_EQ(solution.status, Status::kOptimal);
  expect_small_errors(solution);
  const double size = 1.0 + std::abs(reduced.primal_objective);
  EXPECT_NEAR(solution.primal_objective, reduced.primal_objective, 1e-7 * size);
  EXPECT_NEAR(solution.dual_objective, reduced.dual_objective, 1e-7 * size);
  ASSERT_EQ(solution.x.size(), instance.whole.cost.size());
  ASSERT_EQ(solution.slack[0].rows(), instance.whole.blocks[0].size);
  ASSERT_EQ(solution.multiplier[0].rows(), instance.whole.blocks[0].size);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Face, testing::Range<std::uint64_t>(1, 41));

// Equal halves of a cycle with few edges between them: diag(Y) = 1, <ee', Y> = 0, and for an even cycle the
// bound is attained by the alternating partition when the weights ask for many edges, exactly.
TEST(Face, EquipartitionOfAnEvenCycleIsExact) {
  constexpr int kSize = 12;
  Problem problem;
  problem.blocks = {{BlockKind::kDense, kSize}};
  problem.cost = Eigen::VectorXd::Ones(kSize + 1);
  problem.cost[kSize] = 0.0;
  for (int i = 0; i < kSize; ++i) {
    problem.entries.push_back({i, 0, i, i, 1.0});
    problem.entries.push_back({trammel::sdp::kConstant, 0, i, (i + 1) % kSize, -0.5});
  }
  trammel::test::add_symmetric(problem, kSize, 0, Eigen::MatrixXd::Ones(kSize, kSize));
  const Solution solution = solve(problem);
  EXPECT_EQ(solution.status, Status::kOptimal);
  expect_small_errors(solution);
  EXPECT_NEAR(solution.primal_objective, kSize, 1e-7 * kSize);
}

// tr Y = 0 leaves only Y = 0, which is no face with interior points: the general way has to do.
TEST(Face, NothingLeftOfABlock) {
  Problem problem;
  problem.blocks = {{BlockKind::kDense, 3}, {BlockKind::kDense, 2}};
  problem.cost = Eigen::VectorXd{{0.0, 1.0}};
  trammel::test::add_symmetric(problem, 0, 0, Eigen::Matrix3d::Identity());
  trammel::test::add_symmetric(problem, 1, 1, Eigen::Matrix2d::Identity());
  trammel::test::add_symmetric(problem, 1, 0, Eigen::Matrix3d::Ones());
  trammel::test::add_symmetric(problem, trammel::sdp::kConstant, 1, Eigen::Vector2d(2.0, 1.0).asDiagonal());
  const Solution solution = solve(problem);
  EXPECT_EQ(solution.status, Status::kOptimal);
  EXPECT_NEAR(solution.primal_objective, 2.0, 1e-6);
}

// On the face <F_1, Y> is what it is outside times minus one: no Y fulfils both constraints.
TEST(Face, InfeasibilityIsProvedOnTheWholeProblem) {
  Problem problem;
  problem.blocks = {{BlockKind::kDense, 3}};
  problem.cost = Eigen::VectorXd{{0.0, -1.0}};
  trammel::test::add_symmetric(problem, 0, 0, Eigen::Matrix3d::Ones());
  trammel::test::add_symmetric(problem, 1, 0, Eigen::Vector3d(1.0, 2.0, 3.0).asDiagonal());
  trammel::test::add_symmetric(problem, trammel::sdp::kConstant, 0, Eigen::Matrix3d::Identity());
  const Solution solution = solve(problem);
  EXPECT_EQ(solution.status, Status::kDualInfeasible);
  EXPECT_LE(solution.ray_violation, 1e-8);
  EXPECT_NEAR(problem.cost.dot(solution.ray_x), -1.0, 1e-12);
}

}  // namespace
