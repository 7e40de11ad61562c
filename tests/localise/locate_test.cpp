// SPDX-License-Identifier: Apache-2.0
// The search for motions that explain the observations, and ambiguity.
#include <cmath>

#include <gtest/gtest.h>

#include "localise/reference_cases.hpp"
#include "trammel/localise/locate.hpp"

namespace {

using namespace trammel;

double final_height_m(const localise::FitProblem& fit, const Eigen::VectorXd& z) {
  const double end = fit.trajectory().coordinates.basis().end_s();
  return fit.trajectory().nominal.position(end).z() +
         fit.trajectory().coordinates.spline(z).position(end).z();
}

TEST(Locate, FindsTheReferenceOfTheIndependentNumbers) {
  localise::LocateSettings settings;
  settings.minimum_height_m = 0.0;
  const localise::Location found = localise::locate(test::descent_scenario(1, 1), settings);
  ASSERT_EQ(found.status, localise::LocateStatus::kUnique);
  ASSERT_EQ(found.branches.size(), 1U);
  const localise::Branch& best = found.branches.front();
  EXPECT_NEAR(2 * best.minimum.cost, 210.823612, 1e-3);
  ASSERT_TRUE(best.stated.has_value());
  EXPECT_NEAR(best.stated->linear_guarantee_rms_m, 255.959147, 1e-6 * 256);
  EXPECT_NEAR(best.stated->stated_rms_m, 556.503405, 2e-6 * 556);
  EXPECT_GE(found.starts, 15);
  EXPECT_GT(found.systems, found.starts);
}

TEST(Locate, MakesAllFitsByTheMinimiserOfItsSettings) {
  localise::LocateSettings settings;
  settings.minimum_height_m = 0.0;  // the antenna's height: no floor test
  int fits = 0;
  int systems = 0;
  settings.minimise = [&](const localise::FitProblem& problem, const Eigen::VectorXd& start, double mu,
                          const localise::FitSettings& fit) {
    localise::Fit result = localise::fit_levenberg_marquardt(problem, start, mu, fit);
    ++fits;
    systems += result.systems;
    return result;
  };
  const localise::Location found = localise::locate(test::descent_scenario(1, 1), settings);
  EXPECT_EQ(found.systems, systems);
  EXPECT_GT(fits, found.starts);
}

TEST(Locate, SaysThatAMirroredDescentExplainsTheDataAsWell) {
  const Scenario scenario = test::descent_scenario(1, 0);
  const localise::Location found = localise::locate(scenario);
  EXPECT_EQ(found.status, localise::LocateStatus::kAmbiguous);
  ASSERT_GE(found.branches.size(), 2U);
  const localise::FitProblem fit(scenario);
  EXPECT_NEAR(2 * found.branches[0].minimum.cost, 15.288303, 0.01);
  EXPECT_LT(final_height_m(fit, found.branches[0].minimum.z), 0.0);  // the false one fits better
  bool truth_listed = false;
  for (std::size_t k = 1; k < found.branches.size(); ++k) {
    const localise::Branch& other = found.branches[k];
    EXPECT_LT(other.excess_cost, localise::kDecisiveCost);
    EXPECT_GT(other.distance_m, found.branches[0].stated->linear_guarantee_rms_m);
    ASSERT_TRUE(other.stated.has_value());
    EXPECT_GT(other.stated->stated_rms_m, other.stated->linear_guarantee_rms_m);
    truth_listed = truth_listed || final_height_m(fit, other.minimum.z) > 1000.0;
  }
  EXPECT_TRUE(truth_listed);
}

TEST(Locate, IsSelfConsistentWhereAnglesAreMeasured) {
  const localise::Location found = localise::locate(test::turn_by_radar());
  ASSERT_EQ(found.status, localise::LocateStatus::kUnique);
  const localise::StatedValue& stated = *found.branches.front().stated;
  EXPECT_EQ(stated.consistency, localise::Consistency::kSelfConsistent);
  EXPECT_NEAR(stated.stated_rms_m, 18.5168, 0.01);
}

TEST(Locate, FindsAMotionAboveAFloorThatTheReferenceIsBelow) {
  localise::LocateSettings settings;
  settings.minimum_height_m = 0.0;
  Scenario scenario = test::descent_scenario(1, 1);
  scenario.nominal.position_m.z() -= 5050.0;  // the reference is under ground, the bounds reach above
  scenario.bounds.position_m.z() = 5500.0;
  const localise::Location found = localise::locate(scenario, settings);
  ASSERT_NE(found.status, localise::LocateStatus::kInfeasibleStart);
  EXPECT_GT(found.lowest_height_m, 0.0);
  const localise::FitProblem fit(scenario, 0.0);
  EXPECT_TRUE(fit.inside(found.branches.front().reference.z));
  // The truth, 2000 m, lies near the edge of these bounds.
  EXPECT_NEAR(final_height_m(fit, found.branches.front().minimum.z), 2000.0, 1000.0);
}

TEST(Locate, SaysThatNoMotionStaysAboveTheFloor) {
  localise::LocateSettings settings;
  settings.minimum_height_m = 20000.0;
  const localise::Location found = localise::locate(test::descent_scenario(1, 1), settings);
  EXPECT_EQ(found.status, localise::LocateStatus::kInfeasibleStart);
  EXPECT_TRUE(found.branches.empty());
  EXPECT_GT(found.lowest_height_m, 5000.0);  // the bounds allow some climb
  EXPECT_LT(found.lowest_height_m, 20000.0);
}

// A fit that begins with weak barriers runs into the bounds and stays there.
TEST(Locate, FindsPreciselyMeasuredCirclesFromAStraightNominalPath) {
  const Scenario scenario = test::circle_by_radars();
  const localise::FitProblem fit(scenario);
  const localise::Location found = localise::locate(scenario);
  ASSERT_FALSE(found.branches.empty());
  const localise::Branch& best = found.branches.front();
  for (double t = 0.0; t <= 240.0; t += 15.0) {
    const Eigen::Vector3d position = fit.trajectory().nominal.position(t) +
                                     fit.trajectory().coordinates.spline(best.minimum.z).position(t);
    EXPECT_NEAR((position - test::circle(t)).norm(), 0.0, 10.0) << t;
  }
}

}  // namespace
