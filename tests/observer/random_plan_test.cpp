// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <iostream>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "random_problem.hpp"
#include "trammel/observer/general_weight.hpp"
#include "trammel/observer/plan.hpp"
#include "trammel/observer/single_weight.hpp"

namespace {

using trammel::observer::ChannelProblem;
using trammel::observer::Frequency;
using trammel::observer::make_plan;
using trammel::observer::Plan;
using trammel::observer::PlanProblem;
using trammel::observer::PlanStatus;
using trammel::test::test_seed;

bool is_finite(const Plan& plan) {
  return std::isfinite(plan.cost) && std::isfinite(plan.lower_bound) && plan.information.allFinite() &&
         plan.final_covariance_m2.allFinite() && std::isfinite(plan.xi) && plan.wave_centre.allFinite();
}

TEST(RandomPlan, SingleWeightAlwaysCertified) {
  constexpr int kProblems = 10000;
  int most = 0;
  double widest = 0.0;
  for (int i = 0; i < kProblems; ++i) {
    const PlanProblem problem = trammel::test::random_problem(test_seed(), static_cast<std::uint64_t>(i));
    const Plan plan = make_plan(problem);
    ASSERT_TRUE(is_finite(plan)) << i;
    EXPECT_GE(plan.xi, 0.0) << i;
    EXPECT_LE(plan.xi, plan.xi_critical) << i;
    EXPECT_EQ(plan.status, PlanStatus::kOptimal) << i << " gap " << plan.relative_gap();
    most = std::max(most, plan.evaluations);
    widest = std::max(widest, plan.relative_gap());
  }
  std::cout << "most evaluations " << most << ", largest gap " << widest << "\n";
  EXPECT_LE(most, 100);
}

TEST(RandomPlan, SecularFunctionStrictlyIncreases) {
  constexpr int kProblems = 10000;
  constexpr int kPoints = 300;
  for (int i = 0; i < kProblems; ++i) {
    const ChannelProblem problem(trammel::test::random_problem(test_seed(), static_cast<std::uint64_t>(i)));
    const double critical = problem.critical_frequency();
    double previous = 0.0;
    for (int k = 1; k < kPoints; ++k) {
      const double xi = critical * k / kPoints;
      const auto q = trammel::observer::detail::secular(problem, Frequency(xi));
      ASSERT_GT(q.value, previous) << "problem " << i << " xi " << xi;
      ASSERT_GT(q.slope, 0.0) << "problem " << i << " xi " << xi;
      previous = q.value;
    }
  }
}

TEST(RandomPlan, SlopeOfTheSecularFunction) {
  for (int i = 0; i < 200; ++i) {
    const ChannelProblem problem(trammel::test::random_problem(test_seed(), static_cast<std::uint64_t>(i)));
    for (const double part : {1e-3, 0.1, 0.17, 0.3, 0.5, 0.9}) {
      const double xi = part * problem.critical_frequency();
      const double h = 1e-5 * xi;
      const auto at = [&](double x) { return trammel::observer::detail::secular(problem, Frequency(x)); };
      const double difference = (at(xi + h).value - at(xi - h).value) / (2.0 * h);
      EXPECT_NEAR(at(xi).slope, difference, 1e-6 * std::abs(difference)) << i << " " << part;
    }
  }
}

TEST(RandomPlan, GeneralWeights) {
  constexpr int kProblems = 2000;
  int certified = 0;
  double widest = 0.0;
  for (int i = 0; i < kProblems; ++i) {
    const PlanProblem problem =
        trammel::test::random_general_problem(test_seed(), static_cast<std::uint64_t>(i));
    const Plan plan = make_plan(problem);
    ASSERT_TRUE(is_finite(plan)) << i;
    EXPECT_LE(plan.lower_bound, plan.cost) << i;
    PlanProblem unweighted = problem;
    unweighted.beta_per_s.setZero();
    const Plan straight = make_plan(unweighted);
    const double straight_cost =
        straight.cost_control + problem.beta_per_s.dot(straight.final_covariance_m2.diagonal());
    EXPECT_LE(plan.cost, straight_cost * (1.0 + 1e-12))
        << i << " excess " << plan.cost / straight_cost - 1.0 << " gap " << plan.relative_gap();
    certified += static_cast<int>(plan.status == PlanStatus::kOptimal);
    widest = std::max(widest, plan.relative_gap());
  }
  std::cout << certified << " of " << kProblems << " certified, largest gap " << widest << "\n";
  EXPECT_GE(certified, kProblems * 85 / 100);
  EXPECT_LE(widest, 0.5);
}

// Without lateral weights the dual method must find what the single-weight method finds.
TEST(RandomPlan, DualMethodAgreesWithTheSingleWeight) {
  for (int i = 0; i < 300; ++i) {
    const PlanProblem problem = trammel::test::random_problem(test_seed(), static_cast<std::uint64_t>(i));
    const ChannelProblem channels(problem);
    const auto single = trammel::observer::solve_single_weight(channels, problem.beta_per_s.x());
    const auto general = trammel::observer::solve_general_weight(channels, problem.beta_per_s);
    const trammel::observer::GeneralWeightDual dual(channels, problem.beta_per_s);
    const double cost = dual.cost(single.shape);
    EXPECT_LE(general.lower_bound, cost * (1.0 + 1e-9)) << i;
    EXPECT_NEAR(dual.cost(general.shape), cost, 1e-8 * cost) << i;
  }
}

// D(T) is the prior information plus the integral of H'H/sigma^2 along the path that the plan returns, and J
// the sum of its parts along it.
TEST(RandomPlan, InformationAndEnergyByQuadrature) {
  constexpr int kPanels = 8000;
  for (int i = 0; i < 60; ++i) {
    const PlanProblem problem =
        i % 2 == 0 ? trammel::test::random_problem(test_seed(), static_cast<std::uint64_t>(i))
                   : trammel::test::random_general_problem(test_seed(), static_cast<std::uint64_t>(i));
    const Plan plan = make_plan(problem);
    const double a = problem.final_x_m();
    const double logarithm = std::log(a / problem.position_m.x());
    const double variance = problem.sigma0 * problem.sigma0 * problem.measurement_interval_s;
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    double energy = 0.0;
    // Simpson's rule in log |x|, which resolves both ends.
    for (int k = 0; k <= kPanels; ++k) {
      const double x = problem.position_m.x() * std::exp(logarithm * k / kPanels);
      const double weight =
          (k == 0 || k == kPanels ? 1.0 : (k % 2 == 1 ? 4.0 : 2.0)) * logarithm / (3.0 * kPanels);
      const double dt = weight * x / problem.speed_mps;
      const Eigen::Vector2d tangent = plan.path.position(x) / x;
      Eigen::Matrix<double, 2, 3> h;
      h << -tangent.x(), 1, 0, -tangent.y(), 0, 1;
      sum += h.transpose() * h * (dt / (x * x) / variance);
      energy += plan.path.velocity(x).squaredNorm() * dt;
    }
    const Eigen::Matrix3d prior = problem.covariance_m2.llt().solve(Eigen::Matrix3d::Identity());
    // What the inverse of a strongly correlated prior loses to rounding.
    const double rounding = 3e-15 * prior.diagonal().cwiseProduct(problem.covariance_m2.diagonal()).sum();
    const Eigen::Matrix3d expected = prior + sum;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(plan.information(r, c), expected(r, c),
                    (1e-8 + rounding) * std::sqrt(expected(r, r) * expected(c, c)))
            << i;
      }
    }
    EXPECT_NEAR(plan.cost_control, energy, 1e-8 * energy + 1e-300) << i;
    EXPECT_NEAR(plan.path.position(problem.position_m.x()).x(), problem.position_m.y(),
                1e-10 * problem.position_m.norm());
    EXPECT_NEAR(plan.path.position(a).y(), problem.terminal_m.y(), 1e-10 * problem.position_m.norm());
  }
}

}  // namespace
