// SPDX-License-Identifier: Apache-2.0
// Newton's method in the multipliers where its Hessian is a sum of separable terms: counts, proved gaps,
// threads.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "minimax/random_problem.hpp"
#include "trammel/certify/certificate.hpp"
#include "trammel/core/random.hpp"
#include "trammel/linalg/lu.hpp"
#include "trammel/minimax/bound_gram.hpp"
#include "trammel/minimax/newton_multipliers.hpp"
#include "trammel/minimax/prior_state.hpp"
#include "trammel/minimax/separable_gram.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

using trammel::GuaranteedProblem;
using trammel::SolveStatus;
using trammel::minimax::Method;
using trammel::minimax::Solution;

/// The long flight with its covariances times `noise`.
GuaranteedProblem noisy_flight(int segments, double noise) {
  trammel::Scenario scenario = trammel::zoo::long_flight(segments).scenario;
  for (trammel::Station& station : scenario.stations) {
    station.covariance *= noise;
  }
  return trammel::assemble(scenario).problem;
}

void expect_proved(const GuaranteedProblem& problem, const Solution& solution) {
  EXPECT_EQ(solution.status, SolveStatus::kOptimal);
  EXPECT_LE(solution.relative_gap(), 1e-8);
  const trammel::certify::Certificate certificate = trammel::certify::verify(problem, solution);
  EXPECT_EQ(certificate.claim, trammel::Claim::kVerified);
  EXPECT_LE(certificate.relative_gap(), 1e-8);
}

TEST(LargeProblem, IsSolvedByNewtonAloneInAFewSteps) {
  const GuaranteedProblem problem = noisy_flight(90, 1.0);
  const Solution solution = trammel::minimax::solve(problem);
  EXPECT_EQ(solution.method, Method::kNewtonMultipliers);
  EXPECT_LE(solution.iterations, 10);
  EXPECT_EQ(solution.inner_iterations, 0);  // no interior point at the end
  expect_proved(problem, solution);
}

TEST(LargeProblem, IsTheSameForAnyNumberOfThreads) {
  const GuaranteedProblem problem = noisy_flight(70, 1.0);
  const Solution one = trammel::minimax::solve(problem);
  const Solution three = trammel::minimax::solve(problem, {.threads = 3});
  EXPECT_EQ(one.upper, three.upper);
  EXPECT_EQ(one.lower, three.lower);
  EXPECT_EQ(one.multipliers, three.multipliers);
  EXPECT_EQ(one.gain, three.gain);
}

// Other noise: bounds whose multipliers nearly vanish (0.01 to 10); a singular least favourable prior (100,
// 1000), where the interior point takes over.
TEST(LargeProblem, ReachesTheGapForAnyNoise) {
  for (const double noise : {0.01, 0.1, 10.0, 100.0, 1000.0}) {
    SCOPED_TRACE(noise);
    const GuaranteedProblem problem = noisy_flight(noise < 50.0 ? 45 : 30, noise);
    const Solution solution = trammel::minimax::solve(problem);
    expect_proved(problem, solution);
    if (noise < 50.0) {
      EXPECT_EQ(solution.method, Method::kNewtonMultipliers);
    }
  }
}

// A gap in the measurements: the accelerations within it are unobserved, J is singular.
TEST(LargeProblem, ReachesTheGapWhereTheInformationIsSingular) {
  trammel::Scenario scenario = trammel::zoo::long_flight(40).scenario;
  for (trammel::Station& station : scenario.stations) {
    std::erase_if(station.times_s, [](double t) { return t > 100.0 && t < 150.0; });
  }
  const GuaranteedProblem problem = trammel::assemble(scenario).problem;
  expect_proved(problem, trammel::minimax::solve(problem));
}

// A prior that is too small, and one that exceeds the bound with the smallest multiplier: the first is
// brought back, the second scaled, at almost no cost where one factor for all bounds would take a twentieth
// of the lower bound.
TEST(CertifyPrior, BringsBackAPriorThatIsOff) {
  const GuaranteedProblem problem = noisy_flight(30, 1.0);
  const auto direct = trammel::minimax::directly_observed(problem);
  ASSERT_TRUE(direct.has_value());
  const trammel::minimax::ReducedSolution near = trammel::minimax::solve_in_multipliers(*direct, {}, {});
  ASSERT_EQ(near.status, SolveStatus::kOptimal);
  trammel::minimax::ReducedSolution certified = near;
  certified.prior_factor *= 0.999;
  trammel::minimax::certify_prior(*direct, {}, certified);
  EXPECT_EQ(certified.status, SolveStatus::kOptimal);
  EXPECT_LE(certified.upper - certified.lower, 1e-8 * certified.upper);

  Eigen::Index weakest = 0;
  (void)near.multipliers.minCoeff(&weakest);
  constexpr double kExcess = 1.1;
  Eigen::MatrixXd image = direct->bounds * near.prior_factor;
  const auto at = static_cast<std::size_t>(weakest);
  image.middleRows(direct->first_row[at], direct->first_row[at + 1] - direct->first_row[at]) *= kExcess;
  trammel::minimax::PriorState state(*direct);
  state.factor = trammel::linalg::Lu(direct->bounds).solve(image);
  state.update(*direct);
  EXPECT_GT(state.use.maxCoeff(), 1.05);
  trammel::minimax::scale_into_bounds(*direct, state.use, state.factor);
  state.update(*direct);
  EXPECT_LE(state.use.maxCoeff(), 1.0 + 1e-9);
  EXPECT_GE(state.value, (1.0 - 1e-5) * certified.lower);
}

TEST(ExponentialSum, AgreesWithTheReciprocal) {
  for (const double largest : {1.0, 1e3, 1e12}) {
    const auto terms = trammel::minimax::exponential_sum(1.0, largest);
    EXPECT_LE(static_cast<double>(terms.size()), 5.0 + 0.85 * std::log(largest));
    for (double x = 1.0; x <= largest; x *= 1.1) {
      double sum = 0.0;
      for (const auto& term : terms) {
        sum += term.weight * std::exp(-term.rate * x);
      }
      EXPECT_NEAR(sum * x, 1.0, trammel::minimax::kExponentialSumError) << x << " of " << largest;
    }
  }
}

TEST(SeparableGram, AgreesWithTheSum) {
  trammel::RandomStream random(7);
  constexpr Eigen::Index p = 150;
  const Eigen::MatrixXd rows = trammel::test::random_matrix(random, p, p);
  std::vector<Eigen::Index> first_row{0};
  while (first_row.back() < p) {  // bounds of one to four rows
    first_row.push_back(std::min(p, first_row.back() + 1 + static_cast<Eigen::Index>(first_row.size() % 4)));
  }
  const Eigen::VectorXd root =
      Eigen::VectorXd::LinSpaced(p, -5.0, 0.0).unaryExpr([](double e) { return std::pow(10.0, e); });
  const auto s = static_cast<Eigen::Index>(first_row.size()) - 1;
  Eigen::MatrixXd exact(s, s);
  Eigen::MatrixXd storage = trammel::minimax::bound_gram_storage(s, p);
  trammel::minimax::bound_gram(
      rows, first_row,
      [&root](Eigen::Index i, Eigen::Index j) { return 1.0 / (root[i] * root[j] * (root[i] + root[j])); },
      storage, exact);
  Eigen::MatrixXd sum(s, s);
  trammel::minimax::separable_gram(rows, first_row, root, sum, 2);
  const Eigen::VectorXd size = exact.diagonal().cwiseSqrt();
  for (Eigen::Index l = 0; l < s; ++l) {
    for (Eigen::Index m = 0; m <= l; ++m) {
      EXPECT_NEAR(sum(l, m), exact(l, m), trammel::minimax::kExponentialSumError * size[l] * size[m]);
    }
  }
}

}  // namespace
