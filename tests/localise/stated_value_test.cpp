// SPDX-License-Identifier: Apache-2.0
// Constrained fits and stated values against independent numbers.
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "localise/reference_cases.hpp"
#include "trammel/localise/levenberg_marquardt.hpp"
#include "trammel/localise/stated_value.hpp"

namespace {

using namespace trammel;

/// Fits with F to its last digits, so that positions keep seven.
const localise::FitSettings kTight{.max_systems = 5000, .relative_decrease = 1e-19};
/// Weight of the barriers at the linearisation point.
constexpr double kReferenceWeight = 4.5;

struct Case {
  std::string name;
  std::function<Scenario()> scenario;
  std::optional<double> floor;
  bool below;  ///< start from the path that dives through the station's plane
  double chi2, cost;
  std::vector<double> times;
  std::vector<Eigen::Vector3d> reference, estimate;
  double g_lin, beta, kappa;
  std::optional<double> fixed_point;
  std::vector<double> tube;  ///< first, middle, last measurement of the first station
};

Eigen::VectorXd start_of(const localise::FitProblem& fit, bool below) {
  Eigen::VectorXd z = Eigen::VectorXd::Zero(fit.parameters());
  if (below) {
    Eigen::VectorXd theta = Eigen::VectorXd::Zero(27);
    theta(3 * 5 + 2) = -10.0;  // segments 3 to 5, upwards
    theta(3 * 6 + 2) = -20.0;
    theta(3 * 7 + 2) = 5.0;
    return fit.trajectory().coordinates.from_motion(theta);
  }
  for (const double mu : {30.0, 10.0}) {
    z = localise::fit_levenberg_marquardt(fit, z, mu).z;
  }
  return z;
}

class ReferenceCase : public testing::TestWithParam<Case> {};

TEST_P(ReferenceCase, AgreesWithIndependentNumbers) {
  const Case& expected = GetParam();
  const Scenario scenario = expected.scenario();
  const localise::FitProblem fit(scenario, expected.floor);
  const localise::Fit reference =
      localise::fit_levenberg_marquardt(fit, start_of(fit, expected.below), kReferenceWeight, kTight);
  ASSERT_TRUE(reference.converged) << reference.decrement << " after " << reference.systems;
  constexpr double kRelative = 1e-6;
  EXPECT_NEAR(reference.chi2, expected.chi2, kRelative * expected.chi2);
  EXPECT_NEAR(reference.cost, expected.cost, kRelative * std::abs(expected.cost));

  minimax::SolverSettings solver;
  solver.relative_gap = 1e-10;
  const localise::StatedValue stated = localise::state(fit, reference.z, {}, solver);
  EXPECT_EQ(stated.solution.claim, Claim::kVerified);
  const auto deviation = fit.trajectory().coordinates.spline(reference.z);
  const auto estimate = stated.problem.coordinates.spline(stated.z);
  for (std::size_t i = 0; i < expected.times.size(); ++i) {
    const double t = expected.times[i];
    const Eigen::Vector3d nominal = stated.problem.nominal.position(t);
    EXPECT_LT((nominal + deviation.position(t) - expected.reference[i]).norm(),
              kRelative * expected.reference[i].norm())
        << t;
    EXPECT_LT((nominal + estimate.position(t) - expected.estimate[i]).norm(),
              kRelative * expected.estimate[i].norm())
        << t;
  }
  EXPECT_NEAR(stated.linear_guarantee_rms_m, expected.g_lin, kRelative * expected.g_lin);
  // The curvature term depends on the prior to first order, the guarantee to second.
  constexpr double kFirstOrder = 1e-5;
  EXPECT_NEAR(stated.curvature_rms_m, expected.beta, kFirstOrder * expected.beta);
  EXPECT_NEAR(stated.kappa, expected.kappa, kFirstOrder * expected.kappa);
  EXPECT_LE(stated.curvature_lower_rms_m, stated.curvature_rms_m);
  EXPECT_GE(stated.curvature_lower_rms_m, 0.5 * stated.curvature_rms_m);
  EXPECT_EQ(stated.model_error_rms_m, 0.0);
  EXPECT_NEAR(stated.sum_rms_m, expected.g_lin + expected.beta, kRelative * 10 * stated.sum_rms_m);
  ASSERT_EQ(stated.fixed_point_rms_m.has_value(), expected.fixed_point.has_value());
  if (expected.fixed_point) {
    // The independent iteration stopped at its third round, just below the fixed point; the closed form for
    // remainders that grow exactly as the square of the radii is below it too.
    constexpr double kLastRounds = 3e-5;
    EXPECT_NEAR(*stated.fixed_point_rms_m, *expected.fixed_point, kLastRounds * *expected.fixed_point);
    const double quadratic = (1 - std::sqrt(1 - 4 * stated.kappa)) / (2 * stated.kappa);
    EXPECT_GE(*stated.fixed_point_rms_m, (1 - 1e-12) * quadratic * stated.linear_guarantee_rms_m);
    EXPECT_EQ(stated.consistency, localise::Consistency::kSelfConsistent);
    EXPECT_EQ(stated.stated_rms_m, *stated.fixed_point_rms_m);
  } else {
    EXPECT_EQ(stated.consistency, localise::Consistency::kCurvatureDominated);
    EXPECT_EQ(stated.stated_rms_m, stated.sum_rms_m);
  }
  const std::size_t last = scenario.stations[0].times_s.size() - 1;
  const std::vector<std::size_t> places{0, last / 2, last};
  for (std::size_t i = 0; i < places.size(); ++i) {
    // Of first order in the gain, and at single times: the independent solve was the less accurate one (these
    // values move by less than 1e-6 of themselves as relative_gap falls from 1e-10 to 1e-12).
    EXPECT_NEAR(stated.tube_m[places[i]], expected.tube[i], 1e-4 * expected.tube[i]);
  }
}

INSTANTIATE_TEST_SUITE_P(Localise, ReferenceCase,
                         testing::Values(Case{"descent_without_noise",
                                              [] { return test::descent_scenario(1, 0); },
                                              0.0,
                                              false,
                                              21.19600738,
                                              -313.9695534,
                                              {0, 35, 70},
                                              {{1001.15191, 1001.40006, 4999.47928},
                                               {8394.75272, 8386.48715, 4680.85308},
                                               {15785.431, 15767.9999, 2823.00671}},
                                              {{999.22055, 999.071766, 5000.95516},
                                               {8396.25521, 8388.79141, 4673.97897},
                                               {15825.9015, 15822.3724, 2210.81979}},
                                              259.735462,
                                              288.207398,
                                              1.10962,
                                              std::nullopt,
                                              {104.401743, 131.646331, 957.424112}},
                                         Case{"descent",
                                              [] { return test::descent_scenario(1, 1); },
                                              0.0,
                                              false,
                                              229.7704509,
                                              -209.6318529,
                                              {0, 35, 70},
                                              {{1005.51469, 1005.54489, 5000.722},
                                               {8394.66754, 8386.65161, 4680.58022},
                                               {15747.5875, 15791.9507, 2910.09896}},
                                              {{1006.65459, 1007.19072, 5001.14318},
                                               {8396.09377, 8388.29064, 4674.48656},
                                               {15785.8735, 15826.8658, 2426.14397}},
                                              255.959147,
                                              300.544258,
                                              1.17419,
                                              std::nullopt,
                                              {106.063202, 125.610238, 929.3568}},
                                         Case{"mirrored_descent",
                                              [] { return test::descent_scenario(1, 0); },
                                              std::nullopt,
                                              true,
                                              18.59792665,
                                              15.74594933,
                                              {0, 35, 70},
                                              {{1001.11966, 1001.389, 4999.42511},
                                               {8403.60374, 8398.161, 4640.88899},
                                               {15798.8848, 15785.8681, -2643.63394}},
                                              {{1000.04347, 1000.00909, 4999.53653},
                                               {8391.0551, 8381.85346, 4689.52008},
                                               {15817.6149, 15811.2556, -2434.91411}},
                                              305.845293,
                                              825.736734,
                                              2.69985,
                                              std::nullopt,
                                              {59.2281393, 113.57832, 971.433457}},
                                         Case{"noisy_descent",
                                              [] { return test::descent_scenario(5, 1); },
                                              0.0,
                                              false,
                                              220.234611,
                                              -221.0166768,
                                              {0, 35, 70},
                                              {{1004.28749, 1003.5409, 5001.67294},
                                               {8379.5081, 8366.26685, 4738.0614},
                                               {15650.4928, 15720.2108, 3728.78266}},
                                              {{1008.49548, 1008.90364, 5000.53905},
                                               {8393.90478, 8384.4181, 4680.82329},
                                               {15768.1215, 15840.6287, 2624.60754}},
                                              428.128309,
                                              465.489696,
                                              1.08727,
                                              std::nullopt,
                                              {128.856687, 247.509673, 1512.48523}},
                                         Case{"turn_by_radar",
                                              test::turn_by_radar,
                                              std::nullopt,
                                              false,
                                              177.9361114,
                                              113.0199468,
                                              {0, 30, 60},
                                              {{12017.1537, 16998.4214, 1505.8274},
                                               {13947.4417, 14545.7417, 1620.02284},
                                               {11126.0555, 13187.8593, 1735.12513}},
                                              {{12021.2212, 16995.6114, 1510.68479},
                                               {13946.1129, 14547.1963, 1619.9089},
                                               {11135.6085, 13183.3426, 1732.32217}},
                                              18.4698772,
                                              0.0467161106,
                                              0.00252931,
                                              18.5168303,
                                              {40.4681702, 20.6317723, 51.7683568}},
                                         Case{"turn_by_ranges",
                                              test::turn_by_ranges,
                                              0.0,
                                              false,
                                              178.7346768,
                                              -351.42211,
                                              {0, 30, 60},
                                              {{12005.8437, 17002.0333, 1520.35184},
                                               {13947.5505, 14545.6721, 1626.39783},
                                               {11121.3323, 13206.8926, 1741.85287}},
                                              {{12014.8682, 16999.7399, 1547.19308},
                                               {13943.1046, 14549.7592, 1619.6499},
                                               {11132.8135, 13192.1713, 1729.64517}},
                                              34.8797263,
                                              1.38459544,
                                              0.0396963,
                                              36.3859798,
                                              {81.4660997, 43.227902, 113.397985}}),
                         [](const auto& tested) { return tested.param.name; });

TEST(FitProblem, HasTheDerivativesOfItsCost) {
  for (const Scenario& scenario : {test::descent_scenario(1, 1), test::errant_scenario()}) {
    const localise::FitProblem fit(scenario, 0.0);
    const Eigen::VectorXd theta = Eigen::VectorXd::Constant(27, 3.0);
    const auto q = static_cast<Eigen::Index>(bias_parameters(scenario).size());
    const Eigen::VectorXd z =
        fit.trajectory().coordinates.from_motion(theta, Eigen::VectorXd::Constant(q, 1e-3));
    ASSERT_EQ(z.size(), 27 + q);
    ASSERT_TRUE(fit.inside(z));
    const double mu = 50.0;  // barriers and measurements both count
    const localise::Quadratic at = fit.expand(z, mu);
    EXPECT_NEAR(at.cost, fit.cost(z, mu), 1e-9 * std::abs(at.cost));
    for (Eigen::Index i = 0; i < z.size(); ++i) {
      const Eigen::VectorXd step = 1e-6 * Eigen::VectorXd::Unit(z.size(), i);
      const double slope = (fit.cost(z + step, mu) - fit.cost(z - step, mu)) / 2e-6;
      EXPECT_NEAR(at.gradient(i), slope, 1e-5 * (at.gradient.norm() + 1.0)) << i;
    }
    EXPECT_NEAR(fit.chi2(z), 2 * fit.cost(z, 0.0), 1e-9 * fit.chi2(z));
    // The Jacobian of the fit is that of the problem linearised there.
    const auto deviation = fit.trajectory().coordinates.spline(z);
    const TrajectoryProblem linear = assemble(
        scenario, &deviation, fit.trajectory().coordinates.time_offsets_s(z, scenario.stations.size()));
    const Eigen::VectorXd scale = linear.coordinates.from_motion(
        theta, Eigen::VectorXd::Constant(q, 1e-3));  // the same point in the other's coordinates
    const Eigen::MatrixXd& F = linear.problem.information_factor;
    EXPECT_NEAR((F * scale).squaredNorm(), z.dot(fit.expand(z, 0.0).hessian * z),
                1e-9 * (F * scale).squaredNorm());
  }
}

// Undamped steps overshoot here, by less than F resolves.
TEST(FitLevenbergMarquardt, SettlesToTheLastDigits) {
  const localise::FitProblem fit(test::errant_scenario(), 0.0);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(fit.parameters());
  const localise::Fit coarse = localise::fit_levenberg_marquardt(fit, zero, 30.0);
  const localise::Fit fine = localise::fit_levenberg_marquardt(fit, coarse.z, kReferenceWeight, kTight);
  EXPECT_TRUE(fine.converged);
  EXPECT_LT(fine.systems, 1000);
}

TEST(FitProblem, PullsBiasesInside) {
  const localise::FitProblem fit(test::errant_scenario(), 0.0);
  const MotionCoordinates& coordinates = fit.trajectory().coordinates;
  const Eigen::VectorXd biases = Eigen::VectorXd::Constant(5, 0.1);
  const Eigen::VectorXd wide = coordinates.from_motion(Eigen::VectorXd::Zero(27), biases);
  EXPECT_FALSE(fit.inside(wide));
  const Eigen::VectorXd pulled = fit.pull_inside(wide, 0.5, Eigen::VectorXd::Zero(wide.size()));
  EXPECT_TRUE(fit.inside(pulled));
  EXPECT_NEAR((fit.trajectory().problem.ellipsoids[9] * pulled).norm(), 0.5, 1e-12);
  // The second station's were small enough but for the clock: 0.1 of 1 and of 0.2.
  EXPECT_NEAR((fit.trajectory().problem.ellipsoids[10] * pulled).norm(), 0.5, 1e-12);
}

TEST(FitProblem, KnowsItsBoundsAndItsFloor) {
  const localise::FitProblem fit(test::descent_scenario(1, 0), 4500.0);
  const MotionCoordinates& coordinates = fit.trajectory().coordinates;
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(27);
  EXPECT_DOUBLE_EQ(fit.lowest_height_m(coordinates.from_motion(theta)), 5000.0);
  theta(5) = -9.0;  // descends 630 m, within the bound of 10 m/s
  const Eigen::VectorXd low = coordinates.from_motion(theta);
  EXPECT_NEAR(fit.lowest_height_m(low), 4370.0, 1e-6);
  EXPECT_FALSE(fit.inside(low));
  EXPECT_TRUE(std::isinf(fit.cost(low, 1.0)));
  EXPECT_THROW((void)localise::fit_levenberg_marquardt(fit, low, 1.0), Error);
  EXPECT_THROW((void)localise::state(fit, low), Error);
  theta(5) = -20.0;
  theta(26) = 50.0;
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(fit.parameters());
  const Eigen::VectorXd pulled = fit.pull_inside(coordinates.from_motion(theta), 0.95, zero);
  EXPECT_TRUE(fit.inside(pulled));
  EXPECT_GT(pulled.norm(), 0.0);
  EXPECT_THROW(localise::FitProblem(zoo::manoeuvre_scenario(7, 1.0)), Error);
}

TEST(StatedValue, CountsTheModelErrorAsABoxOrAsAnEllipsoid) {
  const localise::FitProblem fit(test::turn_by_radar());
  const Eigen::VectorXd reference =
      localise::fit_levenberg_marquardt(fit, start_of(fit, false), kReferenceWeight).z;
  const localise::ModelError ellipsoid{.position_m = 2.0};
  const localise::ModelError box{.kind = localise::ModelError::Kind::kBox, .position_m = 2.0};
  const auto none = localise::state(fit, reference);
  const auto round = localise::state(fit, reference, ellipsoid);
  const auto square = localise::state(fit, reference, box);
  EXPECT_EQ(none.model_error_rms_m, 0.0);
  EXPECT_GT(round.model_error_rms_m, 2.0);
  EXPECT_GT(square.model_error_rms_m, round.model_error_rms_m);
  EXPECT_GT(round.curvature_rms_m, none.curvature_rms_m);  // the tube is wider by the model error
  EXPECT_NEAR(round.sum_rms_m, round.linear_guarantee_rms_m + round.curvature_rms_m + round.model_error_rms_m,
              1e-9);
  const auto twice = localise::state(fit, reference, {.position_m = 4.0});
  EXPECT_NEAR(twice.model_error_rms_m, 2 * round.model_error_rms_m, 1e-9);
}

TEST(ModelError, OfASplineThroughAJerkIsFavards) {
  const localise::ModelError error = localise::model_error_from_jerk(0.5, 10.0);
  EXPECT_DOUBLE_EQ(error.position_m, 500.0 / 24);
  // The extremal error itself: third derivative +-j in turn, velocity j T^2/8 at most.
  EXPECT_GE(error.velocity_mps, 0.5 * 100.0 / 8);
  EXPECT_EQ(localise::model_error_from_jerk(0.0, 10.0).position_m, 0.0);
  EXPECT_THROW((void)localise::model_error_from_jerk(-1.0, 10.0), Error);
  EXPECT_THROW((void)localise::model_error_from_jerk(1.0, 0.0), Error);
}

}  // namespace
