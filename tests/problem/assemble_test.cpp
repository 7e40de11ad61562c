// SPDX-License-Identifier: Apache-2.0
#include "trammel/problem/assemble.hpp"

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>

#include <gtest/gtest.h>

#include "trammel/core/random.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/qr.hpp"
#include "trammel/problem/zoo.hpp"
#include "trammel/trajectory/motion_parameters.hpp"

namespace {

using namespace trammel;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// sqrt(tr S J^-1) = |C R^-1|_F.
double gauss_markov(const GuaranteedProblem& problem) {
  const linalg::Qr qr(problem.information_factor);
  const Eigen::MatrixXd r = qr.matrixQR().topRows(problem.parameters()).triangularView<Eigen::Upper>();
  return r.transpose().triangularView<Eigen::Lower>().solve(problem.criterion_factor.transpose()).norm();
}

class Zoo : public testing::TestWithParam<zoo::Instance> {};

TEST_P(Zoo, ReproducesTheGaussMarkovValue) {
  const TrajectoryProblem assembled = assemble(GetParam().scenario);
  const double known = GetParam().optimum->gauss_markov_rms_m;
  EXPECT_NEAR(gauss_markov(assembled.problem) / known, 1.0, 1e-9);
  EXPECT_LE(assembled.problem.information_factor.rows(), assembled.problem.parameters());
}

TEST_P(Zoo, ColumnsHaveUnitLength) {
  const GuaranteedProblem problem = assemble(GetParam().scenario).problem;
  Eigen::VectorXd square = problem.information_factor.colwise().squaredNorm().transpose();
  for (const Eigen::MatrixXd& a : problem.ellipsoids) {
    square += a.colwise().squaredNorm().transpose();
  }
  EXPECT_LT((square.array() - 1.0).abs().maxCoeff(), 1e-12);
}

// The same quantities by the definition: truncated powers, dense sums.
TEST_P(Zoo, AgreesWithTheDefinitionInTruncatedPowers) {
  const Scenario& scenario = GetParam().scenario;
  if (scenario.segments() > 20) {
    GTEST_SKIP() << "truncated powers are too ill conditioned on long flights";
  }
  const TrajectoryProblem assembled = assemble(scenario);
  const MotionCoordinates& coordinates = assembled.coordinates;
  const Eigen::MatrixXd rows = coordinates.kept_motion_rows();
  const auto s = static_cast<Eigen::Index>(scenario.segments()) + 2;
  for (Eigen::Index l = 0; l < s; ++l) {
    const Eigen::Index at = assembled.ellipsoid_of_bound[static_cast<std::size_t>(l)];
    if (semi_axes(scenario.bounds, l).isZero()) {
      EXPECT_EQ(at, TrajectoryProblem::kNoEllipsoid);
      continue;
    }
    const Eigen::MatrixXd expected = rows.middleRows(3 * l, 3) / semi_axes(scenario.bounds, l)(0);
    EXPECT_LT((assembled.problem.ellipsoids[static_cast<std::size_t>(at)] - expected).norm(),
              1e-13 * expected.norm());
  }
  for (const double t : {0.0, 3.3, scenario.knots_s.back() / 2, scenario.knots_s.back()}) {
    const Eigen::RowVectorXd power = trajectory::motion_row(coordinates.basis(), t);
    Eigen::MatrixXd by_powers = Eigen::MatrixXd::Zero(3, coordinates.all_parameters());
    for (Eigen::Index l = 0; l < s; ++l) {
      by_powers.middleCols<3>(3 * l).diagonal().setConstant(power(l));
    }
    const Eigen::MatrixXd expected = by_powers(Eigen::all, coordinates.kept()) * rows;
    const Eigen::MatrixXd actual = coordinates.position_rows(t);
    EXPECT_LT((actual - expected).norm(), 1e-11 * expected.norm()) << t;
  }
}

INSTANTIATE_TEST_SUITE_P(Problem, Zoo, testing::ValuesIn(zoo::all_instances()), [](const auto& tested) {
  return std::string(tested.param.name) + "_" + std::to_string(tested.param.scenario.segments());
});

TEST(Zoo, LongFlightIsTheReferencePath) {
  const std::string path =
      std::string(TRAMMEL_SOURCE_DIR) + "/../shared/reference/guaranteed/long_r98_nominal.csv";
  std::ifstream file(path);
  if (!file) {
    GTEST_SKIP() << "reference files are not here";
  }
  const NominalPath nominal = zoo::long_flight(98).scenario.nominal;
  std::string line;
  std::getline(file, line);
  for (std::size_t i = 0; i < nominal.sample_times_s.size(); ++i) {
    ASSERT_TRUE(std::getline(file, line));
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream numbers(line);
    double t = 0.0;
    Eigen::Vector3d x;
    numbers >> t >> x(0) >> x(1) >> x(2);
    EXPECT_EQ(t, nominal.sample_times_s[i]);
    EXPECT_LT((x - nominal.sample_positions_m[i]).norm(), 1e-6);
  }
}

}  // namespace
