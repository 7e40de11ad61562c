// SPDX-License-Identifier: Apache-2.0
// The formulas as Emelyanov and Rubinovich (2020) print them, against the regular forms the library uses.
// Away from xi = 0 and xi = pi they agree; (3.19) is printed without the factor 1/sigma.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "cases.hpp"
#include "trammel/observer/plan.hpp"

namespace {

using trammel::observer::make_plan;
using trammel::observer::Plan;
using trammel::observer::PlanProblem;

/// Problems that the printed formulas describe: end on the axis, start off it, some weight.
std::vector<PlanProblem> literal_problems() {
  std::vector<PlanProblem> problems;
  for (const auto& reference : trammel::test::kReferencePlans) {
    const PlanProblem problem = trammel::test::problem_of(reference);
    if (problem.terminal_m.norm() == 0.0 && problem.position_m.tail<2>().norm() > 0.0) {
      problems.push_back(problem);
    }
  }
  return problems;
}

// (3.9), (3.10)
TEST(LiteralFormulas, Path) {
  for (const PlanProblem& problem : literal_problems()) {
    const Plan plan = make_plan(problem);
    const double x0 = problem.position_m.x();
    const double a = problem.final_x_m();
    const double eps = plan.epsilon_m;
    const Eigen::Vector2d start = problem.position_m.tail<2>() / x0;
    for (int k = 0; k <= 20; ++k) {
      const double x = x0 + (a - x0) * k / 20.0;
      const Eigen::Vector2d literal = x / std::sin(plan.xi) *
                                          (plan.wave_centre * std::sin(eps / x - eps / x0) +
                                           (start - plan.wave_centre) * std::sin(eps / x - eps / a)) +
                                      plan.wave_centre * x;
      EXPECT_LT((plan.path.position(x) - literal).norm(), 1e-9 * problem.position_m.norm());
    }
  }
}

// (3.11)-(3.13)
TEST(LiteralFormulas, StationarityConditions) {
  for (const PlanProblem& problem : literal_problems()) {
    const Plan plan = make_plan(problem);
    const Eigen::Matrix3d& g = plan.final_covariance_m2;
    const Eigen::Vector3d& beta = problem.beta_per_s;
    const double sigma = problem.sigma0 * std::sqrt(problem.measurement_interval_s);
    const double square = beta.dot(g.col(0).cwiseAbs2());
    EXPECT_NEAR(plan.epsilon_m, std::sqrt(square) / (sigma * problem.speed_mps), 1e-8 * plan.epsilon_m);
    const double b1 =
        (g(0, 1) * (beta.x() * g(0, 0) + beta.y() * g(1, 1)) + beta.z() * g(0, 2) * g(1, 2)) / square;
    const double b2 =
        (g(0, 2) * (beta.x() * g(0, 0) + beta.z() * g(2, 2)) + beta.y() * g(0, 1) * g(1, 2)) / square;
    const double scale = plan.wave_centre.norm();
    EXPECT_NEAR(plan.wave_centre.x(), b1, 1e-8 * scale);
    EXPECT_NEAR(plan.wave_centre.y(), b2, 1e-8 * scale);
  }
}

// (3.17) and (3.19), the latter corrected
TEST(LiteralFormulas, SingleWeight) {
  for (const PlanProblem& problem : literal_problems()) {
    if (problem.beta_per_s.tail<2>().norm() > 0.0) {
      continue;
    }
    const Plan plan = make_plan(problem);
    const double xi = plan.xi;
    const double gain = plan.information_gain;
    const double sigma = problem.sigma0 * std::sqrt(problem.measurement_interval_s);
    const Eigen::Matrix3d d = problem.covariance_m2.inverse();
    const Eigen::Vector2d start = problem.position_m.tail<2>() / problem.position_m.x();
    const Eigen::Vector2d& b = plan.wave_centre;
    const Eigen::Vector2d w = 0.5 * start - b;
    const double right = d(0, 0) + b.x() * b.x() * d(1, 1) + b.y() * b.y() * d(2, 2) + 2.0 * b.x() * d(0, 1) +
                         2.0 * b.y() * d(0, 2) + 2.0 * b.x() * b.y() * d(1, 2) +
                         gain / xi *
                             (0.25 * start.squaredNorm() * (xi - std::sin(xi)) / (1.0 - std::cos(xi)) +
                              w.squaredNorm() * (xi + std::sin(xi)) / (1.0 + std::cos(xi)));
    const double left = sigma * gain * std::sqrt(problem.beta_per_s.x()) / xi;
    EXPECT_NEAR(left, right, 1e-7 * left);
    EXPECT_NEAR(plan.cost_information, xi * std::sqrt(problem.beta_per_s.x()) / (sigma * gain),
                1e-9 * plan.cost_information);
  }
}

}  // namespace
