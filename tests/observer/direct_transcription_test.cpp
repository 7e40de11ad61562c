// SPDX-License-Identifier: Apache-2.0
#include "direct_transcription.hpp"

#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "cases.hpp"
#include "random_problem.hpp"
#include "trammel/observer/plan.hpp"

namespace {

using trammel::observer::make_plan;
using trammel::observer::Plan;
using trammel::observer::PlanProblem;
using trammel::observer::PlanStatus;

constexpr double kNeverBetter = 1e-9;
constexpr double kClose = 1e-4;

/// No control found from starts that know nothing of the plan, or from the plan's own path, costs less than
/// the plan; the best of them comes close to it.
void expect_agreement(const PlanProblem& problem, int steps, const std::string& name) {
  const Plan plan = make_plan(problem);
  const trammel::test::DirectTranscription direct(problem, steps);
  const double independent = trammel::test::best_direct_cost(direct, problem.speed_mps);
  const double along_the_plan = direct.minimise(direct.from_path(plan.path));
  EXPECT_GE(independent, plan.cost * (1.0 - kNeverBetter)) << name << " gap " << plan.relative_gap();
  EXPECT_GE(along_the_plan, plan.cost * (1.0 - kNeverBetter)) << name << " gap " << plan.relative_gap();
  EXPECT_LE(along_the_plan, plan.cost * (1.0 + kClose)) << name;
  if (plan.status == PlanStatus::kOptimal) {
    EXPECT_LE(independent, plan.cost * (1.0 + kClose)) << name;
  }
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

TEST(DirectTranscription, ExtremeProblems) {
  for (std::uint64_t i = 0; i < 400; ++i) {
    expect_agreement(i % 2 == 0 ? trammel::test::random_problem(trammel::test::test_seed(), i)
                                : trammel::test::random_general_problem(trammel::test::test_seed(), i),
                     400, std::to_string(i));
  }
}

}  // namespace
