// SPDX-License-Identifier: Apache-2.0
#include "trammel/sdp/solve.hpp"

#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "small_problems.hpp"
#include "trammel/core/error.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"

namespace {

using trammel::RandomStream;
using trammel::sdp::BlockKind;
using trammel::sdp::kConstant;
using trammel::sdp::Problem;
using trammel::sdp::Solution;
using trammel::sdp::Status;
using trammel::test::add_symmetric;

constexpr double kTolerance = 1e-8;

void expect_optimal(const Problem& problem, const Solution& solution, double value) {
  EXPECT_EQ(solution.status, Status::kOptimal);
  EXPECT_NEAR(solution.primal_objective, value, 4.0 * kTolerance * (1.0 + std::abs(value)));
  EXPECT_NEAR(solution.dual_objective, value, 4.0 * kTolerance * (1.0 + std::abs(value)));
  const trammel::sdp::DimacsErrors errors =
      trammel::sdp::dimacs_errors(problem, solution.x, solution.slack, solution.multiplier);
  for (std::size_t k = 0; k < errors.size(); ++k) {
    EXPECT_EQ(errors[k], solution.dimacs[k]);
    EXPECT_LE(std::abs(errors[k]), 1.1 * kTolerance) << "error " << k + 1;
  }
}

double theta(int size) {
  const double cosine = std::cos(std::numbers::pi / size);
  return size * cosine / (1.0 + cosine);
}

/// min x_0, x_0 I + x_1 B - A positive semidefinite.
Problem two_variables(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Problem problem;
  problem.blocks = {{BlockKind::kDense, static_cast<int>(a.rows())}};
  problem.cost = Eigen::VectorXd::Unit(2, 0);
  add_symmetric(problem, kConstant, 0, a);
  add_symmetric(problem, 0, 0, Eigen::MatrixXd::Identity(a.rows(), a.cols()));
  add_symmetric(problem, 1, 0, b);
  return problem;
}

double largest_eigenvalue(const Eigen::MatrixXd& a) {
  return trammel::linalg::SymmetricEigen(a).eigenvalues()[a.rows() - 1];
}

TEST(Sdp, ThetaOfOddCycles) {
  for (const int size : {5, 7, 31}) {
    SCOPED_TRACE(size);
    const Problem problem = trammel::test::theta_of_cycle(size);
    expect_optimal(problem, solve(problem), theta(size));
  }
  EXPECT_NEAR(theta(5), std::sqrt(5.0), 1e-14);
}

TEST(Sdp, LargestEigenvalueInEverySize) {
  RandomStream random(11);
  for (const int size : {1, 2, 17, 60}) {  // diagonal, smallest dense, exact and Lanczos step lengths
    SCOPED_TRACE(size);
    const Eigen::MatrixXd a = trammel::test::random_symmetric(size, random);
    Problem problem;
    problem.blocks = {{BlockKind::kDense, size}};
    problem.cost = Eigen::VectorXd::Ones(1);
    add_symmetric(problem, kConstant, 0, a);
    add_symmetric(problem, 0, 0, Eigen::MatrixXd::Identity(size, size));
    expect_optimal(problem, solve(problem), largest_eigenvalue(a));
  }
}

TEST(Sdp, LinearProgramInDiagonalBlocks) {
  // min x + 2y, x + y >= 3, x <= 2, y >= 0: x = 2, y = 1.
  Problem problem;
  problem.blocks = {{BlockKind::kDiagonal, 2}, {BlockKind::kDiagonal, 1}};
  problem.cost = Eigen::VectorXd{{1.0, 2.0}};
  problem.entries = {{kConstant, 0, 0, 0, 3.0},  {0, 0, 0, 0, 1.0},  {1, 0, 0, 0, 1.0},
                     {kConstant, 0, 1, 1, -2.0}, {0, 0, 1, 1, -1.0}, {1, 1, 0, 0, 1.0}};
  const Solution solution = solve(problem);
  expect_optimal(problem, solution, 4.0);
  EXPECT_NEAR(solution.x[0], 2.0, 1e-6);
  EXPECT_NEAR(solution.multiplier[0](0, 0), 2.0, 1e-6);  // price of x + y >= 3
  EXPECT_NEAR(solution.multiplier[0](1, 0), 1.0, 1e-6);
}

TEST(Sdp, EquationsAsFreeBlockAndAsOppositeRows) {
  RandomStream random(12);
  const Eigen::MatrixXd a = trammel::test::random_symmetric(12, random);
  const Eigen::MatrixXd b = trammel::test::random_symmetric(12, random);
  constexpr double kFixed = 0.3;
  const double value = largest_eigenvalue(a - kFixed * b);
  Problem problem = two_variables(a, b);
  problem.blocks.push_back({BlockKind::kFree, 1});
  problem.entries.push_back({1, 1, 0, 0, 2.0});
  problem.entries.push_back({kConstant, 1, 0, 0, 2.0 * kFixed});
  const Solution free = solve(problem);
  expect_optimal(problem, free, value);
  EXPECT_NEAR(free.x[1], kFixed, 1e-8);

  Problem opposite = two_variables(a, b);
  opposite.blocks.push_back({BlockKind::kDiagonal, 2});
  opposite.entries.insert(opposite.entries.end(), {{1, 1, 0, 0, 2.0},
                                                   {kConstant, 1, 0, 0, 2.0 * kFixed},
                                                   {1, 1, 1, 1, -2.0},
                                                   {kConstant, 1, 1, 1, -2.0 * kFixed}});
  const Solution split = solve(opposite);
  expect_optimal(opposite, split, value);
  EXPECT_NEAR(split.multiplier[1](0, 0) - split.multiplier[1](1, 0), free.multiplier[1](0, 0), 1e-6);
}

TEST(Sdp, VariableThatOnlyEquationsSee) {
  RandomStream random(13);
  const Eigen::MatrixXd a = trammel::test::random_symmetric(9, random);
  Problem problem = two_variables(a, Eigen::MatrixXd::Zero(9, 9));  // x_1 appears in x_1 - x_0 = 1 only
  problem.blocks.push_back({BlockKind::kFree, 1});
  problem.entries.push_back({1, 1, 0, 0, 1.0});
  problem.entries.push_back({0, 1, 0, 0, -1.0});
  problem.entries.push_back({kConstant, 1, 0, 0, 1.0});
  const Solution solution = solve(problem);
  expect_optimal(problem, solution, largest_eigenvalue(a));
  EXPECT_NEAR(solution.x[1], solution.x[0] + 1.0, 1e-7);
}

TEST(Sdp, DependentConstraints) {
  Problem problem = trammel::test::theta_of_cycle(7);
  problem.cost.conservativeResize(10);
  problem.cost[8] = 2.0;  // 2 tr Y = 2 once more
  problem.cost[9] = 1.0;  // and the sum of the trace and of one edge
  add_symmetric(problem, 8, 0, 2.0 * Eigen::MatrixXd::Identity(7, 7));
  add_symmetric(problem, 9, 0, Eigen::MatrixXd::Identity(7, 7));
  problem.entries.push_back({9, 0, 0, 1, 1.0});
  expect_optimal(problem, solve(problem), theta(7));
}

TEST(Sdp, LowRankTermsEqualTheirEntries) {
  RandomStream random(14);
  const int size = 30;
  Problem sparse = trammel::test::cut_bound(size, random);
  // The first coefficient gets an entry part, and two low-rank parts besides.
  Eigen::MatrixXd vectors(size, 2);
  for (int i = 0; i < size; ++i) {
    vectors(i, 0) = random.normal() / size;
    vectors(i, 1) = random.normal() / size;
  }
  const Eigen::Vector2d weights(1.0, -0.5);
  const Eigen::VectorXd last = Eigen::VectorXd::Unit(size, size - 1);
  Problem low_rank = sparse;
  low_rank.low_rank.push_back({0, 0, vectors, weights});
  low_rank.low_rank.push_back({0, 0, vectors.col(1), Eigen::VectorXd::Ones(1)});
  low_rank.low_rank.push_back({size - 1, 0, last, Eigen::VectorXd::Ones(1)});
  add_symmetric(
      sparse, 0, 0,
      vectors * weights.asDiagonal() * vectors.transpose() + vectors.col(1) * vectors.col(1).transpose());
  add_symmetric(sparse, size - 1, 0, last * last.transpose());
  const Solution expected = solve(sparse);
  expect_optimal(low_rank, solve(low_rank), expected.primal_objective);
}

TEST(Sdp, ComponentsOfABlockAreSolvedApart) {
  // Two cycles in one block of matrices that are block diagonal: the sum of their numbers.
  const Problem five = trammel::test::theta_of_cycle(5);
  const Problem seven = trammel::test::theta_of_cycle(7);
  Problem both;
  both.blocks = {{BlockKind::kDense, 13}};  // the last row is empty
  both.cost = Eigen::VectorXd(five.cost.size() + seven.cost.size());
  both.cost << five.cost, seven.cost;
  both.entries = five.entries;
  for (trammel::sdp::Entry entry : seven.entries) {
    entry.variable += entry.variable == kConstant ? 0 : static_cast<int>(five.cost.size());
    entry.row += 5;
    entry.column += 5;
    both.entries.push_back(entry);
  }
  const Solution solution = solve(both);
  expect_optimal(both, solution, theta(5) + theta(7));
  EXPECT_EQ(solution.multiplier[0].block(0, 5, 5, 8), Eigen::MatrixXd::Zero(5, 8));
}

TEST(Sdp, DoubleDoubleReachesTheLastDigits) {
  const Problem problem = trammel::test::theta_of_cycle(5);
  const Solution solution =
      solve(problem, {.tolerance = 1e-18, .precision = trammel::sdp::Precision::kDoubleDouble});
  EXPECT_EQ(solution.status, Status::kOptimal);
  EXPECT_NEAR(solution.primal_objective, std::sqrt(5.0), 1e-15);
}

TEST(Sdp, PrecisionIsRaisedWhereDoubleIsNotEnough) {
  // min x, [x 1; 1 y] positive semidefinite: the infimum 0 is not attained, x = 1/y.
  Problem problem;
  problem.blocks = {{BlockKind::kDense, 2}};
  problem.cost = Eigen::VectorXd{{1.0, 0.0}};
  problem.entries = {{0, 0, 0, 0, 1.0}, {1, 0, 1, 1, 1.0}, {kConstant, 0, 0, 1, -1.0}};
  const Solution solution = solve(problem);
  EXPECT_EQ(solution.status, Status::kOptimal);
  EXPECT_NEAR(solution.primal_objective, 0.0, 1e-4);
  EXPECT_LE(std::abs(solution.dimacs[4]), 1e-7);
}

// Blocks [x_i  0.5; 0.5  x_i+1]: neighbours only meet, so the Schur complement is tridiagonal.
TEST(Sdp, ChainOfSmallBlocksIsFactorisedAsASparseMatrix) {
  const auto chain = [](int m) {
    Problem problem;
    problem.cost = Eigen::VectorXd::Ones(m);
    for (int i = 0; i + 1 < m; ++i) {
      problem.blocks.push_back({BlockKind::kDense, 2});
      problem.entries.push_back({i, i, 0, 0, 1.0});
      problem.entries.push_back({i + 1, i, 1, 1, 1.0});
      problem.entries.push_back({kConstant, i, 0, 1, -0.5});
    }
    return problem;
  };
  // Pairs (x_i, x_i+1) have x_i + x_i+1 >= 1: m/2 for even m, attained by x = 1/2.
  const Solution sparse = solve(chain(600));
  EXPECT_EQ(sparse.status, Status::kOptimal);
  EXPECT_TRUE(sparse.sparse_schur);
  EXPECT_NEAR(sparse.primal_objective, 300.0, 300.0 * 1e-7);
  EXPECT_NEAR(sparse.dual_objective, 300.0, 300.0 * 1e-7);
  const Solution dense = solve(chain(100));
  EXPECT_EQ(dense.status, Status::kOptimal);
  EXPECT_FALSE(dense.sparse_schur);
  EXPECT_NEAR(dense.primal_objective, 50.0, 50.0 * 1e-7);
}

TEST(Sdp, IterationLimitReturnsTheBestIterate) {
  const Problem problem = trammel::test::theta_of_cycle(31);
  const Solution solution =
      solve(problem, {.max_iterations = 4, .precision = trammel::sdp::Precision::kDouble});
  EXPECT_EQ(solution.status, Status::kIterationLimit);
  EXPECT_EQ(solution.iterations, 4);
  EXPECT_TRUE(std::isfinite(solution.primal_objective));
}

TEST(Sdp, DimacsErrorsOfAKnownPoint) {
  // min x, x - 1 >= 0 and an equation 2 x = 6; c = 1.
  Problem problem;
  problem.blocks = {{BlockKind::kDense, 1}, {BlockKind::kFree, 1}};
  problem.cost = Eigen::VectorXd::Ones(1);
  problem.entries = {
      {0, 0, 0, 0, 1.0}, {kConstant, 0, 0, 0, 1.0}, {0, 1, 0, 0, 2.0}, {kConstant, 1, 0, 0, 6.0}};
  const auto number = [](double value) { return Eigen::MatrixXd::Constant(1, 1, value); };
  const trammel::sdp::DimacsErrors errors = trammel::sdp::dimacs_errors(
      problem, Eigen::VectorXd::Constant(1, 4.0), {number(-2.0), number(0.0)}, {number(-0.5), number(0.25)});
  const double size = 1.0 + 4.0 + std::abs(-0.5 + 6.0 * 0.25);
  EXPECT_DOUBLE_EQ(errors[0], std::abs(-0.5 + 2.0 * 0.25 - 1.0) / 2.0);
  EXPECT_DOUBLE_EQ(errors[1], 0.5 / 2.0);
  EXPECT_DOUBLE_EQ(errors[2], std::hypot(4.0 - 1.0 + 2.0, 8.0 - 6.0) / 7.0);
  EXPECT_DOUBLE_EQ(errors[3], 2.0 / 7.0);
  EXPECT_DOUBLE_EQ(errors[4], (4.0 - 1.0) / size);
  EXPECT_DOUBLE_EQ(errors[5], 1.0 / size);
}

TEST(Sdp, WrongProblemsAreRejectedByName) {
  const auto message = [](const Problem& problem) -> std::string {
    try {
      (void)solve(problem);
    } catch (const trammel::Error& error) {
      return error.what();
    }
    return "accepted";
  };
  Problem problem = trammel::test::theta_of_cycle(5);
  problem.entries[3].row = 5;
  EXPECT_EQ(message(problem), "problem.entries[3]: found row or column 5, expected 0 to 4");
  problem = trammel::test::theta_of_cycle(5);
  problem.entries[2].value = std::nan("");
  EXPECT_NE(message(problem).find("problem.entries[2].value"), std::string::npos);
  problem = trammel::test::theta_of_cycle(5);
  problem.entries[2].variable = 6;
  EXPECT_NE(message(problem).find("problem.entries[2].variable"), std::string::npos);
  problem = trammel::test::theta_of_cycle(5);
  problem.blocks[0].kind = BlockKind::kDiagonal;
  EXPECT_NE(message(problem).find("equal row and column"), std::string::npos);
  problem = trammel::test::theta_of_cycle(5);
  problem.cost[1] = std::numeric_limits<double>::infinity();
  EXPECT_NE(message(problem).find("problem.cost"), std::string::npos);
  problem = trammel::test::theta_of_cycle(5);
  problem.low_rank.push_back({0, 0, Eigen::MatrixXd::Ones(4, 1), Eigen::VectorXd::Ones(1)});
  EXPECT_NE(message(problem).find("problem.low_rank[0].vectors"), std::string::npos);
  EXPECT_NE(message(Problem{}).find("problem.cost"), std::string::npos);
}

TEST(SdpSettings, EveryFieldIsVisitedAndChecked) {
  int fields = 0;
  trammel::sdp::Settings settings;
  visit_fields(settings, [&](const trammel::FieldDoc&, auto&) { ++fields; });
  EXPECT_EQ(fields, 5);
  const auto [a, b, c, d, e] = settings;  // fails to compile when a field is added
  EXPECT_GT(a + b + c + d, 0.0);
  EXPECT_EQ(e, trammel::sdp::Precision::kAutomatic);
  settings.tolerance = std::nan("");
  EXPECT_THROW((void)solve(trammel::test::theta_of_cycle(5), settings), trammel::Error);
}

}  // namespace
