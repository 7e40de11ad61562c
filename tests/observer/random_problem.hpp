// SPDX-License-Identifier: Apache-2.0
/// @file
/// Deliberately extreme problems of the bearings-only observer.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iostream>

#include <Eigen/Core>

#include "trammel/core/random.hpp"
#include "trammel/observer/plan_problem.hpp"

namespace trammel::test {

/// Seed of the random problems; TRAMMEL_TEST_SEED tries others.
inline std::uint64_t test_seed() {
  static const std::uint64_t seed = [] {
    const char* given = std::getenv("TRAMMEL_TEST_SEED");
    const std::uint64_t drawn = given != nullptr ? std::strtoull(given, nullptr, 10) : 2011;
    std::cout << "seed " << drawn << "\n";
    return drawn;
  }();
  return seed;
}

/// 10^u, u uniform between the exponents.
inline double log_uniform(RandomStream& random, double low, double high) {
  return std::pow(10.0, low + (high - low) * random.uniform());
}

/// Speeds, distances, noises, priors over several decades, correlations up to 1 - 1e-4; every third problem
/// has a terminal point, every tenth starts on the axis, every seventh has equal lateral variances.
inline observer::PlanProblem random_problem(std::uint64_t seed, std::uint64_t index) {
  RandomStream random(seed, index);
  observer::PlanProblem problem;
  problem.speed_mps = log_uniform(random, 0.5, 3.0);
  const double end = -log_uniform(random, 0.0, 4.0);
  problem.time_to_go_s = log_uniform(random, 0.0, 2.5);
  const double start = end - problem.speed_mps * problem.time_to_go_s;
  problem.sigma0 = log_uniform(random, -4.5, -1.5);
  problem.measurement_interval_s = problem.time_to_go_s * log_uniform(random, -4.0, -1.0);
  const double sx = -start * log_uniform(random, -2.5, -0.7);
  const double sy = -start * log_uniform(random, -4.0, -1.5);
  const double sz = index % 7 == 0 ? sy : -start * log_uniform(random, -4.0, -1.5);
  // Correlation from a random unit lower-triangular factor.
  Eigen::Matrix3d factor = Eigen::Matrix3d::Identity();
  if (index % 7 != 0) {
    const double limit = log_uniform(random, -2.0, 2.0);
    factor(1, 0) = limit * random.normal();
    factor(2, 0) = limit * random.normal();
    factor(2, 1) = limit * random.normal();
  }
  for (int i = 0; i < 3; ++i) {
    factor.row(i) /= factor.row(i).norm();
  }
  const Eigen::Vector3d sigma(sx, sy, sz);
  problem.covariance_m2 = sigma.asDiagonal() * (factor * factor.transpose()) * sigma.asDiagonal();
  const double offset = index % 10 == 0 ? 0.0 : -start * log_uniform(random, -6.0, -1.0);
  const double angle = 6.283185307179586 * random.uniform();
  problem.position_m << start, offset * std::cos(angle), offset * std::sin(angle);
  if (index % 3 == 0) {
    problem.terminal_m =
        -end * log_uniform(random, -4.0, -0.5) * Eigen::Vector2d(random.normal(), random.normal());
  }
  problem.beta_per_s.x() = log_uniform(random, -8.0, 6.0);
  return problem;
}

/// The same with weights on y and z as well.
inline observer::PlanProblem random_general_problem(std::uint64_t seed, std::uint64_t index) {
  observer::PlanProblem problem = random_problem(seed, index);
  RandomStream random(seed + 1, index);
  problem.beta_per_s.y() = problem.beta_per_s.x() * log_uniform(random, -1.0, 5.0);
  problem.beta_per_s.z() = index % 5 == 0 ? 0.0 : problem.beta_per_s.x() * log_uniform(random, -1.0, 5.0);
  if (index % 11 == 0) {
    problem.beta_per_s.x() = 0.0;
  }
  return problem;
}

}  // namespace trammel::test
