// SPDX-License-Identifier: Apache-2.0
#include "trammel/certify/near_optimality.hpp"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "trammel/certify/attained.hpp"
#include "trammel/certify/block_structure.hpp"
#include "trammel/certify/certificate.hpp"
#include "trammel/certify/correlated_prior.hpp"
#include "trammel/certify/scalar_priors.hpp"
#include "trammel/certify/van_trees.hpp"
#include "trammel/core/random.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

using trammel::GuaranteedProblem;
using trammel::RandomStream;
namespace certify = trammel::certify;
namespace minimax = trammel::minimax;

constexpr std::uint64_t kSeed = 31;

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index cols, RandomStream& random) {
  Eigen::MatrixXd result(rows, cols);
  for (double& entry : result.reshaped()) {
    entry = random.normal();
  }
  return result;
}

/// `blocks` blocks of three parameters each, in mixed coordinates.
GuaranteedProblem block_problem(Eigen::Index blocks, Eigen::Index measurements, double noise,
                                std::uint64_t seed) {
  RandomStream random(seed);
  const Eigen::Index p = 3 * blocks;
  const Eigen::MatrixXd mixing = random_matrix(p, p, random);
  GuaranteedProblem problem;
  problem.information_factor = random_matrix(measurements, p, random) / noise;
  problem.criterion_factor = random_matrix(4, p, random);
  for (Eigen::Index l = 0; l < blocks; ++l) {
    problem.ellipsoids.emplace_back(mixing.middleRows(3 * l, 3));
  }
  return problem;
}

TEST(UnitBalls, AreFoundInMixedCoordinates) {
  const GuaranteedProblem problem = block_problem(3, 5, 1.0, kSeed);
  const auto balls = certify::find_unit_balls(problem, Eigen::MatrixXd::Identity(9, 9));
  ASSERT_TRUE(balls.has_value());
  RandomStream random(kSeed);
  const Eigen::VectorXd z = random_matrix(9, 1, random);
  const Eigen::VectorXd theta = balls->scaling * z;
  for (Eigen::Index l = 0; l < 3; ++l) {
    EXPECT_NEAR((problem.ellipsoids[static_cast<std::size_t>(l)] * theta).norm(), z.segment(3 * l, 3).norm(),
                1e-12);
  }
  EXPECT_NEAR(z.dot(balls->information * z), (problem.information_factor * theta).squaredNorm(), 1e-9);
  EXPECT_NEAR((balls->output * z).squaredNorm(), (problem.criterion_factor * theta).squaredNorm(), 1e-9);
}

TEST(UnitBalls, OverlappingEllipsoidsHaveNone) {
  GuaranteedProblem problem = block_problem(2, 5, 1.0, kSeed);
  problem.ellipsoids.emplace_back(Eigen::MatrixXd::Identity(6, 6));
  EXPECT_FALSE(certify::find_unit_balls(problem, Eigen::MatrixXd::Identity(6, 6)).has_value());
  problem.ellipsoids.pop_back();
  problem.ellipsoids.pop_back();  // the second block is free now
  const auto balls = certify::find_unit_balls(problem, Eigen::MatrixXd::Identity(6, 6));
  ASSERT_TRUE(balls.has_value());
  EXPECT_EQ(balls->blocks(), 1);
  EXPECT_EQ(balls->size(), 6);
}

TEST(NearOptimality, OneParameterHasTheKnownConstants) {
  for (const double a : {0.01, 0.5, 0.74, 1.0, 20.0}) {
    GuaranteedProblem problem;
    problem.information_factor = Eigen::MatrixXd::Constant(1, 1, std::sqrt(a));
    problem.criterion_factor = Eigen::MatrixXd::Constant(1, 1, 3.0);
    problem.ellipsoids = {Eigen::MatrixXd::Constant(1, 1, 1.0)};
    const minimax::Solution solution = minimax::solve(problem);
    EXPECT_NEAR(solution.upper, 9.0 / (1.0 + a), 1e-6);
    const auto near = certify::assess_near_optimality(problem, solution);
    EXPECT_NEAR(near.attained_fraction, 1.0, 1e-6);
    EXPECT_GE(near.any_estimator, 9.0 / (a + certify::interval_information(a, 1.0)) * (1.0 - 1e-8));
    // Never above the exact minimax risk; the two-point prior's is an upper bound of nothing, linear is.
    EXPECT_LE(near.any_estimator, solution.upper);
    EXPECT_GE(near.any_estimator, solution.upper / 1.6726);
  }
}

/// K = 0 and the top eigenvector as prior: the optimum for one ellipsoid without measurement.
minimax::Solution without_measurement(const GuaranteedProblem& problem) {
  const auto balls = certify::find_unit_balls(problem, Eigen::MatrixXd::Zero(problem.parameters(), 1));
  const trammel::linalg::SymmetricEigen eigen(balls->output.transpose() * balls->output);
  minimax::Solution solution;
  solution.status = trammel::SolveStatus::kOptimal;
  solution.gain = Eigen::MatrixXd::Zero(problem.parameters(), problem.parameters());
  solution.upper = solution.lower = eigen.eigenvalues().maxCoeff();
  solution.multipliers = Eigen::VectorXd::Constant(1, solution.upper);
  solution.prior_factor = balls->scaling * eigen.eigenvectors().rightCols(1);
  return solution;
}

TEST(NearOptimality, WithoutMeasurementTheBoundIsTheGuarantee) {
  for (std::uint64_t seed = kSeed; seed < kSeed + 5; ++seed) {
    const GuaranteedProblem problem = block_problem(1, 0, 1.0, seed);
    const minimax::Solution solution = without_measurement(problem);
    const auto near = certify::assess_near_optimality(problem, solution);
    EXPECT_NEAR(near.attained_fraction, 1.0, 1e-6) << seed;
    EXPECT_NEAR(near.any_estimator / solution.upper, 1.0, 1e-6) << seed;
  }
}

/// Largest error over random points of the bounds' common surface.
double sampled_error(const GuaranteedProblem& problem, const minimax::Solution& solution,
                     std::uint64_t seed) {
  RandomStream random(seed);
  const Eigen::Index p = problem.parameters();
  const Eigen::MatrixXd& f = problem.information_factor;
  const Eigen::MatrixXd bias =
      problem.criterion_factor * (solution.gain * f.transpose() * f - Eigen::MatrixXd::Identity(p, p));
  double largest = 0.0;
  for (int n = 0; n < 3000; ++n) {
    Eigen::VectorXd theta = solution.prior_factor * random_matrix(solution.prior_factor.cols(), 1, random);
    double size = 0.0;
    for (const Eigen::MatrixXd& factor : problem.ellipsoids) {
      size = std::max(size, (factor * theta).norm());
    }
    largest = std::max(largest, (bias * theta).squaredNorm() / (size * size));
  }
  return largest + (problem.criterion_factor * solution.gain * f.transpose()).squaredNorm();
}

TEST(NearOptimality, NearlyWithoutNoiseEveryBoundTies) {
  const GuaranteedProblem problem = block_problem(2, 9, 1e-6, kSeed);
  const minimax::Solution solution = minimax::solve(problem);
  const auto balls = certify::find_unit_balls(problem, solution.prior_factor);
  ASSERT_TRUE(balls.has_value());
  for (const double bound : {certify::box_bound(*balls), certify::ball_bound(*balls),
                             certify::correlated_bound(problem, solution.prior_factor)}) {
    EXPECT_NEAR(bound / solution.upper, 1.0, 1e-4);
    EXPECT_LE(bound, solution.upper);
  }
}

TEST(NearOptimality, BoundsNeverExceedTheGuarantee) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  for (std::uint64_t n = 0; n < 12; ++n) {
    GuaranteedProblem problem =
        block_problem(3, static_cast<Eigen::Index>(n % 4) * 3, std::pow(10.0, n % 5 - 2.0), kSeed + n);
    if (n % 3 == 2) {  // overlapping ellipsoids
      RandomStream random(kSeed + n);
      problem.ellipsoids.push_back(random_matrix(9, 9, random));
    }
    const minimax::Solution solution = minimax::solve(problem);
    const auto near = certify::assess_near_optimality(problem, solution);
    EXPECT_LE(near.any_estimator, solution.upper) << n;
    EXPECT_GT(near.any_estimator, 0.0) << n;
    EXPECT_LE(near.attained_fraction, 1.0 + 1e-9) << n;
    EXPECT_GE(near.attained * (1.0 + 1e-9), sampled_error(problem, solution, kSeed)) << n;
    for (const Eigen::MatrixXd& factor : problem.ellipsoids) {
      EXPECT_LE((factor * near.worst_case).norm(), 1.0 + 1e-12);
    }
  }
}

struct Row {
  trammel::zoo::Instance instance;
  double any_estimator_rms_m;  ///< reached by an independent implementation with the same kinds of priors
  double monte_carlo_rms_m;    ///< its Monte Carlo bound
};

std::vector<Row> table() {
  return {{trammel::zoo::manoeuvre(), 139.1, 139.3},
          {trammel::zoo::manoeuvre_noisy(), 779.9, 832.4},
          {trammel::zoo::r20(), 144.2, 151.6},
          {trammel::zoo::r40_noisy(), 778.7, 820.5}};
}

TEST(NearOptimality, ReachesTheTableForTheManoeuvres) {
  for (const Row& row : table()) {
    const auto assembled = trammel::assemble(row.instance.scenario);
    minimax::Solution solution = minimax::solve(assembled.problem);
    static_cast<void>(certify::certify(assembled.problem, {}, solution));
    const auto near = certify::assess_near_optimality(assembled.problem, solution);
    const double any_estimator = std::sqrt(near.any_estimator);
    RecordProperty(std::string(row.instance.name) + "_any_estimator_m", std::to_string(any_estimator));
    EXPECT_NEAR(near.attained_fraction, 1.0, 1e-6) << row.instance.name;
    EXPECT_GE(any_estimator, 0.995 * row.any_estimator_rms_m) << row.instance.name;
    EXPECT_LE(any_estimator, row.instance.optimum->lower_rms_m) << row.instance.name;
  }
}

TEST(NearOptimality, MonteCarloBoundAgreesWithTheTable) {
  for (const Row& row : {table()[0], table()[1], table()[2]}) {
    const auto assembled = trammel::assemble(row.instance.scenario);
    const minimax::Solution solution = minimax::solve(assembled.problem);
    const auto bound =
        certify::palindromic_bound(assembled.problem, solution.prior_factor, {.samples = 12000});
    ASSERT_TRUE(bound.has_value());
    RecordProperty(std::string(row.instance.name) + "_monte_carlo_m",
                   std::to_string(std::sqrt(bound->bound)));
    EXPECT_LE(std::sqrt(bound->bound), row.instance.optimum->upper_rms_m);
    // The table took up to twice as many samples; what that costs the confidence limit is below one per cent.
    EXPECT_GE(std::sqrt(bound->bound), 0.99 * row.monte_carlo_rms_m) << row.instance.name;
    EXPECT_GT(std::sqrt(bound->mean - 4.0 * bound->standard_error), 0.99 * row.monte_carlo_rms_m);
  }
}

TEST(Palindromic, HardlyTruncatedGaussianIsTheLinearRisk) {
  // Bounds far beyond the prior's width: the Bayes risk is tr S (V^-1 + J)^-1 and the chain, which then mixes
  // in one step, must not exceed it by more than its error.
  const GuaranteedProblem problem = block_problem(2, 3, 1.0, kSeed);
  const Eigen::MatrixXd prior_factor =
      0.05 * certify::find_unit_balls(problem, Eigen::MatrixXd::Identity(6, 6))->scaling;
  const Eigen::MatrixXd seen = problem.information_factor * prior_factor;
  const Eigen::MatrixXd output = problem.criterion_factor * prior_factor;
  const auto risk = [&](double k) {
    const Eigen::MatrixXd m = Eigen::MatrixXd::Identity(6, 6) + k * seen.transpose() * seen;
    return k * (output * trammel::linalg::Cholesky(m).solve(output.transpose())).trace();
  };
  const auto bound = certify::palindromic_bound(problem, prior_factor, {.samples = 4000});
  ASSERT_TRUE(bound.has_value());
  if (bound->prior == certify::SampledPrior::kTruncatedGaussian) {
    EXPECT_NEAR(bound->mean, risk(bound->prior_scale), 5.0 * bound->standard_error);
  }
  EXPECT_LT(bound->bound, bound->mean);
}

TEST(Palindromic, SameSeedSameNumbers) {
  const GuaranteedProblem problem = block_problem(2, 3, 1.0, kSeed);
  const minimax::Solution solution = minimax::solve(problem);
  const auto once = certify::palindromic_bound(problem, solution.prior_factor, {.samples = 200});
  const auto again = certify::palindromic_bound(problem, solution.prior_factor, {.samples = 200});
  ASSERT_TRUE(once && again);
  EXPECT_EQ(once->bound, again->bound);
}

TEST(NearOptimality, SentenceForTheUser) {
  certify::NearOptimality near;
  near.attained = 940.5 * 940.5;
  near.attained_fraction = 1.0;
  near.any_estimator = 779.9 * 779.9;
  near.kind = certify::AnyEstimatorBound::kBox;
  EXPECT_EQ(
      certify::describe(near, 940.5 * 940.5, "m"),
      "Guaranteed rms error 940.5 m, attained by an admissible motion; no estimator of any kind, however "
      "computed, can guarantee less than 779.9 m (proved): at most 17.1 % can be gained.");
  near.monte_carlo = certify::PalindromicBound{.bound = 832.4 * 832.4};
  near.confidence = 0.999;
  EXPECT_EQ(
      certify::describe(near, 940.5 * 940.5, "m"),
      "Guaranteed rms error 940.5 m, attained by an admissible motion; no estimator of any kind, however "
      "computed, can guarantee less than 779.9 m (proved; 832.4 m at 99.9 % Monte Carlo confidence): at most "
      "11.5 % can be gained.");
}

TEST(NearOptimality, EverySettingIsDescribed) {
  int fields = 0;
  certify::NearOptimalitySettings settings;
  visit_fields(settings, [&fields](const trammel::FieldDoc& doc, auto&) {
    EXPECT_FALSE(doc.meaning.empty());
    ++fields;
  });
  EXPECT_EQ(fields, 5);
}

}  // namespace
