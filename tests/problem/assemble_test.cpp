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
#include "trammel/sensor/any_sensor.hpp"
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

/// Every kind of sensor, irregular knots, own covariances, measurements out of order.
Scenario mixed_scenario() {
  Scenario scenario;
  scenario.knots_s = {-5.0, 0.0, 2.0, 30.0, 33.0};
  scenario.nominal.position_m = {3000.0, -2000.0, 1500.0};
  scenario.nominal.velocity_mps = {80.0, 60.0, -3.0};
  scenario.bounds.position_m = {100.0, 50.0, 20.0};
  scenario.bounds.velocity_mps = {10.0, 11.0, 12.0};
  scenario.bounds.acceleration_mps2.assign(4, {3.0, 4.0, 5.0});
  for (std::size_t k = 0; k < kSensorKinds; ++k) {
    const SensorKind kind = kSensorTable[k].kind;
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(components(kind), components(kind));
    covariance *= 0.01 * static_cast<double>(k + 1);
    covariance(0, covariance.cols() - 1) += 0.001;
    covariance(covariance.rows() - 1, 0) = covariance(0, covariance.cols() - 1);
    scenario.stations.push_back({.name = std::string(describe(kind).name),
                                 .kind = kind,
                                 .position_m = {100.0 * static_cast<double>(k), 50.0, 7.0},
                                 .covariance = covariance,
                                 .times_s = {31.0, -5.0, 1.5, 33.0, 12.0}});
  }
  return scenario;
}

/// The same with observations off the reference, one with its own covariance.
Scenario observed_scenario() {
  Scenario scenario = mixed_scenario();
  RandomStream stream(12);
  for (std::size_t i = scenario.stations.size(); i-- > 0;) {
    const Station& station = scenario.stations[i];
    for (const double t : station.times_s) {
      const Eigen::Vector3d x = scenario.nominal.position_m + (t + 5.0) * scenario.nominal.velocity_mps;
      const sensor::Padded value =
          sensor::measure(station.kind, x - station.position_m, scenario.nominal.velocity_mps);
      Measurement m{.t_s = t,
                    .station = i,
                    .value = sensor::unpadded(value, components(station.kind)),
                    .covariance = std::nullopt};
      for (double& y : m.value) {
        y += 0.1 * stream.normal();
      }
      scenario.observations.push_back(m);
    }
  }
  scenario.observations[3].covariance = 4.0 * scenario.stations[scenario.observations[3].station].covariance;
  return scenario;
}

/// The same from stations that move, whose readings and clocks are off.
Scenario biased_scenario() {
  Scenario scenario = observed_scenario();
  for (std::size_t i = 0; i < scenario.stations.size(); ++i) {
    Station& station = scenario.stations[i];
    if (i % 2 == 0) {
      station.track = {.times_s = {-6.0, 10.0, 34.0},
                       .positions_m = {station.position_m, station.position_m + Eigen::Vector3d(90, -70, 9),
                                       station.position_m + Eigen::Vector3d(150, 30, 0)}};
    }
    if (i % 3 != 1) {
      station.bias.components = Eigen::VectorXd::LinSpaced(components(station.kind), 0.3, 0.5);
      station.bias.components(0) = i == 2 ? kInfinity : 0.0;
    }
    station.bias.time_s = i % 3 == 0 ? 0.0 : 0.2;
  }
  return scenario;
}

/// J and F'y by the definition: dense sums in z, Jacobians by central differences of the measurement.
struct Normal {
  Eigen::MatrixXd J;
  Eigen::VectorXd Fy;
};
Normal by_definition(const Scenario& scenario, const TrajectoryProblem& assembled) {
  const Eigen::Index p = assembled.problem.parameters();
  Normal normal{Eigen::MatrixXd::Zero(p, p), Eigen::VectorXd::Zero(p)};
  for (const Measurement& m : scenario.observations) {
    const Station& station = scenario.stations[m.station];
    const Eigen::Index size = components(station.kind);
    const auto at = [&](const Eigen::VectorXd& z) {
      const auto spline = assembled.coordinates.spline(z);
      const double t = m.t_s + assembled.coordinates.time_offsets_s(z, scenario.stations.size())[m.station];
      const auto path =
          station.track.times_s.empty()
              ? trajectory::NominalTrajectory::line(0.0, station.position_m, Eigen::Vector3d::Zero())
              : trajectory::NominalTrajectory::through(station.track.times_s, station.track.positions_m);
      sensor::Padded value =
          sensor::measure(station.kind, assembled.nominal.position(t) + spline.position(t) - path.position(t),
                          assembled.nominal.velocity(t) + spline.velocity(t) - path.velocity(t));
      const Eigen::VectorXd biases = assembled.coordinates.biases(z);
      for (std::size_t k = 0; k < assembled.coordinates.bias_parameters().size(); ++k) {
        const BiasParameter& bias = assembled.coordinates.bias_parameters()[k];
        if (bias.station == m.station && bias.component != BiasParameter::kTimeOffset) {
          value(bias.component) += biases(static_cast<Eigen::Index>(k));
        }
      }
      return value;
    };
    Eigen::MatrixXd H(size, p);
    for (Eigen::Index j = 0; j < p; ++j) {
      const double step = assembled.coordinates.motion_parameters() > j ? 0.02 : 1e-3;
      const Eigen::VectorXd z = step * Eigen::VectorXd::Unit(p, j);
      H.col(j) = sensor::unpadded((at(z) - at(-z)) / (2 * step), size);
    }
    const Eigen::MatrixXd W = m.covariance ? *m.covariance : station.covariance;
    const linalg::Cholesky cholesky(W);
    const Eigen::VectorXd y = m.value - sensor::unpadded(at(Eigen::VectorXd::Zero(p)), size);
    normal.J += H.transpose() * cholesky.solve(H);
    normal.Fy += H.transpose() * cholesky.solve(y);
  }
  return normal;
}

void expect_the_definition(const Scenario& scenario, Eigen::Index parameters) {
  const TrajectoryProblem assembled = assemble(scenario);
  ASSERT_EQ(assembled.problem.parameters(), parameters);
  const Normal expected = by_definition(scenario, assembled);
  const Eigen::MatrixXd& F = assembled.problem.information_factor;
  EXPECT_LT((F.transpose() * F - expected.J).norm(), 1e-6 * expected.J.norm());
  EXPECT_LT((F.transpose() * assembled.information_rhs - expected.Fy).norm(), 1e-6 * expected.Fy.norm());
  EXPECT_EQ(assembled.observations, 35U);
}

TEST(Assemble, AgreesWithTheDefinitionForEveryKind) { expect_the_definition(observed_scenario(), 18); }

TEST(Assemble, AgreesWithTheDefinitionForStationsThatMoveAndErr) {
  const Scenario scenario = biased_scenario();
  // Components 3 + 3 (without the first) of kinds 0, 2, 3, 5, 6, one of them unbounded; four clocks.
  const std::vector<BiasParameter> biases = bias_parameters(scenario);
  ASSERT_EQ(biases.size(), 2U + 1U + 1U + 2U + 4U);
  expect_the_definition(scenario, 18 + 10);
  const TrajectoryProblem assembled = assemble(scenario);
  EXPECT_EQ(assembled.problem.criterion_factor.rightCols(10).norm(), 0.0);
  // One ellipsoid per station with bounded biases, in which semi-axes have unit length.
  EXPECT_EQ(assembled.ellipsoid_of_station, (std::vector<Eigen::Index>{6, 7, 8, 9, 10, 11, 12}));
  for (std::size_t k = 0; k < biases.size(); ++k) {
    const bool bounded = std::isfinite(biases[k].semi_axis);
    const Eigen::VectorXd z = assembled.coordinates.from_motion(
        Eigen::VectorXd::Zero(18),
        Eigen::VectorXd::Unit(10, static_cast<Eigen::Index>(k)) * (bounded ? biases[k].semi_axis : 1.0));
    for (std::size_t l = 0; l < assembled.problem.ellipsoids.size(); ++l) {
      const bool own = static_cast<Eigen::Index>(l) == assembled.ellipsoid_of_station[biases[k].station];
      EXPECT_NEAR((assembled.problem.ellipsoids[l] * z).norm(), own && bounded ? 1.0 : 0.0, 1e-12);
    }
    EXPECT_NEAR(assembled.coordinates.biases(z).norm(), bounded ? biases[k].semi_axis : 1.0, 1e-12);
  }
}

TEST(Assemble, TheOrderOfMeasurementsDoesNotMatter) {
  Scenario scenario = observed_scenario();
  const TrajectoryProblem first = assemble(scenario);
  const std::vector<Measurement> forward = scenario.observations;
  scenario.observations.assign(forward.rbegin(), forward.rend());
  const TrajectoryProblem second = assemble(scenario);
  const Eigen::MatrixXd J = first.problem.information_factor.transpose() * first.problem.information_factor;
  const Eigen::MatrixXd other =
      second.problem.information_factor.transpose() * second.problem.information_factor;
  EXPECT_LT((J - other).norm(), 1e-13 * J.norm());
  // The misfit of any motion: how it is split between right-hand side and residual is free where J is
  // singular.
  const auto misfit = [](const TrajectoryProblem& assembled, const Eigen::VectorXd& z) {
    return (assembled.problem.information_factor * z - assembled.information_rhs).squaredNorm() +
           assembled.information_residual;
  };
  RandomStream stream(5);
  for (int k = 0; k < 5; ++k) {
    Eigen::VectorXd z(first.problem.parameters());
    for (double& entry : z) {
      entry = k == 0 ? 0.0 : 1e-3 * stream.normal();
    }
    EXPECT_NEAR(misfit(first, z), misfit(second, z), 1e-11 * misfit(first, z)) << k;
  }
}

TEST(Assemble, PlannedMeasurementsHaveTheSameInformation) {
  Scenario scenario = observed_scenario();
  scenario.observations[3].covariance.reset();
  const Eigen::MatrixXd observed = assemble(scenario).problem.information_factor;
  scenario.observations.clear();
  const TrajectoryProblem planned = assemble(scenario);
  EXPECT_LT((observed.cwiseAbs() - planned.problem.information_factor.cwiseAbs()).norm(),
            1e-11 * observed.norm());
  EXPECT_EQ(planned.information_rhs.size(), 0);
  EXPECT_EQ(planned.observations, 35U);
}

// Linearised about another path, the data still describe deviations from the reference: with exact
// measurements of a motion, linearised about that motion, the residual vanishes there.
TEST(Assemble, LinearisesAboutAnotherPath) {
  for (Scenario scenario : {observed_scenario(), biased_scenario()}) {
    const TrajectoryProblem reference = assemble(scenario);
    Eigen::VectorXd theta = Eigen::VectorXd::LinSpaced(18, -2.0, 3.0);
    theta.head<3>() << 40.0, -30.0, 15.0;
    const auto q = static_cast<Eigen::Index>(reference.coordinates.bias_parameters().size());
    const Eigen::VectorXd biases = Eigen::VectorXd::LinSpaced(q, -0.1, 0.15);
    const Eigen::VectorXd truth = reference.coordinates.from_motion(theta, biases);
    const auto deviation = reference.coordinates.spline(truth);
    const std::vector<double> offsets = reference.coordinates.time_offsets_s(truth, scenario.stations.size());
    for (Measurement& m : scenario.observations) {
      const Station& station = scenario.stations[m.station];
      const double t = m.t_s + offsets[m.station];
      const RelativeMotion motion = relative_motion(reference.nominal, reference.stations[m.station], t);
      const sensor::Padded bias =
          bias_columns(reference.coordinates.bias_parameters(), m.station, sensor::Padded::Zero()) * biases;
      m.value = sensor::unpadded(sensor::measure(station.kind, motion.position_m + deviation.position(t),
                                                 motion.velocity_mps + deviation.velocity(t)) +
                                     bias,
                                 components(station.kind));
    }
    const TrajectoryProblem about = assemble(scenario, &deviation, offsets);
    const Eigen::VectorXd z = about.coordinates.from_motion(theta, biases);
    const Eigen::MatrixXd& F = about.problem.information_factor;
    EXPECT_LT((F * z - about.information_rhs).norm(), 1e-9 * about.information_rhs.norm());
    EXPECT_LT(about.information_residual, 1e-9 * about.information_rhs.squaredNorm());
    EXPECT_THROW((void)assemble(scenario, &deviation, {0.1}), Error);
  }
}

TEST(Assemble, ZeroRemovesExactlyAndInfinityLeavesFree) {
  Scenario scenario = mixed_scenario();
  scenario.bounds.velocity_mps.setZero();
  scenario.bounds.acceleration_mps2[1].y() = 0.0;
  scenario.bounds.acceleration_mps2[2] = {0.0, kInfinity, 2.0};
  scenario.bounds.position_m.setConstant(kInfinity);
  const TrajectoryProblem assembled = assemble(scenario);
  EXPECT_EQ(assembled.problem.parameters(), 18 - 3 - 1 - 1);
  EXPECT_EQ(assembled.ellipsoid_of_bound, (std::vector<Eigen::Index>{-1, -1, 0, 1, 2, 3}));
  EXPECT_EQ(assembled.problem.ellipsoids[1].rows(), 2);
  EXPECT_EQ(assembled.problem.ellipsoids[2].rows(), 1);
  EXPECT_EQ(assembled.problem.ellipsoids[3].rows(), 3);
  // theta -> z -> theta, and the path of z is the path of theta.
  RandomStream stream(3);
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(18);
  for (const Eigen::Index place : assembled.coordinates.kept()) {
    theta(place) = stream.normal();
  }
  const Eigen::VectorXd z = assembled.coordinates.from_motion(theta);
  const Eigen::VectorXd again = assembled.coordinates.motion(z);
  EXPECT_LT((again - theta).norm(), 1e-12 * theta.norm());
  for (std::size_t k = 0; k < 18; ++k) {
    if (assembled.coordinates.removed()[k]) {
      EXPECT_EQ(again(static_cast<Eigen::Index>(k)), 0.0);
    }
  }
  const auto spline = assembled.coordinates.spline(z);
  for (const double t : {-5.0, 1.0, 17.0, 33.0}) {
    const Eigen::RowVectorXd power = trajectory::motion_row(assembled.coordinates.basis(), t);
    const Eigen::Vector3d expected = theta.reshaped(3, 6) * power.transpose();
    EXPECT_LT((spline.position(t) - expected).norm(), 1e-11 * (1 + expected.norm())) << t;
    EXPECT_LT((assembled.coordinates.position_rows(t) * z - expected).norm(), 1e-11 * (1 + expected.norm()));
    EXPECT_LT((assembled.coordinates.velocity_rows(t) * z - spline.velocity(t)).norm(), 1e-11);
    EXPECT_LT((assembled.coordinates.acceleration_rows(t) * z - spline.acceleration(t)).norm(), 1e-11);
  }
}

// All but the start removed on 300 segments: the straight lines, in a well conditioned basis.
TEST(Assemble, ManyRemovedSegmentsLeaveStraightLines) {
  Scenario scenario = zoo::long_flight(300).scenario;
  std::fill(scenario.bounds.acceleration_mps2.begin(), scenario.bounds.acceleration_mps2.end(),
            Eigen::Vector3d::Zero());
  const TrajectoryProblem assembled = assemble(scenario);
  ASSERT_EQ(assembled.problem.parameters(), 6);
  EXPECT_EQ(assembled.problem.information_factor.rows(), 6);
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(906);
  theta.head<6>() << 10.0, 20.0, 30.0, 1.0, -2.0, 3.0;
  const auto spline = assembled.coordinates.spline(assembled.coordinates.from_motion(theta));
  for (const double t : {0.0, 1234.5, 3000.0}) {
    const Eigen::Vector3d expected = theta.head<3>() + t * theta.segment<3>(3);
    EXPECT_LT((spline.position(t) - expected).norm(), 1e-9 * (1 + expected.norm())) << t;
  }
}

TEST(Assemble, AcceptsVeryManyMeasurements) {
  Scenario scenario = zoo::long_flight(3).scenario;
  const TrajectoryProblem few = assemble(scenario);
  std::vector<double>& times = scenario.stations[0].times_s;
  const std::vector<double> once = times;
  constexpr int kCopies = 5000;
  for (Station& station : scenario.stations) {
    station.times_s.clear();
    for (int i = 0; i < kCopies; ++i) {
      station.times_s.insert(station.times_s.end(), once.begin(), once.end());
    }
  }
  const TrajectoryProblem many = assemble(scenario);
  EXPECT_EQ(many.observations, 2U * 31U * kCopies);
  EXPECT_EQ(many.problem.information_factor.rows(), 15);
  EXPECT_NEAR(gauss_markov(many.problem) * std::sqrt(kCopies) / gauss_markov(few.problem), 1.0, 1e-9);
}

}  // namespace
