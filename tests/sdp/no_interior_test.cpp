// SPDX-License-Identifier: Apache-2.0
// Problems whose dual side has no interior points: the constraints force Y into a face of the cone, though no
// single one of them shows it.
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/QR>

#include "small_problems.hpp"
#include "trammel/sdp/solve.hpp"

namespace {

using trammel::RandomStream;
using trammel::sdp::Problem;
using trammel::sdp::Solution;
using trammel::sdp::Status;

Problem one_block(const Eigen::MatrixXd& constant, const std::vector<Eigen::MatrixXd>& coefficients,
                  const Eigen::VectorXd& cost) {
  Problem problem;
  problem.blocks = {{trammel::sdp::BlockKind::kDense, static_cast<int>(constant.rows())}};
  problem.cost = cost;
  trammel::test::add_symmetric(problem, trammel::sdp::kConstant, 0, constant);
  for (std::size_t i = 0; i < coefficients.size(); ++i) {
    trammel::test::add_symmetric(problem, static_cast<int>(i), 0, coefficients[i]);
  }
  return problem;
}

class HiddenFace : public testing::TestWithParam<std::uint64_t> {};

// Y = V Z V' follows from a combination of all constraints. The problem in Z has interior points and the same
// optimum.
TEST_P(HiddenFace, HasTheOptimumOfTheProblemOnTheFace) {
  RandomStream random(GetParam());
  const int n = 6 + static_cast<int>(random() % 20);
  const int rank = 1 + static_cast<int>(random() % (n / 2));  // of the combination
  const int m = n + static_cast<int>(random() % n);
  Eigen::MatrixXd start(n, n);
  for (double& value : start.reshaped()) {
    value = random.normal();
  }
  const Eigen::MatrixXd q = Eigen::HouseholderQR<Eigen::MatrixXd>(start).householderQ();
  const Eigen::MatrixXd face = q.leftCols(n - rank);
  const Eigen::MatrixXd z = Eigen::MatrixXd::Identity(n - rank, n - rank);
  std::vector<Eigen::MatrixXd> coefficients;
  Eigen::VectorXd cost(m);
  Eigen::MatrixXd last = q.rightCols(rank) * q.rightCols(rank).transpose();
  Eigen::MatrixXd constant = -Eigen::MatrixXd::Identity(n, n);
  cost[m - 1] = 0.0;
  for (int i = 0; i + 1 < m; ++i) {
    coefficients.push_back(trammel::test::random_symmetric(n, random));
    cost[i] = (face.transpose() * coefficients.back() * face).cwiseProduct(z).sum();
    constant += random.normal() * coefficients.back();
    const double share = random.normal();
    last -= share * coefficients.back();
    cost[m - 1] -= share * cost[i];
  }
  coefficients.push_back(last);
  const Solution solution = solve(one_block(constant, coefficients, cost));

  std::vector<Eigen::MatrixXd> on_face;
  for (const Eigen::MatrixXd& coefficient : coefficients) {
    on_face.emplace_back(face.transpose() * coefficient * face);
  }
  const Solution reduced = solve(one_block(face.transpose() * constant * face, on_face, cost));
  ASSERT_EQ(reduced.status, Status::kOptimal);
  EXPECT_EQ(solution.status, Status::kOptimal);
  for (const double error : solution.dimacs) {
    EXPECT_LE(std::abs(error), 1e-7);
  }
  EXPECT_NEAR(solution.primal_objective, reduced.primal_objective,
              1e-4 * (1.0 + std::abs(reduced.primal_objective)));
}

INSTANTIATE_TEST_SUITE_P(Seeds, HiddenFace, testing::Range<std::uint64_t>(1, 13));

}  // namespace
