// SPDX-License-Identifier: Apache-2.0
#include "trammel/minimax/solve.hpp"

#include <string>

#include <gtest/gtest.h>

#include "minimax/random_problem.hpp"
#include "minimax/solution_laws.hpp"
#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

using trammel::GuaranteedProblem;
using trammel::SolveStatus;
using trammel::minimax::Method;
using trammel::minimax::Solution;
using trammel::minimax::solve;
using trammel::test::block_bound;
using trammel::test::expect_solution_laws;
using trammel::test::random_matrix;

class ZooTest : public testing::TestWithParam<std::string> {};

TEST_P(ZooTest, MeetsTheKnownOptimum) {
  for (const trammel::zoo::Instance& instance : trammel::zoo::all_instances()) {
    if (instance.name != GetParam()) {
      continue;
    }
    const trammel::TrajectoryProblem trajectory = trammel::assemble(instance.scenario);
    const Solution solution = solve(trajectory.problem);
    EXPECT_EQ(solution.status, SolveStatus::kOptimal);
    EXPECT_LE(solution.relative_gap(), 1e-8);
    ASSERT_TRUE(instance.optimum.has_value());
    constexpr double kRelative = 1e-7;
    EXPECT_GE(std::sqrt(solution.upper), instance.optimum->lower_rms_m * (1 - kRelative));
    EXPECT_LE(std::sqrt(solution.upper), instance.optimum->upper_rms_m * (1 + kRelative));
    EXPECT_GE(std::sqrt(solution.lower), instance.optimum->lower_rms_m * (1 - kRelative));
    EXPECT_LE(solution.iterations, 60);
    EXPECT_LE(solution.inner_iterations, 600);
    expect_solution_laws(trajectory.problem, solution);
    const bool well_observed = instance.name.substr(0, 4) == "long";
    if (well_observed) {
      EXPECT_EQ(solution.method, Method::kNewtonMultipliers);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Zoo, ZooTest,
                         testing::Values("manoeuvre", "manoeuvre_noisy", "r20", "r40_noisy", "paper004",
                                         "long_r40", "long_r98"));

// One parameter, one bound: V = w^2, value w^2 / (1 + j w^2).
TEST(Solve, OneParameterIsTheClosedForm) {
  for (const double bound : {1e-6, 1.0, 1e6}) {
    for (const double information : {0.0, 1e-6, 1.0, 1e6}) {
      GuaranteedProblem problem;
      problem.information_factor = Eigen::MatrixXd::Constant(1, 1, std::sqrt(information));
      problem.criterion_factor = Eigen::MatrixXd::Constant(1, 1, 2.0);
      problem.ellipsoids = {Eigen::MatrixXd::Constant(1, 1, 1.0 / bound)};
      const Solution solution = solve(problem);
      const double exact = 4.0 * bound * bound / (1.0 + information * bound * bound);
      EXPECT_EQ(solution.status, SolveStatus::kOptimal);
      EXPECT_NEAR(solution.upper, exact, 1e-8 * exact);
      EXPECT_NEAR(solution.lower, exact, 1e-8 * exact);
      expect_solution_laws(problem, solution);
    }
  }
}

// One ball, S = I, J = diag(j): reverse water-filling. V = diag((sqrt(1 / nu) - 1) / j)+ with tr V = 1.
TEST(Solve, OneBallIsReverseWaterFilling) {
  const Eigen::VectorXd j = (Eigen::VectorXd(6) << 0.5, 3.0, 20.0, 1.0, 200.0, 0.1).finished();
  GuaranteedProblem problem;
  problem.information_factor = j.cwiseSqrt().asDiagonal();
  problem.criterion_factor = Eigen::MatrixXd::Identity(6, 6);
  problem.ellipsoids = {Eigen::MatrixXd::Identity(6, 6)};
  double low = 0.0;
  double high = 1.0;
  for (int i = 0; i < 200; ++i) {  // f'(v) = 1 / (1 + j v)^2 = nu wherever v > 0
    const double nu = 0.5 * (low + high);
    const double used = ((1.0 / std::sqrt(nu) - 1.0) / j.array()).max(0.0).sum();
    (used > 1.0 ? low : high) = nu;
  }
  const Eigen::ArrayXd v = ((1.0 / std::sqrt(high) - 1.0) / j.array()).max(0.0);
  const double exact = (v / (1.0 + j.array() * v)).sum();
  const Solution solution = solve(problem);
  EXPECT_NEAR(solution.upper, exact, 1e-8 * exact);
  EXPECT_NEAR(solution.lower, exact, 1e-8 * exact);
}

TEST(Solve, WithoutMeasurementsTheValueIsLinearInTheBound) {
  GuaranteedProblem problem;
  problem.information_factor.resize(0, 3);
  problem.criterion_factor = Eigen::Vector3d(1.0, 2.0, 3.0).asDiagonal();
  problem.ellipsoids = {block_bound(3, 0, 3, 10.0)};
  const Solution solution = solve(problem);
  EXPECT_EQ(solution.status, SolveStatus::kOptimal);
  EXPECT_NEAR(solution.upper, 900.0, 1e-8 * 900.0);
  expect_solution_laws(problem, solution);
}

TEST(Solve, UnboundedDirectionsAreNamed) {
  GuaranteedProblem problem;
  problem.information_factor = (Eigen::MatrixXd(1, 3) << 1.0, 1.0, 0.0).finished();
  problem.criterion_factor = Eigen::MatrixXd::Identity(3, 3);
  problem.ellipsoids = {block_bound(3, 2, 1, 1.0)};
  const Solution solution = solve(problem);
  EXPECT_EQ(solution.status, SolveStatus::kUnbounded);
  ASSERT_EQ(solution.unbounded_directions.cols(), 1);
  const Eigen::Vector3d direction = solution.unbounded_directions.col(0).normalized();
  EXPECT_NEAR(std::abs(direction[0]), std::sqrt(0.5), 1e-14);
  EXPECT_NEAR(direction[0] + direction[1], 0.0, 1e-14);
  // Not seen by the criterion, it does no harm.
  problem.criterion_factor = (Eigen::MatrixXd(2, 3) << 1.0, 1.0, 0.0, 0.0, 0.0, 1.0).finished();
  const Solution fine = solve(problem);
  EXPECT_EQ(fine.status, SolveStatus::kOptimal);
  EXPECT_NEAR(fine.upper, 2.0, 2e-8);  // variance 1 of the sum, and 1 for the bounded one unseen
}

// Directions without a bound are the limit of wide bounds, and everything bounded by nothing is Gauss-Markov.
TEST(Solve, FreeDirectionsAreTheLimitOfWideBounds) {
  trammel::RandomStream random(11);
  GuaranteedProblem problem;
  problem.information_factor = random_matrix(random, 12, 7);
  problem.criterion_factor = random_matrix(random, 9, 7);
  problem.ellipsoids = {block_bound(7, 0, 2, 0.1), block_bound(7, 2, 2, 0.3)};
  const Solution free = solve(problem);
  EXPECT_EQ(free.status, SolveStatus::kOptimal);
  expect_solution_laws(problem, free);
  problem.ellipsoids.push_back(block_bound(7, 4, 3, 1e6));
  const Solution wide = solve(problem);
  EXPECT_NEAR(free.upper, wide.upper, 1e-7 * free.upper);
  problem.ellipsoids.clear();
  const Eigen::MatrixXd J = problem.information_factor.transpose() * problem.information_factor;
  const Eigen::MatrixXd S = problem.criterion_factor.transpose() * problem.criterion_factor;
  const double gauss_markov = (J.ldlt().solve(S)).trace();
  const Solution none = solve(problem);
  EXPECT_NEAR(none.upper, gauss_markov, 1e-11 * gauss_markov);
}

// A change of coordinates changes nothing; scales of all sizes side by side.
TEST(Solve, ValueDoesNotDependOnCoordinates) {
  trammel::RandomStream random(5);
  GuaranteedProblem problem;
  problem.information_factor = random_matrix(random, 20, 9);
  problem.criterion_factor = random_matrix(random, 15, 9);
  problem.ellipsoids = {block_bound(9, 0, 3, 1.0), block_bound(9, 3, 3, 1e-2), block_bound(9, 6, 3, 3.0)};
  const Solution plain = solve(problem);
  const Eigen::VectorXd scale =
      Eigen::VectorXd::LinSpaced(9, -5, 5).unaryExpr([](double e) { return std::pow(10.0, e); });
  const Eigen::MatrixXd change = random_matrix(random, 9, 9) * scale.asDiagonal();
  GuaranteedProblem changed = problem;
  changed.information_factor *= change;
  changed.criterion_factor *= change;
  for (Eigen::MatrixXd& rows : changed.ellipsoids) {
    rows *= change;
  }
  const Solution other = solve(changed);
  EXPECT_EQ(other.status, SolveStatus::kOptimal);
  EXPECT_NEAR(other.upper, plain.upper, 1e-7 * plain.upper);
  EXPECT_NEAR(other.lower, plain.lower, 1e-7 * plain.lower);
}

struct Family {
  const char* name;
  double noise;
  Eigen::Index measurements;
  double smallest_bound;
  double largest_bound;
};

class FamilyTest : public testing::TestWithParam<Family> {};

TEST_P(FamilyTest, SolvesToTheGapAskedFor) {
  const Family& family = GetParam();
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    trammel::RandomStream random(seed);
    constexpr Eigen::Index kBlocks = 6;
    constexpr Eigen::Index p = 3 * kBlocks;
    GuaranteedProblem problem;
    problem.information_factor = random_matrix(random, family.measurements, p) / family.noise;
    problem.criterion_factor = random_matrix(random, 25, p);
    for (Eigen::Index b = 0; b < kBlocks; ++b) {
      const double exponent = static_cast<double>(b) / (kBlocks - 1);
      problem.ellipsoids.push_back(block_bound(
          p, 3 * b, 3,
          family.smallest_bound * std::pow(family.largest_bound / family.smallest_bound, exponent)));
    }
    const Solution solution = solve(problem);
    EXPECT_EQ(solution.status, SolveStatus::kOptimal);
    EXPECT_LE(solution.relative_gap(), 1e-8);
    EXPECT_LE(solution.iterations, 100);
    expect_solution_laws(problem, solution, 1e-8);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Families, FamilyTest,
    testing::Values(Family{"plain", 1.0, 30, 1.0, 1.0}, Family{"one_measurement", 1.0, 1, 1.0, 1.0},
                    Family{"six_measurements", 0.1, 6, 1.0, 10.0}, Family{"tiny_noise", 1e-6, 30, 1.0, 1.0},
                    Family{"huge_noise", 1e6, 30, 1.0, 1.0}, Family{"wild_bounds", 1.0, 30, 1e-4, 1e3},
                    Family{"wilder_bounds", 1.0, 25, 1e-6, 1e6}, Family{"tiny_bounds", 1.0, 40, 1e-9, 1e-9}),
    [](const testing::TestParamInfo<Family>& family) { return std::string(family.param.name); });

TEST(Solve, IterationLimitKeepsAValidInterval) {
  const trammel::TrajectoryProblem trajectory = trammel::assemble(trammel::zoo::r20().scenario);
  const Solution solution = solve(trajectory.problem, {.relative_gap = 1e-8, .max_iterations = 12});
  EXPECT_EQ(solution.status, SolveStatus::kIterationLimit);
  const double optimum = trammel::zoo::r20().optimum->upper_rms_m;
  EXPECT_GE(std::sqrt(solution.upper), optimum * (1 - 1e-9));
  EXPECT_LE(std::sqrt(solution.lower), optimum * (1 + 1e-9));
  EXPECT_GT(solution.lower, 0.0);
  EXPECT_TRUE(std::isfinite(solution.upper));
}

TEST(Solve, RejectsWhatDoesNotFit) {
  GuaranteedProblem problem;
  problem.criterion_factor = Eigen::MatrixXd::Identity(3, 3);
  problem.information_factor = Eigen::MatrixXd::Identity(2, 2);
  EXPECT_THROW((void)solve(problem), trammel::Error);
  problem.information_factor = Eigen::MatrixXd::Identity(3, 3);
  problem.information_factor(1, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)solve(problem), trammel::Error);
  problem.information_factor(1, 1) = 1.0;
  EXPECT_THROW((void)solve(problem, {.relative_gap = -1.0}), trammel::Error);
  problem.ellipsoids = {Eigen::MatrixXd::Identity(2, 2)};
  EXPECT_THROW((void)solve(problem), trammel::Error);
}

}  // namespace
