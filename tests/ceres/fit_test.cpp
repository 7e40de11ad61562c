// SPDX-License-Identifier: Apache-2.0
// Fits by the Ceres Solver beside the built-in ones.
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "localise/reference_cases.hpp"
#include "trammel/ceres/fit.hpp"
#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/estimate/simulate_measurements.hpp"
#include "trammel/localise/flight_estimate.hpp"
#include "trammel/localise/levenberg_marquardt.hpp"
#include "trammel/localise/locate.hpp"
#include "trammel/localise/outliers.hpp"
#include "trammel/localise/suggest.hpp"

namespace {

using namespace trammel;

struct Case {
  std::string name;
  Scenario scenario;
  std::optional<double> floor_m;
};

void PrintTo(const Case& tested, std::ostream* stream) { *stream << tested.name; }

std::vector<Case> cases() {
  return {{"DescentWithoutNoise", test::descent_scenario(1, 0), 0.0},
          {"Descent", test::descent_scenario(1, 1), 0.0},
          {"DescentWithoutFloor", test::descent_scenario(1, 0), {}},
          {"DescentByFiveTimesTheCovariance", test::descent_scenario(5, 1), 0.0},
          {"TurnByRadar", test::turn_by_radar(), {}},
          {"TurnByRanges", test::turn_by_ranges(), 0.0},
          {"BiasesTimeOffsetsAndRangeRate", test::errant_scenario(), 0.0}};
}

class CeresFit : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Reference, CeresFit, testing::ValuesIn(cases()),
                         [](const auto& tested) { return tested.param.name; });

/// To the last digits: where the minimum is flat, positions settle long after the cost.
const localise::FitSettings kTight{.max_systems = 5000, .relative_decrease = 1e-21};

/// Largest distance (m) between the paths of two deviations.
double distance_m(const localise::FitProblem& problem, const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const auto difference = problem.trajectory().coordinates.spline(a - b);
  double largest = 0.0;
  for (const double t : problem.grid_s()) {
    largest = std::max(largest, difference.position(t).norm());
  }
  return largest;
}

void expect_same(const localise::FitProblem& problem, const localise::Fit& ceres,
                 const localise::Fit& built_in) {
  EXPECT_TRUE(ceres.converged);
  EXPECT_TRUE(built_in.converged);
  EXPECT_NEAR(ceres.cost, built_in.cost, 1e-9 * std::abs(built_in.cost));
  EXPECT_NEAR(ceres.chi2, built_in.chi2, 1e-8 * built_in.chi2);
  EXPECT_LT(distance_m(problem, ceres.z, built_in.z), 1e-6);
}

TEST_P(CeresFit, HasTheMinimumOfTheBuiltInMethod) {
  const localise::FitProblem problem(GetParam().scenario, GetParam().floor_m);
  Eigen::VectorXd z = Eigen::VectorXd::Zero(problem.parameters());
  for (const double mu : {30.0, localise::kStrongBarrier}) {
    const localise::Fit built_in = localise::fit_levenberg_marquardt(problem, z, mu, kTight);
    const localise::Fit ceres = localise::fit_ceres(problem, z, mu, kTight);
    SCOPED_TRACE(mu);
    expect_same(problem, ceres, built_in);
    EXPECT_DOUBLE_EQ(ceres.cost, problem.cost(ceres.z, mu));
    EXPECT_DOUBLE_EQ(ceres.chi2, problem.chi2(ceres.z));
    EXPECT_LE(ceres.decrement, kTight.relative_decrease * (1 + std::abs(ceres.cost)));
    EXPECT_LT(ceres.systems, 3 * built_in.systems + 10);
    z = built_in.z;
  }
}

/// What Ceres gets of F at z.
struct Squares {
  Eigen::VectorXd f;
  Eigen::MatrixXd J;

  Squares(const localise::FitProblem& problem, const Eigen::VectorXd& z, double mu)
      : f(z.size() + 1), J(z.size() + 1, z.size()) {
    const localise::detail::FitResidual residual(problem, mu, z);
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows(J.rows(), J.cols());
    const double* const parameters = z.data();
    double* const jacobian = rows.data();
    EXPECT_TRUE(residual.Evaluate(&parameters, f.data(), const_cast<double**>(&jacobian)));
    J = rows;
  }
};

TEST_P(CeresFit, IsGivenAllDerivativesOfF) {
  const localise::FitProblem problem(GetParam().scenario, GetParam().floor_m);
  for (const double mu : {0.1, 30.0}) {
    const Eigen::VectorXd z =
        localise::fit_levenberg_marquardt(problem, Eigen::VectorXd::Zero(problem.parameters()), mu,
                                          {.relative_decrease = 0.1})
            .z;
    const Squares squares(problem, z, mu);
    const localise::Quadratic at = problem.expand(z, mu);
    EXPECT_TRUE((squares.J.transpose() * squares.f).isApprox(at.gradient, 1e-9));
    EXPECT_TRUE((squares.J.transpose() * squares.J).isApprox(at.hessian, 1e-12));
  }
}

// One station's ranges at two times, position unbounded: H is singular.
TEST(CeresFitProblem, DoesWithoutWhatNothingDetermines) {
  Scenario scenario = test::turn_scenario();
  scenario.bounds.position_m.setConstant(std::numeric_limits<double>::infinity());
  scenario.stations.push_back({.name = "range",
                               .kind = SensorKind::kRange,
                               .position_m = Eigen::Vector3d::Zero(),
                               .covariance = Eigen::MatrixXd::Constant(1, 1, 225),
                               .times_s = {10, 20}});
  test::observe(scenario, test::turn, 1.0);
  const localise::FitProblem problem(scenario);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(problem.parameters());
  const Squares squares(problem, zero, 1.0);
  const localise::Quadratic at = problem.expand(zero, 1.0);
  EXPECT_TRUE((squares.J.transpose() * squares.f).isApprox(at.gradient, 1e-6));
  EXPECT_TRUE((squares.J.transpose() * squares.J).isApprox(at.hessian, 1e-9));
  const localise::Fit ceres = localise::fit_ceres(problem, zero, 1.0);
  const localise::Fit built_in = localise::fit_levenberg_marquardt(problem, zero, 1.0);
  EXPECT_NEAR(ceres.cost, built_in.cost, 1e-6);
}

TEST(CeresFitProblem, NeedsAStartStrictlyInside) {
  const localise::FitProblem problem(test::descent_scenario(1, 1), 0.0);
  const Eigen::VectorXd outside = Eigen::VectorXd::Constant(problem.parameters(), 1e4);
  const auto message = [&](const localise::Minimiser& minimise) {
    try {
      (void)minimise(problem, outside, 1.0, {});
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_EQ(message(localise::fit_ceres), message(localise::fit_levenberg_marquardt));
  EXPECT_NE(message(localise::fit_ceres), "no error");
}

TEST(CeresFitProblem, StopsWhereTheSettingsSaySo) {
  const localise::FitProblem problem(test::turn_by_ranges(), 0.0);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(problem.parameters());
  const localise::Fit all = localise::fit_ceres(problem, zero, 1.0);
  const localise::Fit few = localise::fit_ceres(problem, zero, 1.0, {.max_systems = 8});
  EXPECT_FALSE(few.converged);
  EXPECT_LE(few.systems, 9);  // one more for the last point's decrement
  EXPECT_LT(few.cost, problem.cost(zero, 1.0));
  EXPECT_GT(few.decrement, 1e-6);
  // As good as hopeless: a target that F is far above.
  const localise::Fit hopeless = localise::fit_ceres(problem, zero, 1.0, {.target = all.cost - 1e6});
  EXPECT_FALSE(hopeless.converged);
  EXPECT_LT(hopeless.systems, all.systems);
}

/// The circle far from the nominal path: F begins at 1e8 and the first steps leave the bounds.
TEST(CeresFitProblem, ComesFromAfarInSilence) {
  const localise::FitProblem problem(test::circle_by_radars());
  Eigen::VectorXd ceres = Eigen::VectorXd::Zero(problem.parameters());
  Eigen::VectorXd built_in = ceres;
  EXPECT_GT(problem.chi2(ceres), 1e8);
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  for (const double mu : {1e6, 1e5, 1e4, 1e3, 100.0, 10.0, localise::kStrongBarrier}) {
    ceres = localise::fit_ceres(problem, ceres, mu).z;
    built_in = localise::fit_levenberg_marquardt(problem, built_in, mu).z;
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_NEAR(problem.cost(ceres, localise::kStrongBarrier), problem.cost(built_in, localise::kStrongBarrier),
              1e-6 * problem.cost(built_in, localise::kStrongBarrier));
  const auto& trajectory = problem.trajectory();
  for (double t = 0.0; t <= 240.0; t += 15.0) {
    const Eigen::Vector3d position =
        trajectory.nominal.position(t) + trajectory.coordinates.spline(ceres).position(t);
    EXPECT_NEAR((position - test::circle(t)).norm(), 0.0, 10.0) << t;
  }
}

/// The turn seen by two radars with 3 m and 0.2 mrad.
Scenario precise_turn() {
  Scenario scenario = test::turn_scenario();
  scenario.bounds.acceleration_mps2.assign(12, {12, 12, 1});
  for (const double x_m : {0.0, 30000.0}) {
    scenario.stations.push_back({.name = x_m > 0.0 ? "east" : "west",
                                 .kind = SensorKind::kAzimuthElevationRange,
                                 .position_m = {x_m, 0, 0},
                                 .covariance = Eigen::Vector3d(4e-8, 4e-8, 9).asDiagonal(),
                                 .times_s = test::seconds(0, 61)});
  }
  test::observe(scenario, test::turn, 1.0);
  return scenario;
}

// The first steps end next to the bounds; a trust region that took that for a fault of the model would hardly
// move any more.
TEST(CeresFitProblem, LeavesTheBoundsThatItRanInto) {
  const localise::FitProblem problem(precise_turn());
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(problem.parameters());
  int settled = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    RandomStream stream(seed);
    Eigen::VectorXd far(problem.trajectory().coordinates.all_parameters());
    for (double& place : far) {
      place = 1000.0 * stream.sign();
    }
    const Eigen::VectorXd start =
        problem.pull_inside(problem.trajectory().coordinates.from_motion(far), 0.95, zero);
    const localise::Fit built_in = localise::fit_levenberg_marquardt(problem, start, 3.0);
    const localise::Fit ceres = localise::fit_ceres(problem, start, 3.0, {.max_systems = 300});
    settled += ceres.converged ? 1 : 0;
    EXPECT_NEAR(ceres.cost, built_in.cost, 1e-6 * built_in.cost);
  }
  EXPECT_GE(settled, 18);
}

/// A scenario of up to three stations of all kinds, with or without biases and floor, and its observations.
Case random_case(std::uint64_t seed) {
  RandomStream stream(seed);
  const auto between = [&stream](double low, double high) { return low + (high - low) * stream.uniform(); };
  constexpr double kDuration_s = 40.0;
  Scenario scenario;
  const auto segments = static_cast<std::size_t>(between(2, 9));
  for (std::size_t i = 0; i <= segments; ++i) {
    scenario.knots_s.push_back(kDuration_s * static_cast<double>(i) / static_cast<double>(segments));
  }
  scenario.nominal.position_m = {between(2e3, 2e4), between(2e3, 2e4), between(1e3, 8e3)};
  scenario.nominal.velocity_mps = {between(-200, 200), between(-200, 200), between(-10, 10)};
  scenario.bounds.position_m.setConstant(between(50, 500));
  scenario.bounds.velocity_mps.setConstant(between(3, 30));
  scenario.bounds.acceleration_mps2.assign(segments, {between(1, 20), between(1, 20), between(1, 5)});
  const auto stations = static_cast<std::size_t>(between(1, 4));
  for (std::size_t i = 0; i < stations; ++i) {
    constexpr std::array kKinds{
        SensorKind::kAzimuthElevationRange, SensorKind::kRange,    SensorKind::kRangeRate,
        SensorKind::kDirectionCosinesRange, SensorKind::kPosition, SensorKind::kAzimuthElevation};
    Station station{.name = std::to_string(i), .kind = kKinds[static_cast<std::size_t>(between(0, 6))]};
    station.position_m = {between(-3e4, 1e3), between(-3e4, 1e3), between(0, 100)};
    const double length_m = between(2, 30);
    const double angle = between(2e-4, 3e-3);
    Eigen::VectorXd sigma = Eigen::VectorXd::Constant(components(station.kind), angle);
    if (station.kind == SensorKind::kPosition) {
      sigma.setConstant(length_m);
    } else if (station.kind == SensorKind::kRangeRate) {
      sigma.setConstant(0.5);
    } else if (station.kind != SensorKind::kAzimuthElevation) {
      sigma(sigma.size() - 1) = length_m;
    }
    station.covariance = sigma.cwiseAbs2().asDiagonal();
    if (stream.uniform() < 0.5) {
      station.bias.components = 3 * sigma;
      station.bias.time_s = stream.uniform() < 0.5 ? between(0.05, 0.5) : 0.0;
    }
    for (double t = between(0, 1); t <= kDuration_s; t += between(0.5, 4)) {
      station.times_s.push_back(t);
    }
    scenario.stations.push_back(std::move(station));
  }
  /// The nominal path off by something the bounds allow.
  struct Truth {
    Eigen::Vector3d position_m, velocity_mps, acceleration_mps2;

    [[nodiscard]] Eigen::Vector3d position(double t) const {
      return position_m + t * velocity_mps + t * t / 2 * acceleration_mps2;
    }
    [[nodiscard]] Eigen::Vector3d velocity(double t) const { return velocity_mps + t * acceleration_mps2; }
    [[nodiscard]] static bool covers(double /*t*/) { return true; }
  };
  const auto within = [&](const Eigen::Vector3d& axes) {
    return Eigen::Vector3d(axes.x() * between(-.5, .5), axes.y() * between(-.5, .5),
                           axes.z() * between(-.5, .5));
  };
  const Truth truth{scenario.nominal.position_m + within(scenario.bounds.position_m),
                    scenario.nominal.velocity_mps + within(scenario.bounds.velocity_mps),
                    within(scenario.bounds.acceleration_mps2.front())};
  scenario.observations = estimate::simulate_measurements(scenario, truth, seed);
  Case result{.name = std::to_string(seed), .scenario = std::move(scenario), .floor_m = {}};
  const localise::FitProblem unconfined(result.scenario);
  if (stream.uniform() < 0.5) {
    result.floor_m =
        unconfined.lowest_height_m(Eigen::VectorXd::Zero(unconfined.parameters())) - between(1, 300);
  }
  return result;
}

TEST(CeresFitProblem, HasTheMinimumOfTheBuiltInMethodInRandomScenarios) {
  constexpr std::uint64_t kScenarios = 100;
  for (std::uint64_t seed = 1; seed <= kScenarios; ++seed) {
    const Case tested = random_case(seed);
    SCOPED_TRACE("seed " + tested.name);
    const localise::FitProblem problem(tested.scenario, tested.floor_m);
    Eigen::VectorXd z = Eigen::VectorXd::Zero(problem.parameters());
    const double strong = 1 + problem.chi2(z);
    for (const double mu : {strong, strong / 30, strong / 1000, 30.0, 4.5}) {
      const localise::Fit built_in = localise::fit_levenberg_marquardt(problem, z, mu);
      const localise::Fit ceres = localise::fit_ceres(problem, z, mu);
      EXPECT_TRUE(ceres.converged);
      EXPECT_TRUE(built_in.converged);
      EXPECT_NEAR(ceres.cost, built_in.cost, 1e-8 * (1 + std::abs(built_in.cost)));
      z = built_in.z;
    }
  }
}

TEST_P(CeresFit, MakesTheWholeSearch) {
  localise::LocateSettings settings;
  settings.minimum_height_m = GetParam().floor_m;
  const localise::FitProblem problem(GetParam().scenario);
  const localise::Location built_in = localise::locate(GetParam().scenario, settings);
  settings.minimise = localise::fit_ceres;
  const localise::Location ceres = localise::locate(GetParam().scenario, settings);
  ASSERT_EQ(ceres.status, built_in.status);
  ASSERT_EQ(ceres.branches.size(), built_in.branches.size());
  for (std::size_t k = 0; k < ceres.branches.size(); ++k) {
    const localise::Branch& a = ceres.branches[k];
    const localise::Branch& b = built_in.branches[k];
    EXPECT_EQ(a.from_floor_test, b.from_floor_test);
    EXPECT_NEAR(a.minimum.cost, b.minimum.cost, 1e-8 * (1 + std::abs(b.minimum.cost)));
    EXPECT_LT(distance_m(problem, a.reference.z, b.reference.z), 2e-5);
    EXPECT_NEAR(a.reference.cost, b.reference.cost, 1e-9 * std::abs(b.reference.cost));
    EXPECT_NEAR(a.stated->linear_guarantee_rms_m, b.stated->linear_guarantee_rms_m,
                1e-8 * b.stated->linear_guarantee_rms_m);
    // The curvature term depends on the prior to first order, which the biases leave open within the gap.
    const double tolerance = b.stated->kappa > 5.0 ? 1e-2 : 1e-6;
    EXPECT_NEAR(a.stated->stated_rms_m, b.stated->stated_rms_m, tolerance * b.stated->stated_rms_m);
  }
  EXPECT_EQ(ceres.floor_tests.size(), built_in.floor_tests.size());
}

TEST(CeresMinimiser, ServesWhateverFits) {
  Scenario scenario = test::turn_by_radar();
  scenario.observations[20].value(2) += 500.0;
  const std::vector<localise::RejectedMeasurement> rejected =
      localise::find_outliers(scenario, {.minimise = localise::fit_ceres}).rejected;
  ASSERT_EQ(rejected.size(), 1U);
  EXPECT_EQ(rejected.front().observation, 20U);

  const Scenario clean = test::turn_by_radar();
  localise::SuggestSettings suggest{.lengths_s = {5, 10, 20}};
  const localise::Suggestion built_in = localise::suggest_segments(clean, suggest);
  suggest.minimise = localise::fit_ceres;
  const localise::Suggestion ceres = localise::suggest_segments(clean, suggest);
  EXPECT_EQ(ceres.best, built_in.best);
  EXPECT_NEAR(ceres.jerk_mps3, built_in.jerk_mps3, 1e-4 * built_in.jerk_mps3);

  localise::FlightSettings settings;
  settings.minimise = localise::fit_ceres;
  settings.cross_fit = true;
  const localise::FlightEstimate by_ceres = localise::estimate_flight(clean, settings);
  settings.minimise = localise::fit_levenberg_marquardt;
  const localise::FlightEstimate by_built_in = localise::estimate_flight(clean, settings);
  EXPECT_NEAR(by_ceres.statement->stated_rms_m, by_built_in.statement->stated_rms_m,
              1e-6 * by_built_in.statement->stated_rms_m);
}

}  // namespace
