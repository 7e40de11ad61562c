// SPDX-License-Identifier: Apache-2.0
// Hard raw problems from file to verified interval.
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "io/document.hpp"
#include "io/raw_problem.hpp"
#include "trammel/certify/certificate.hpp"
#include "trammel/core/random.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

namespace certify = trammel::certify;
namespace minimax = trammel::minimax;
using trammel::GuaranteedProblem;

struct Interval {
  std::string name;
  double lower;
  double upper;
};

minimax::Solution solve_and_verify(const GuaranteedProblem& problem) {
  minimax::Solution solution = minimax::solve(problem);
  static_cast<void>(certify::certify(problem, {}, solution));
  return solution;
}

TEST(RawProblems, ReferenceIntervalsAreMet) {
  const std::filesystem::path folder =
      std::filesystem::path(TRAMMEL_SOURCE_DIR) / ".." / "shared" / "reference" / "raw-problems";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "the reference problems are not there";
  }
  const std::vector<Interval> expected{{"base27", 0.044391576687, 0.0443915780451},
                                       {"wild_rho", 4.62825647985e-05, 4.62825652612e-05},
                                       {"fewobs", 23.6969798933, 23.6969813197},
                                       {"units", 0.0231320016248, 0.0231320018547},
                                       {"rank1_S", 0.000142366973339, 0.000142366974763}};
  for (const Interval& interval : expected) {
    const auto raw = trammel::io::read_raw_problem(folder / (interval.name + ".json"));
    const minimax::Solution solution = solve_and_verify(raw.problem);
    EXPECT_EQ(solution.claim, trammel::Claim::kVerified) << interval.name;
    EXPECT_EQ(solution.status, trammel::SolveStatus::kOptimal) << interval.name;
    EXPECT_LE(solution.relative_gap(), 1e-8) << interval.name;
    EXPECT_LE(solution.lower, interval.upper) << interval.name;
    EXPECT_GE(solution.upper, interval.lower) << interval.name;
  }
}

/// Motion along a line over `segments` equal segments: position, velocity, accelerations; positions measured
/// at `times`, the acceleration of each segment bounded, position and velocity only where `bounded`.
GuaranteedProblem line_motion(Eigen::Index segments, const std::vector<double>& times, double noise,
                              double acceleration, bool bounded) {
  const Eigen::Index p = segments + 2;
  const auto row = [&](double t) {
    Eigen::RowVectorXd result(p);
    result(0) = 1.0;
    result(1) = t;
    for (Eigen::Index i = 0; i < segments; ++i) {
      const double inside = std::min(std::max(t - static_cast<double>(i), 0.0), 1.0);
      result(i + 2) = inside * inside / 2.0 + inside * std::max(t - static_cast<double>(i) - 1.0, 0.0);
    }
    return result;
  };
  GuaranteedProblem problem;
  problem.information_factor.resize(static_cast<Eigen::Index>(times.size()), p);
  for (std::size_t k = 0; k < times.size(); ++k) {
    problem.information_factor.row(static_cast<Eigen::Index>(k)) = row(times[k]) / noise;
  }
  constexpr Eigen::Index kOutputs = 60;
  problem.criterion_factor.resize(kOutputs, p);
  for (Eigen::Index k = 0; k < kOutputs; ++k) {
    problem.criterion_factor.row(k) =
        row(static_cast<double>(segments * k) / (kOutputs - 1)) / std::sqrt(static_cast<double>(kOutputs));
  }
  for (Eigen::Index j = bounded ? 0 : 2; j < p; ++j) {
    Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(1, p);
    factor(0, j) = 1.0 / (j < 2 ? 100.0 : acceleration);
    problem.ellipsoids.push_back(factor);
  }
  return problem;
}

std::vector<double> grid(double start, double stop, int count) {
  std::vector<double> result;
  for (int k = 0; k < count; ++k) {
    result.push_back(start + (stop - start) * k / (count - 1));
  }
  return result;
}

void expect_solved(const GuaranteedProblem& problem, const std::string& name) {
  const minimax::Solution solution = solve_and_verify(problem);
  EXPECT_EQ(solution.claim, trammel::Claim::kVerified) << name;
  EXPECT_LE(solution.relative_gap(), 1e-6) << name;
  EXPECT_GE(solution.relative_gap(), 0.0) << name;
}

TEST(RawProblems, KindsThatBreakGeneralSolvers) {
  expect_solved(line_motion(12, grid(0.0, 12.0, 25), 5.0, 3.0, false), "only accelerations bounded");
  expect_solved(line_motion(12, grid(3.0, 3.24, 25), 5.0, 3.0, true), "measured in two percent of the time");
  expect_solved(line_motion(12, grid(0.0, 12.0, 25), 5.0, 1e-9, true), "accelerations bounded by 1e-9");
  // Columns scaled by powers of ten between -5 and 5.
  GuaranteedProblem scaled = line_motion(12, grid(0.0, 12.0, 25), 5.0, 3.0, true);
  trammel::RandomStream random(5);
  for (Eigen::Index j = 0; j < scaled.parameters(); ++j) {
    const double factor = std::pow(10.0, 10.0 * random.uniform() - 5.0);
    scaled.information_factor.col(j) *= factor;
    scaled.criterion_factor.col(j) *= factor;
    for (Eigen::MatrixXd& ellipsoid : scaled.ellipsoids) {
      ellipsoid.col(j) *= factor;
    }
  }
  expect_solved(scaled, "units");
  GuaranteedProblem one_output = line_motion(12, grid(0.0, 12.0, 25), 5.0, 3.0, true);
  one_output.criterion_factor = one_output.criterion_factor.row(7).eval();
  expect_solved(one_output, "one output");
}

// In truncated powers over a long flight one rounding of the entries of K alone moves the bound by more than
// the solver's gap: the rounding has to spare K J.
TEST(RawProblems, TruncatedPowersOverALongFlight) {
  for (const Eigen::Index segments : {7, 18, 48}) {
    const GuaranteedProblem problem = trammel::zoo::truncated_powers(segments, 3000);
    minimax::Solution solution = minimax::solve(problem);
    const certify::Certificate before = certify::verify(problem, solution);
    const certify::Certificate after = certify::certify(problem, {}, solution);
    RecordProperty("gap_1e-9_before_" + std::to_string(segments),
                   std::to_string(before.relative_gap() * 1e9));
    RecordProperty("gap_1e-9_after_" + std::to_string(segments), std::to_string(after.relative_gap() * 1e9));
    EXPECT_EQ(after.claim, trammel::Claim::kVerified) << segments;
    EXPECT_EQ(solution.status, trammel::SolveStatus::kOptimal) << segments;
    EXPECT_LE(after.relative_gap(), 1.1e-8) << segments;
    EXPECT_LE(after.relative_gap(), before.relative_gap()) << segments;
    EXPECT_LE(before.lower, after.upper * (1.0 + 1e-15)) << segments;
  }
}

// The wide prior of directions that nothing bounds must not drown the rounding errors of the others.
TEST(RawProblems, TruncatedPowersWithoutBoundsOfPositionAndVelocity) {
  for (const Eigen::Index segments : {7, 30}) {
    GuaranteedProblem problem = trammel::zoo::truncated_powers(segments, 60);
    problem.ellipsoids.erase(problem.ellipsoids.begin(), problem.ellipsoids.begin() + 2);
    minimax::Solution solution = minimax::solve(problem);
    const certify::Certificate certificate = certify::certify(problem, {}, solution);
    EXPECT_EQ(certificate.claim, trammel::Claim::kVerified) << segments;
    EXPECT_EQ(certificate.envelope.rows(), 6) << segments;
    EXPECT_LE(certificate.relative_gap(), 1.1e-8) << segments;
  }
}

}  // namespace
