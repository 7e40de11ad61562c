// SPDX-License-Identifier: Apache-2.0
#include "trammel/window/solve.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/estimate/trajectory_estimate.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

using namespace trammel;
using linalg::BandedMatrix;

Eigen::MatrixXd dense(const BandedMatrix& A) { return A.block(0, 0, A.size(), A.size()); }

/// The long flight with segments of two lengths and bounds that differ by axis and segment.
Scenario uneven_flight(int segments) {
  Scenario scenario = zoo::long_flight(segments).scenario;
  for (std::size_t i = 1; i + 1 < scenario.knots_s.size(); i += 2) {
    scenario.knots_s[i] -= 3.0;
  }
  for (std::size_t i = 0; i < scenario.segments(); ++i) {
    scenario.bounds.acceleration_mps2[i] = {6.0, 8.0, i % 5 == 0 ? 2.0 : 4.0};
  }
  return scenario;
}

TEST(BandedProblem, IsTheDenseOneInSplineCoefficients) {
  const Scenario scenario = uneven_flight(9);
  const BandedProblem banded = assemble_banded(scenario);
  const TrajectoryProblem whole = assemble(scenario);
  const auto same = [&](const Eigen::MatrixXd& in_c, const Eigen::MatrixXd& in_z) {
    const Eigen::MatrixXd moved = whole.coordinates.restrict_rows(in_c);
    const Eigen::MatrixXd difference = moved.transpose() * moved - in_z.transpose() * in_z;
    return difference.norm() < 1e-9 * (in_z.transpose() * in_z).norm();
  };
  EXPECT_TRUE(same(dense(banded.information_factor), whole.problem.information_factor));
  EXPECT_TRUE(same(dense(banded.criterion_factor), whole.problem.criterion_factor));
  const Eigen::MatrixXd bounds = dense(banded.bounds);
  for (Eigen::Index l = 0; l < 11; ++l) {
    EXPECT_TRUE(same(bounds.middleRows(3 * l, 3), whole.problem.ellipsoids[static_cast<std::size_t>(l)]));
  }
}

TEST(BandedProblem, SaysWhatStandsInTheWay) {
  const auto refused = [](const auto& change) {
    Scenario scenario = zoo::long_flight(12).scenario;
    change(scenario);
    EXPECT_THROW((void)assemble_banded(scenario), Error);
  };
  refused([](Scenario& s) { s.criterion.kind = CriterionKind::kFinal; });
  refused([](Scenario& s) { s.bounds.acceleration_mps2[2].z() = 0.0; });
  refused([](Scenario& s) { s.bounds.acceleration_mps2[2].z() = std::numeric_limits<double>::infinity(); });
  refused([](Scenario& s) { s.stations[0].bias.time_s = 0.1; });
  refused([](Scenario& s) {
    for (Station& station : s.stations) {
      std::erase_if(station.times_s, [](double t) { return t > 15.0 && t < 85.0; });
    }
  });
}

TEST(Windows, HoldTheKnownOptimum) {
  for (const int segments : {40, 98}) {
    const zoo::Instance instance = zoo::long_flight(segments);
    const window::WindowSolution solution = window::solve_windows(assemble_banded(instance.scenario));
    const window::BandedCertificate& proved = solution.certificate;
    EXPECT_EQ(solution.status, SolveStatus::kOptimal);
    EXPECT_EQ(proved.claim, Claim::kVerified) << proved.remark;
    EXPECT_EQ(solution.windows, (segments + 19) / 20);
    EXPECT_LE(std::sqrt(proved.lower), instance.optimum->upper_rms_m);
    EXPECT_GE(std::sqrt(proved.upper), instance.optimum->lower_rms_m);
    EXPECT_LE(proved.upper - proved.lower, 1e-5 * proved.upper);
  }
}

// Every statement of the certificate, recomputed with dense matrices from the estimator itself.
TEST(Windows, ProveWhatDenseMatricesConfirm) {
  Scenario scenario = uneven_flight(45);
  scenario.bounds.velocity_mps.setConstant(std::numeric_limits<double>::infinity());
  constexpr double kWideGap = 1e-3;  // some windows have a nearly singular prior
  const BandedProblem problem = assemble_banded(scenario);
  const window::WindowSolution solution =
      window::solve_windows(problem, {.core = 8, .overlap = 12, .relative_gap = kWideGap});
  ASSERT_EQ(solution.status, SolveStatus::kOptimal) << solution.certificate.remark;
  const Eigen::MatrixXd C = dense(problem.criterion_factor);
  const Eigen::MatrixXd F = dense(problem.information_factor);
  const Eigen::MatrixXd D = dense(problem.bounds);
  const Eigen::MatrixXd J = F.transpose() * F;
  const Eigen::MatrixXd W = dense(solution.estimator.bias) * solution.estimator.root.asDiagonal();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(J.rows(), J.rows());
  const Eigen::MatrixXd gain = linalg::Cholesky(J).solve((identity + W * D).transpose()).transpose();
  const double noise = (C * gain * F.transpose()).squaredNorm();
  const Eigen::VectorXd& lambda = solution.certificate.multipliers;
  EXPECT_LE(noise + lambda.sum(), solution.certificate.upper);
  EXPECT_NEAR(noise + lambda.sum(), solution.certificate.upper, 1e-7 * solution.certificate.upper);
  Eigen::MatrixXd slack = -(C * W).transpose() * (C * W);
  for (Eigen::Index i = 0; i < slack.rows(); ++i) {
    slack(i, i) += lambda(i / 3);
  }
  const linalg::SymmetricEigen spectrum(slack, Eigen::EigenvaluesOnly);
  EXPECT_GT(spectrum.eigenvalues()(0), -1e-12 * spectrum.eigenvalues()(slack.rows() - 1));
  // And the dense solver's interval overlaps with it.
  const minimax::Solution whole = minimax::solve(assemble(scenario).problem);
  EXPECT_LE(solution.certificate.lower, whole.upper);
  EXPECT_GE(solution.certificate.upper, whole.lower);
  EXPECT_LE(solution.certificate.upper - whole.lower, kWideGap * whole.upper);
}

// Errors of the estimate for random motions on the boundary of the bounds stay within the guarantee, and so
// do those of a single window's path.
TEST(Windows, GuaranteeHoldsForAdmissibleMotions) {
  const Scenario scenario = zoo::long_flight(60).scenario;
  const BandedProblem problem = assemble_banded(scenario);
  const window::WindowSolution solution = window::solve_windows(problem, {.core = 10, .overlap = 12});
  const Eigen::MatrixXd C = dense(problem.criterion_factor);
  const linalg::Cholesky information([&] {
    const Eigen::MatrixXd F = dense(problem.information_factor);
    return Eigen::MatrixXd(F.transpose() * F);
  }());
  const Eigen::MatrixXd W = dense(solution.estimator.bias) * solution.estimator.root.asDiagonal();
  const Eigen::MatrixXd D = dense(problem.bounds);
  const double noise = solution.certificate.upper - solution.certificate.multipliers.sum();
  double worst = 0.0;
  RandomStream stream(7);
  for (int k = 0; k < 200; ++k) {
    Eigen::VectorXd u(D.rows());
    const double smooth = k % 4 == 0 ? 0.0 : 0.9 - 0.2 * (k % 4);
    Eigen::Vector3d direction = Eigen::Vector3d::Zero();
    for (Eigen::Index l = 0; l < D.rows() / 3; ++l) {
      direction = (smooth * direction + Eigen::Vector3d(stream.normal(), stream.normal(), stream.normal()))
                      .normalized();
      u.segment<3>(3 * l) = (k % 2 == 1 && l % 2 == 1 ? -1.0 : 1.0) * direction;
    }
    worst = std::max(worst, (C * (W * u)).squaredNorm());
  }
  EXPECT_LE(noise + worst, solution.certificate.upper);
  EXPECT_GT(worst, 0.2 * solution.certificate.multipliers.sum());
}

TEST(Windows, AThousandSegmentsInSeconds) {
  const window::WindowSolution solution =
      window::solve_windows(assemble_banded(zoo::long_flight(1000).scenario));
  EXPECT_EQ(solution.certificate.claim, Claim::kVerified);
  EXPECT_LE(solution.certificate.upper - solution.certificate.lower, 1e-5 * solution.certificate.upper);
}

// Where the noise hides the manoeuvres the least favourable prior is nearly singular: the interval becomes
// wider, but it still holds the optimum.
TEST(Windows, NoisyFlightsKeepAValidInterval) {
  Scenario scenario = zoo::long_flight(40).scenario;
  for (Station& station : scenario.stations) {
    station.covariance *= 100.0;
  }
  const window::WindowSolution solution =
      window::solve_windows(assemble_banded(scenario), {.core = 20, .overlap = 20});
  const minimax::Solution whole = minimax::solve(assemble(scenario).problem);
  EXPECT_GT(solution.nearly_singular, 0);
  EXPECT_NE(solution.certificate.claim, Claim::kNone) << solution.certificate.remark;
  EXPECT_LE(solution.certificate.lower, whole.upper);
  EXPECT_GE(solution.certificate.upper, whole.lower);
  EXPECT_LE(solution.certificate.upper - solution.certificate.lower, 1e-2 * solution.certificate.upper);
}

}  // namespace
