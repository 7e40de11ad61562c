// SPDX-License-Identifier: Apache-2.0
#include "direct_transcription.hpp"

#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include "cases.hpp"
#include "random_problem.hpp"
#include "trammel/observer/plan.hpp"

namespace {

using trammel::observer::make_plan;
using trammel::observer::Plan;
using trammel::observer::PlanProblem;

constexpr double kNeverBetter = 1e-9;
constexpr double kClose = 1e-4;

void expect_agreement(const PlanProblem& problem, int steps, const std::string& name) {
  const Plan plan = make_plan(problem);
  const double direct = trammel::test::best_direct_cost(problem, steps);
  EXPECT_GE(direct, plan.cost * (1.0 - kNeverBetter)) << name;
  EXPECT_LE(direct, plan.cost * (1.0 + kClose)) << name;
}

TEST(DirectTranscription, PaperProblems) {
  for (const auto& reference : trammel::test::kReferencePlans) {
    expect_agreement(trammel::test::problem_of(reference), 500, reference.name);
  }
}

TEST(DirectTranscription, FourGeometriesAllWeights) {
  const std::vector<PlanProblem> geometries{
      trammel::test::paper_problem({-10000, 50, -100}, trammel::test::kPaperCovariance, 80, {0, 0, 0}),
      trammel::test::paper_problem({-7000, 120, 60}, {90000, -1800, 1800, 144, 18, 225}, 50, {0, 0, 0}),
      trammel::test::paper_problem({-3000, 5, -8}, {3600, -90, 60, 9, -1.2, 4}, 10, {0, 0, 0}),
      trammel::test::paper_problem({-15000, -300, 200}, {2250000, 0, 0, 1600, 0, 100}, 120, {0, 0, 0})};
  for (std::size_t g = 0; g < geometries.size(); ++g) {
    for (const double beta : {1e-6, 1e-3, 0.1, 1.0, 10.0, 100.0, 1000.0}) {
      PlanProblem problem = geometries[g];
      problem.beta_per_s.x() = beta;
      expect_agreement(problem, 500, std::to_string(g) + " beta " + std::to_string(beta));
    }
  }
}

// Any feasible path costs at least the certified bound, and at least the plan's cost.
TEST(DirectTranscription, NeverBetterOnExtremeProblems) {
  // Equal steps resolve the end of the path only where it stays away from the beacon; closer ends are
  // compared with the dual bound in the tests of the plan.
  constexpr double kResolved = 20.0;  // distance at the start over that at the end
  constexpr std::uint64_t kSeed = 51;
  int compared = 0;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const PlanProblem problem = i % 2 == 0 ? trammel::test::random_problem(kSeed, i)
                                           : trammel::test::random_general_problem(kSeed, i);
    if (problem.position_m.x() / problem.final_x_m() > kResolved) {
      continue;
    }
    ++compared;
    const Plan plan = make_plan(problem);
    const double coarse = trammel::test::best_direct_cost(problem, 200);
    const double direct = trammel::test::best_direct_cost(problem, 400);
    const double quadrature =
        2.0 * std::abs(direct - coarse) + 1e-4 * plan.cost;  // right to 1e-5 at worst weights
    EXPECT_LE(quadrature, 1e-2 * plan.cost) << i;
    EXPECT_GE(direct, plan.cost - quadrature) << i << " gap " << plan.relative_gap();
    EXPECT_GE(direct, plan.lower_bound - quadrature) << i;
  }
  EXPECT_GE(compared, 40);
}

}  // namespace
