// SPDX-License-Identifier: Apache-2.0
// The three methods beside each other: each has its own certified interval, and they agree.
#include <cmath>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "minimax/random_problem.hpp"
#include "minimax/solution_laws.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/minimax/conditional_gradient.hpp"
#include "trammel/minimax/matrix_inequality.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/minimax/worst_prior.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/zoo.hpp"
#include "trammel/sdp/solve.hpp"

namespace {

using trammel::GuaranteedProblem;
using trammel::SolveStatus;
using trammel::minimax::ConditionalGradientVariant;
using trammel::minimax::Method;
using trammel::minimax::Solution;
using trammel::minimax::solve;
using trammel::minimax::solve_by_conditional_gradient;
using trammel::minimax::solve_semidefinite;
using trammel::test::block_bound;
using trammel::test::expect_solution_laws;
using trammel::test::random_matrix;

void expect_intervals_meet(const Solution& left, const Solution& right) {
  constexpr double kRounding = 1e-12;
  EXPECT_LE(left.lower, right.upper * (1 + kRounding));
  EXPECT_LE(right.lower, left.upper * (1 + kRounding));
}

GuaranteedProblem random_problem(std::uint64_t seed, Eigen::Index measurements, Eigen::Index blocks,
                                 double noise, double ratio_of_bounds) {
  trammel::RandomStream random(seed);
  const Eigen::Index p = 3 * blocks;
  GuaranteedProblem problem;
  problem.information_factor = random_matrix(random, measurements, p) / noise;
  problem.criterion_factor = random_matrix(random, p + 4, p);
  for (Eigen::Index b = 0; b < blocks; ++b) {
    const double share = static_cast<double>(b) / static_cast<double>(blocks);
    problem.ellipsoids.push_back(block_bound(p, 3 * b, 3, std::pow(ratio_of_bounds, share)));
  }
  return problem;
}

TEST(Methods, AgreeOnTheSmallReferenceScenarios) {
  for (const trammel::zoo::Instance& instance :
       {trammel::zoo::manoeuvre(), trammel::zoo::manoeuvre_noisy(), trammel::zoo::paper004()}) {
    SCOPED_TRACE(std::string(instance.name));
    const GuaranteedProblem problem = trammel::assemble(instance.scenario).problem;
    const Solution structured = solve(problem);
    const Solution semidefinite = solve_semidefinite(problem);
    EXPECT_EQ(semidefinite.method, Method::kSemidefinite);
    EXPECT_EQ(semidefinite.status, SolveStatus::kOptimal);
    EXPECT_NEAR(std::sqrt(semidefinite.upper / structured.upper), 1.0, 1e-7);
    EXPECT_NEAR(std::sqrt(semidefinite.lower / structured.lower), 1.0, 1e-7);
    expect_solution_laws(problem, semidefinite);
    expect_intervals_meet(structured, semidefinite);
    const Solution gradient = solve_by_conditional_gradient(problem, {.relative_gap = 1e-6});
    EXPECT_EQ(gradient.method, Method::kConditionalGradient);
    EXPECT_EQ(gradient.status, SolveStatus::kOptimal);
    EXPECT_LE(gradient.relative_gap(), 1e-6);
    EXPECT_LE(gradient.iterations, 60);
    expect_solution_laws(problem, gradient);
    expect_intervals_meet(structured, gradient);
  }
}

struct Kind {
  const char* name;
  Eigen::Index measurements;
  double noise;
  double ratio_of_bounds;
};
class KindTest : public testing::TestWithParam<Kind> {};

TEST_P(KindTest, MethodsAgree) {
  const Kind& kind = GetParam();
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const GuaranteedProblem problem =
        random_problem(seed, kind.measurements, 4, kind.noise, kind.ratio_of_bounds);
    const Solution structured = solve(problem);
    const Solution semidefinite = solve_semidefinite(problem);
    EXPECT_NE(semidefinite.status, SolveStatus::kIterationLimit);
    EXPECT_LE(semidefinite.relative_gap(), 1e-7);
    EXPECT_NEAR(semidefinite.upper, structured.upper, 1e-7 * structured.upper);
    expect_intervals_meet(structured, semidefinite);
    const Solution gradient = solve_by_conditional_gradient(problem, {.relative_gap = 1e-6});
    EXPECT_LE(gradient.relative_gap(), 1e-6);
    expect_intervals_meet(structured, gradient);
    const Solution plain = solve_by_conditional_gradient(
        problem, {.relative_gap = 1e-6, .max_iterations = 20}, ConditionalGradientVariant::kPlain);
    EXPECT_LE(plain.lower, plain.upper);
    expect_intervals_meet(structured, plain);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, KindTest,
                         testing::Values(Kind{"well_observed", 30, 0.3, 1.0}, Kind{"noisy", 30, 10.0, 1.0},
                                         Kind{"one_measurement", 1, 1.0, 1.0},
                                         Kind{"few_measurements", 5, 0.01, 10.0},
                                         Kind{"unequal_bounds", 25, 1.0, 1e4}),
                         [](const testing::TestParamInfo<Kind>& kind) {
                           return std::string(kind.param.name);
                         });

// The table of the paper's iteration: sqrt f(V_k) from V_0 = 0.3 I (spec values to the digits printed).
TEST(ConditionalGradient, RepeatsThePapersIteration) {
  const GuaranteedProblem problem = trammel::assemble(trammel::zoo::paper004().scenario).problem;
  const std::vector<double> values{155.0575173756866,  211.31990390364217, 213.54398081651473,
                                   213.58212027239117, 213.7090809508874,  213.81792791013984};
  for (std::size_t k = 0; k < values.size(); ++k) {
    const Solution solution = solve_by_conditional_gradient(
        problem, {.relative_gap = 1e-8, .max_iterations = static_cast<int>(k) + 1},
        ConditionalGradientVariant::kPlain);
    EXPECT_EQ(solution.status, SolveStatus::kIterationLimit);
    EXPECT_NEAR(std::sqrt(solution.lower), values[k], 1e-6 * values[k]) << "step " << k;
  }
  // The printed 213.6 is the lower bound after three steps, far from closed: the interval still is 2.5 wide.
  const Solution third =
      solve_by_conditional_gradient(problem, {.max_iterations = 4}, ConditionalGradientVariant::kPlain);
  EXPECT_GT(std::sqrt(third.upper) - std::sqrt(third.lower), 2.5);
}

TEST(ConditionalGradient, PlainStepsNeedHundredsWhereCorrectiveOnesNeedTens) {
  const GuaranteedProblem problem = trammel::assemble(trammel::zoo::paper004().scenario).problem;
  const Solution plain = solve_by_conditional_gradient(problem, {.relative_gap = 1e-6, .max_iterations = 300},
                                                       ConditionalGradientVariant::kPlain);
  EXPECT_EQ(plain.status, SolveStatus::kIterationLimit);
  EXPECT_GT(plain.relative_gap(), 1e-6);
  const Solution corrective = solve_by_conditional_gradient(problem, {.relative_gap = 1e-6});
  EXPECT_EQ(corrective.status, SolveStatus::kOptimal);
  EXPECT_LE(corrective.iterations, 7);
}

TEST(Methods, SingularCriterionAndUnboundedDirections) {
  GuaranteedProblem problem = random_problem(9, 20, 3, 1.0, 1.0);
  problem.criterion_factor.conservativeResize(2, Eigen::NoChange);
  const Solution structured = solve(problem);
  const Solution semidefinite = solve_semidefinite(problem);
  const Solution gradient = solve_by_conditional_gradient(problem, {.relative_gap = 1e-6});
  EXPECT_NEAR(semidefinite.upper, structured.upper, 1e-7 * structured.upper);
  expect_intervals_meet(structured, semidefinite);
  EXPECT_LE(gradient.relative_gap(), 1e-6);
  expect_intervals_meet(structured, gradient);

  problem.ellipsoids.pop_back();
  problem.information_factor.rightCols(3).setZero();
  for (const Solution& solution : {solve_semidefinite(problem), solve_by_conditional_gradient(problem)}) {
    EXPECT_EQ(solution.status, SolveStatus::kUnbounded);
    EXPECT_GT(solution.unbounded_directions.cols(), 0);
  }
}

// One ellipsoid |theta| <= 1: the worst prior is the top eigenvector, the value the top eigenvalue.
TEST(WorstPrior, OneBallIsTheLargestEigenvalueOfAnyMultiplicity) {
  for (const int multiplicity : {1, 2, 4}) {
    Eigen::VectorXd eigenvalues = Eigen::VectorXd::LinSpaced(6, 0.0, 2.0);
    eigenvalues.tail(multiplicity).setConstant(3.0);
    trammel::RandomStream random(3);
    const Eigen::MatrixXd noise = random_matrix(random, 6, 6);
    const Eigen::MatrixXd rotation =
        trammel::linalg::SymmetricEigen(noise + noise.transpose()).eigenvectors();
    const Eigen::MatrixXd G = rotation * eigenvalues.asDiagonal() * rotation.transpose();
    const auto worst = trammel::minimax::worst_prior(Eigen::MatrixXd::Identity(6, 6), {0, 6}, G, 1e-10);
    EXPECT_NEAR(worst.upper, 3.0, 3e-10);
    EXPECT_NEAR(worst.lower, 3.0, 3e-10);
    EXPECT_LE(worst.prior_factor.squaredNorm(), 1 + 1e-12);
  }
}

// Theorem 1: for two ellipsoids the value is the minimum over t of lambda_max(E G E), E = (t H_1 + (1 - t)
// H_2)^-1/2.
TEST(WorstPrior, TwoEllipsoidsAreTheoremOne) {
  trammel::RandomStream random(8);
  const Eigen::MatrixXd rows = random_matrix(random, 5, 6);
  const Eigen::MatrixXd G = rows.transpose() * rows;
  const auto worst = trammel::minimax::worst_prior(Eigen::MatrixXd::Identity(6, 6), {0, 3, 6}, G, 1e-11);
  const auto largest = [&](double t) {
    Eigen::VectorXd e(6);
    e << Eigen::Vector3d::Constant(1 / std::sqrt(t)), Eigen::Vector3d::Constant(1 / std::sqrt(1 - t));
    return trammel::linalg::SymmetricEigen(e.asDiagonal() * G * e.asDiagonal()).eigenvalues().maxCoeff();
  };
  double low = 1e-6;
  double high = 1 - 1e-6;
  for (int k = 0; k < 200; ++k) {  // convex in t
    const double left = low + (high - low) / 3;
    const double right = high - (high - low) / 3;
    (largest(left) < largest(right) ? high : low) = largest(left) < largest(right) ? right : left;
  }
  EXPECT_NEAR(worst.upper, largest(0.5 * (low + high)), 1e-8 * worst.upper);
  EXPECT_NEAR(worst.multipliers[0] / worst.multipliers.sum(), 0.5 * (low + high), 1e-4);
}

// Printed coordinates: J^-1 and S^-1 have condition numbers of 1e9 and more; what counts is an honest answer.
TEST(MatrixInequality, PrintedFormEndsInAnHonestStatus) {
  const trammel::zoo::Instance instance = trammel::zoo::manoeuvre();
  const GuaranteedProblem problem = trammel::assemble(instance.scenario).problem;
  const auto printed = trammel::minimax::printed_inequality(problem);
  EXPECT_EQ(printed.program.cost.size(), 27 * 28 + 9);
  const auto answer = trammel::sdp::solve(printed.program, {.precision = trammel::sdp::Precision::kDouble});
  if (answer.status == trammel::sdp::Status::kOptimal) {
    const double optimum = instance.optimum->upper_rms_m * instance.optimum->upper_rms_m;
    EXPECT_NEAR(answer.primal_objective, optimum, 1e-4 * optimum);
  } else {
    EXPECT_TRUE(answer.status == trammel::sdp::Status::kNumericalTrouble ||
                answer.status == trammel::sdp::Status::kIterationLimit);
  }
}

TEST(Methods, SameBitsAlwaysAndFromEightThreads) {
  const GuaranteedProblem problem = random_problem(4, 12, 4, 0.5, 3.0);
  const std::vector<std::function<Solution()>> methods{
      [&] { return solve(problem); }, [&] { return solve_semidefinite(problem); },
      [&] { return solve_by_conditional_gradient(problem, {.relative_gap = 1e-6}); }};
  for (const auto& method : methods) {
    const Solution first = method();
    std::vector<Solution> results(8);
    std::vector<std::thread> threads;
    threads.reserve(results.size());
    for (Solution& result : results) {
      threads.emplace_back([&] { result = method(); });
    }
    for (std::thread& thread : threads) {
      thread.join();
    }
    for (const Solution& result : results) {
      EXPECT_EQ(result.upper, first.upper);
      EXPECT_EQ(result.lower, first.lower);
      EXPECT_EQ(result.gain, first.gain);
      EXPECT_EQ(result.multipliers, first.multipliers);
    }
  }
}

}  // namespace
