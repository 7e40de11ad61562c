// SPDX-License-Identifier: Apache-2.0
// From observations to a stated value: one fit, cross-fit, fixed reference, ambiguity, floor.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "localise/reference_cases.hpp"
#include "trammel/core/error.hpp"
#include "trammel/localise/flight_estimate.hpp"
#include "trammel/localise/interior_motion.hpp"

namespace {

using namespace trammel;

localise::FlightSettings quick(std::optional<double> floor = {}) {
  localise::FlightSettings settings;
  settings.minimum_height_m = floor;
  settings.estimate.near_optimality.reset();
  return settings;
}

/// Root mean square distance of an estimate from a true path over its grid.
template <class Truth>
double actual_rms_m(const estimate::PathTable& path, Truth&& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < path.times_s.size(); ++i) {
    sum += (path.position_m.row(static_cast<Eigen::Index>(i)).transpose() - truth(path.times_s[i]))
               .squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(path.times_s.size()));
}

TEST(FlightEstimate, StatesWhatLocateStatesAndLinearisesThere) {
  const Scenario scenario = test::descent_scenario(1, 1);
  const localise::FlightEstimate flight = localise::estimate_flight(scenario, quick(0.0));
  ASSERT_TRUE(flight.statement.has_value());
  const localise::Statement& statement = *flight.statement;
  EXPECT_FALSE(statement.ambiguous);
  EXPECT_EQ(statement.independence, localise::Independence::kSameData);
  EXPECT_EQ(statement.consistency, localise::Consistency::kCurvatureDominated);
  EXPECT_NEAR(statement.stated_rms_m, 556.503405, 2e-6 * 556);
  EXPECT_NEAR(statement.linear_guarantee_rms_m, 255.959147, 1e-6 * 256);
  EXPECT_EQ(flight.estimate.guaranteed_rms_m, statement.linear_guarantee_rms_m);
  EXPECT_EQ(flight.estimate.solution.claim, Claim::kVerified);
  EXPECT_LE(flight.estimate.lower_bound_rms_m, flight.estimate.guaranteed_rms_m);
  EXPECT_EQ(statement.tube_m.size(), scenario.observations.size());
  EXPECT_EQ(flight.estimate.observed->linearisation.iterations, 1);
  EXPECT_TRUE(flight.estimate.observed->linearisation.converged);
  const Eigen::MatrixXd& path = flight.estimate.observed->path.position_m;
  EXPECT_NEAR((path.row(0) - Eigen::RowVector3d(1006.65459, 1007.19072, 5001.14318)).norm(), 0.0, 0.01);
  EXPECT_GT(statement.starts, 10);
  EXPECT_TRUE(statement.competing.empty());
}

TEST(FlightEstimate, StatesNoSingleValueForAmbiguousData) {
  const localise::FlightEstimate flight = localise::estimate_flight(test::descent_scenario(1, 0), quick());
  ASSERT_TRUE(flight.statement.has_value());
  EXPECT_TRUE(flight.statement->ambiguous);
  EXPECT_TRUE(std::isnan(flight.statement->stated_rms_m));
  EXPECT_TRUE(std::isfinite(flight.statement->conditional_rms_m));
  ASSERT_FALSE(flight.statement->competing.empty());
  for (const localise::CompetingSolution& other : flight.statement->competing) {
    EXPECT_GT(other.stated_rms_m, other.linear_guarantee_rms_m);
    EXPECT_EQ(other.path.times_s, flight.estimate.nominal.times_s);
  }
}

TEST(FlightEstimate, CrossFitIsTheMeanOfTwoIndependentHalves) {
  localise::FlightSettings settings = quick();
  settings.cross_fit = true;
  const Scenario scenario = test::turn_by_radar();
  const localise::FlightEstimate flight = localise::estimate_flight(scenario, settings);
  const localise::Statement& statement = *flight.statement;
  EXPECT_EQ(statement.independence, localise::Independence::kCrossFit);
  EXPECT_EQ(statement.consistency, localise::Consistency::kSelfConsistent);
  // Half the scans: a larger linear guarantee than the 18.47 m of all of them, by at most sqrt 2.
  EXPECT_GT(statement.linear_guarantee_rms_m, 18.47);
  EXPECT_LT(statement.linear_guarantee_rms_m, 18.47 * std::sqrt(2.0));
  EXPECT_GE(statement.stated_rms_m, statement.linear_guarantee_rms_m);
  EXPECT_LT(statement.stated_rms_m, 1.02 * statement.linear_guarantee_rms_m);
  EXPECT_NEAR(flight.estimate.guaranteed_rms_m, statement.linear_guarantee_rms_m, 1e-9);
  EXPECT_LE(flight.estimate.lower_bound_rms_m, flight.estimate.guaranteed_rms_m);
  EXPECT_GT(flight.estimate.lower_bound_rms_m, (1 - 1e-6) * flight.estimate.guaranteed_rms_m);
  EXPECT_EQ(flight.estimate.observations, scenario.observations.size());
  EXPECT_EQ(flight.estimate.observed->residuals.size(), scenario.observations.size());
  EXPECT_TRUE(std::all_of(statement.tube_m.begin(), statement.tube_m.end(),
                          [](double tau) { return std::isfinite(tau) && tau > 0.0; }));
  const double actual = actual_rms_m(flight.estimate.observed->path, test::turn);
  EXPECT_LT(actual, statement.stated_rms_m);
  EXPECT_GT(actual, 0.1);
}

TEST(FlightEstimate, AFixedReferenceFarFromTheFlightStatesItsCurvature) {
  localise::FlightSettings settings = quick();
  settings.relinearise = false;
  const localise::FlightEstimate fixed = localise::estimate_flight(test::turn_by_radar(), settings);
  EXPECT_EQ(fixed.statement->independence, localise::Independence::kFixedReference);
  EXPECT_EQ(fixed.estimate.observed->linearisation.iterations, 0);
  EXPECT_EQ(fixed.statement->starts, 0);
  // The straight line is 2 km off in the turn: its measurements bend by far more than their noise.
  EXPECT_GT(fixed.estimate.observed->linearisation.ratio, 10.0);
}

TEST(FlightEstimate, MeasuredPositionsNeedNoLinearisation) {
  Scenario scenario = test::turn_by_radar();
  scenario.stations = {{.name = "gnss",
                        .kind = SensorKind::kPosition,
                        .position_m = Eigen::Vector3d::Zero(),
                        .covariance = Eigen::Matrix3d::Identity() * 25.0,
                        .times_s = {}}};
  scenario.observations.clear();
  for (int k = 0; k <= 60; ++k) {
    const Eigen::Vector3d wave(std::sin(1.7 * k), std::sin(2.9 * k), std::sin(4.1 * k));
    scenario.observations.push_back(
        {.t_s = k * 1.0, .station = 0, .value = test::turn(k) + 7.0 * wave, .covariance = {}});
  }
  const localise::FlightEstimate flight = localise::estimate_flight(scenario, quick());
  EXPECT_EQ(flight.statement->curvature_rms_m, 0.0);
  EXPECT_EQ(flight.statement->stated_rms_m, flight.estimate.guaranteed_rms_m);
  EXPECT_EQ(flight.statement->consistency, localise::Consistency::kSelfConsistent);
}

TEST(FlightEstimate, UnboundedMotionIsSaidToBe) {
  Scenario scenario = test::turn_by_radar();
  scenario.bounds.velocity_mps.setConstant(std::numeric_limits<double>::infinity());
  scenario.observations.resize(1);
  const localise::FlightEstimate flight = localise::estimate_flight(scenario, quick());
  EXPECT_EQ(flight.estimate.solution.status, SolveStatus::kUnbounded);
  EXPECT_FALSE(flight.statement.has_value());
}

TEST(FlightEstimate, NamesAFloorThatNoMotionStaysAbove) {
  try {
    (void)localise::estimate_flight(test::descent_scenario(1, 1), quick(1e5));
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.detail().where, "minimum_height_m");
    EXPECT_NE(error.detail().expected.find("highest found"), std::string::npos) << error.detail().expected;
  }
}

TEST(InteriorMotion, RisesAboveAFloorThatTheReferenceIsBelow) {
  const Scenario scenario = test::descent_scenario(1, 1);
  const localise::FitProblem plain(scenario);
  const double low = plain.lowest_height_m(Eigen::VectorXd::Zero(plain.parameters()));
  const localise::FitProblem raised(scenario, low + 40.0);
  ASSERT_FALSE(raised.inside(Eigen::VectorXd::Zero(raised.parameters())));
  const localise::InteriorMotion found = localise::find_interior_motion(raised);
  ASSERT_TRUE(found.z.has_value());
  EXPECT_TRUE(raised.inside(*found.z));
  EXPECT_GT(found.lowest_height_m, low + 40.0);
}

}  // namespace
