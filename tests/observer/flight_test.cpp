// SPDX-License-Identifier: Apache-2.0
#include "trammel/observer/flight.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "cases.hpp"
#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/observer/plan_limits.hpp"

namespace {

using trammel::observer::BearingFilter;
using trammel::observer::BearingKind;
using trammel::observer::FilterKind;
using trammel::observer::FlightEvent;
using trammel::observer::FlightLoop;
using trammel::observer::FlightOutcome;
using trammel::observer::FlightSettings;
using trammel::observer::Plan;
using trammel::observer::PlanProblem;
using trammel::test::kPaperCovariance;
using trammel::test::paper_problem;

PlanProblem paper(double beta) {
  return paper_problem({-10000, 50, -100}, kPaperCovariance, 80, {beta, 0, 0});
}

/// The deterministic "noise" of the reference flights.
class SineNoise {
 public:
  explicit SineNoise(bool on) : on_(on) {}
  Eigen::Vector2d operator()() {
    ++count_;
    if (!on_) {
      return Eigen::Vector2d::Zero();
    }
    return std::numbers::sqrt2 * Eigen::Vector2d(std::sin(1.7 * count_), std::cos(2.3 * count_));
  }

 private:
  bool on_;
  int count_ = 0;
};

struct ReferenceLoop {
  std::array<double, 3> start;
  double beta;
  bool noise;
  double error;
  double miss;
  double effort;
  std::array<double, 6> covariance;     // 11, 12, 13, 22, 23, 33; a zero 11: only its square root is known
  std::array<double, 4> plan_half_way;  // estimate and xi of the plan at 40 s
};

// Computed by two independent programs that agree to 1e-6.
const std::vector<ReferenceLoop> kReferenceLoops{
    {{-10000.0, 50.0, -100.0},
     1e-06,
     false,
     0.0,
     0.0,
     150.0,
     {18289.184009175435, -45.40285194513712, 90.80570389027497, 0.3114167778648927, -0.22542492477716514,
      0.6495541650306429},
     {-6000.0, 25.00160595578709, -50.00321191157418, 0.06934173188302724}},
    {{-10000.0, 50.0, -100.0},
     1e-06,
     true,
     -19.262256719012157,
     0.20058656747809192,
     150.28364184683866,
     {19256.253618177318, -45.110907818874864, 90.17235200221961, 0.3192855518328983, -0.21124340900576105,
      0.6358611008594596},
     {-6331.620171969425, 25.93970649310884, -51.87281497731457, 0.06699892956936383}},
    {{-10000.0, 50.0, -100.0},
     0.1,
     false,
     0.0,
     0.0,
     175.87583694642382,
     {3572.3870578262267, -8.87285458964574, 17.745709179291403, 0.22074211465502178, -0.04407559835742056,
      0.2868555121911515},
     {-6000.0, 40.81701543251987, -81.63403086503983, 4.208866846548159}},
    {{-10000.0, 50.0, -100.0},
     0.1,
     true,
     -5.826193307779022,
     0.0656165168014846,
     177.78808697241632,
     {3588.0966886282263, -8.303530027572418, 16.56301897885264, 0.22482546402609876, -0.038329938508632644,
      0.2820661140414525},
     {-6141.320188786005, 42.19367883929923, -84.40313321510861, 4.167419742135412}},
    {{-10000.0, 50.0, -100.0},
     10.0,
     false,
     0.0,
     0.0,
     549.0639390035759,
     {419.508925802896, -1.0189032485710863, 2.037806497141977, 0.2011790276125598, -0.0049494242724951835,
      0.20860316402129972},
     {-6000.0, 89.06741410312065, -178.13482820624168, 4.921536666831873}},
    {{-10000.0, 50.0, -100.0},
     10.0,
     true,
     -1.0040784707134662,
     0.061114906911991465,
     554.5599725990728,
     {418.5108180184849, -1.2000594309616117, 2.3894962554711086, 0.2027489114576588, -0.006851764382583806,
      0.2129506781342893},
     {-5996.093761474059, 90.93788465322359, -182.3205411636286, 4.908589431007283}},
    {{-9500.0, 60.0, -85.0},
     1e-06,
     false,
     -16.125302373279283,
     0.09106522504255252,
     145.12594444995761,
     {15279.186885904466, -42.742873175110034, 60.16136362721223, 0.27208951450587643, -0.1682988469714892,
      0.3894018086486822},
     {-5954.924022611862, 31.239853689013675, -43.96239539274019, 0.07360431704290185}},
    {{-9500.0, 60.0, -85.0},
     1e-06,
     true,
     -36.84493448113494,
     0.2852126076925417,
     145.40286698948935,
     {16274.120912959326, -42.662482422437236, 60.03655007288777, 0.2758572769346141, -0.15738535284868868,
      0.3854976039146564},
     {-6270.723434901383, 32.33220597296735, -45.52415395797336, 0.07118932188603919}},
    {{-9500.0, 60.0, -85.0},
     0.1,
     false,
     -1.7066980560159664,
     0.015178457166152013,
     167.04683919988454,
     {2566.4495975296363, -7.347417123869336, 10.314390823582727, 0.16928424712874054, -0.029528782420828622,
      0.18970238420024166},
     {-5788.893023011967, 51.313267769048956, -72.58605868373125, 4.267908193763472}},
    {{-9500.0, 60.0, -85.0},
     0.1,
     true,
     -6.096083030680575,
     0.07578779212364503,
     168.9326982358396,
     {2580.053396379469, -6.779731088125604, 9.491956359141913, 0.17055506341690227, -0.024942472781963355,
      0.1876603225400233},
     {-5906.258866587539, 52.96846339381603, -74.96272258927426, 4.228567871230535}},
    {{-9500.0, 60.0, -85.0},
     10.0,
     false,
     -0.21302831523439636,
     0.008543021564003496,
     476.3238641608723,
     {295.1287857976588, -1.3717341479374796, 1.9485722479069276, 0.1490647520018155, -0.009056802388667918,
      0.15555439084717057},
     {-5531.493080595224, 104.71681589245468, -150.34267751927328, 5.0289953919971095}},
    {{-9500.0, 60.0, -85.0},
     10.0,
     true,
     -0.7854547324773193,
     0.05394019110666273,
     482.2298882358854,
     {294.2717792925043, -1.4737971336246036, 2.0982133201337163, 0.15047162094005062, -0.010508451691768046,
      0.1580510808225772},
     {-5530.7284475552, 106.4795607815498, -153.20819463784034, 5.011575448690418}},
};

class ClosedLoop : public testing::TestWithParam<ReferenceLoop> {};

TEST_P(ClosedLoop, IsReproduced) {
  const ReferenceLoop& r = GetParam();
  const FlightLoop loop(paper(r.beta), FlightSettings{});
  EXPECT_EQ(loop.measurements(), 400);
  Eigen::Vector3d half_way = Eigen::Vector3d::Zero();
  double xi = 0.0;
  SineNoise noise(r.noise);
  const FlightOutcome outcome =
      loop.fly(Eigen::Vector3d(r.start[0], r.start[1], r.start[2]), noise,
               [&](const FlightEvent& event, const auto&, const auto& filter) {
                 if (event.time_s == 40.0) {
                   half_way = filter.position();
                   bool moved = false;
                   xi = loop.plan_from(half_way, filter.covariance(), 40.0, moved).xi;
                 }
               });
  constexpr double kLoopTolerance = 1e-6;
  EXPECT_NEAR(outcome.error.x(), r.error, kLoopTolerance * (1.0 + std::abs(r.error)));
  EXPECT_NEAR(outcome.miss_m, r.miss, kLoopTolerance * (1.0 + r.miss));
  EXPECT_NEAR(outcome.effort_m, r.effort, kLoopTolerance * r.effort);
  const Eigen::Matrix3d expected = trammel::test::symmetric(r.covariance);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      EXPECT_NEAR(outcome.covariance(i, j), expected(i, j),
                  kLoopTolerance * std::sqrt(expected(i, i) * expected(j, j)));
    }
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(half_way[i], r.plan_half_way[static_cast<std::size_t>(i)], kLoopTolerance * half_way.norm());
  }
  EXPECT_NEAR(xi, r.plan_half_way[3], kLoopTolerance * xi);
  EXPECT_EQ(outcome.skipped, 0);
  EXPECT_EQ(outcome.moved_back, 0);
}

INSTANTIATE_TEST_SUITE_P(Paper, ClosedLoop, testing::ValuesIn(kReferenceLoops));

struct PublishedLoop {
  std::array<double, 3> start;
  double beta;
  bool noise;
  double error;
  double miss;
  double effort;
  double sigma_x;
};

TEST(Flight, PublishedLoops) {
  const std::vector<PublishedLoop> loops{
      {{-9500, 60, -85}, 0.1, false, -1.70669806, 0.0151784572, 167.046839, 50.6601382},
      {{-9500, 60, -85}, 0.1, true, -6.09608303, 0.0757877921, 168.932698, 50.794226},
      {{-9500, 60, -85}, 10, false, -0.213028315, 0.00854302156, 476.323864, 17.1793127},
      {{-9500, 60, -85}, 10, true, -0.785454732, 0.0539401911, 482.229888, 17.1543516},
      {{-9500, 60, -85}, 1e-6, true, -36.8449345, 0.285212608, 145.402867, 127.570063},
      {{-10700, 30, -120}, 10, false, 1.10441462, 0.0261746175, 602.437857, 24.6771522},
      {{-10700, 30, -120}, 10, true, -0.917460148, 0.0920880844, 607.645809, 24.6775487}};
  for (const PublishedLoop& r : loops) {
    const FlightLoop loop(paper(r.beta), FlightSettings{});
    const FlightOutcome outcome =
        loop.fly(Eigen::Vector3d(r.start[0], r.start[1], r.start[2]), SineNoise(r.noise));
    EXPECT_NEAR(outcome.error.x(), r.error, 1e-6 * std::abs(r.error));
    EXPECT_NEAR(outcome.miss_m, r.miss, 1e-6);
    EXPECT_NEAR(outcome.effort_m, r.effort, 1e-6 * r.effort);
    EXPECT_NEAR(std::sqrt(outcome.covariance(0, 0)), r.sigma_x, 1e-6 * r.sigma_x);
  }
}

/// Lockstep flights are the single flights up to rounding, whatever is measured and weighted.
TEST(Flight, LanesFlyAsAlone) {
  using trammel::Packet;
  PlanProblem general = paper(0.1);
  general.beta_per_s.y() = 1000.0;
  FlightSettings angles;
  angles.measured = BearingKind::kAngles;
  FlightSettings limited;
  limited.max_lateral_speed_mps = 4.0;
  limited.replan_interval_s = 10.0;
  const std::array<FlightLoop, 5> loops{FlightLoop(paper(10.0), FlightSettings{}),
                                        FlightLoop(paper(0.0), FlightSettings{}),
                                        FlightLoop(general, FlightSettings{}), FlightLoop(paper(0.1), angles),
                                        FlightLoop(paper(10.0), limited)};
  for (const FlightLoop& loop : loops) {
    trammel::observer::Vector3<Packet> starts;
    for (std::size_t lane = 0; lane < Packet::kLanes; ++lane) {
      const double part = static_cast<double>(lane);
      // The last one is where its estimate has to be moved back for planning.
      starts[0].set(lane, lane + 1 == Packet::kLanes ? -7600.0 : -9000.0 - 200.0 * part);
      starts[1].set(lane, 40.0 + 3.0 * part);
      starts[2].set(lane, -90.0 - 2.0 * part);
    }
    SineNoise noise(true);
    const auto together = loop.fly_lanes<Packet>(
        starts, [&] { return noise().cast<Packet>().eval(); }, [](const auto&...) {});
    for (std::size_t lane = 0; lane < Packet::kLanes; ++lane) {
      const FlightOutcome alone =
          loop.fly({starts[0][lane], starts[1][lane], starts[2][lane]}, SineNoise(true));
      const FlightOutcome& here = together[lane];
      EXPECT_NEAR(here.error.x(), alone.error.x(), 1e-6 * (1.0 + std::abs(alone.error.x()))) << lane;
      EXPECT_NEAR(here.miss_m, alone.miss_m, 1e-6 * (1.0 + alone.miss_m)) << lane;
      EXPECT_NEAR(here.effort_m, alone.effort_m, 1e-6 * alone.effort_m) << lane;
      EXPECT_NEAR(here.energy, alone.energy, 1e-5 * alone.energy) << lane;
      EXPECT_EQ(here.moved_back, alone.moved_back) << lane;
      EXPECT_EQ(here.skipped, alone.skipped) << lane;
    }
    EXPECT_GT(together[Packet::kLanes - 1].moved_back, 0);
  }
}

TEST(Flight, EventsJoinWhatCoincides) {
  const auto events = trammel::observer::flight_events(1.0, 0.2, 0.3);
  const std::vector<FlightEvent> expected{{0, false, true},   {0.2, true, false}, {0.3, false, true},
                                          {0.4, true, false}, {0.6, true, true},  {0.8, true, false},
                                          {0.9, false, true}, {1.0, true, false}};
  ASSERT_EQ(events.size(), expected.size());
  for (std::size_t k = 0; k < events.size(); ++k) {
    EXPECT_NEAR(events[k].time_s, expected[k].time_s, 1e-12);
    EXPECT_EQ(events[k].measure, expected[k].measure) << k;
    EXPECT_EQ(events[k].replan, expected[k].replan) << k;
  }
  const auto open = trammel::observer::flight_events(1.0, 0.3, std::numeric_limits<double>::infinity());
  ASSERT_EQ(open.size(), 5U);
  EXPECT_FALSE(open.back().measure);
  EXPECT_EQ(trammel::observer::flight_events(1.0, 2.0, 5.0).size(), 2U);
}

TEST(Flight, OpenLoopFollowsOnePlan) {
  FlightSettings settings;
  settings.replan_interval_s = std::numeric_limits<double>::infinity();
  const FlightLoop loop(paper(10.0), settings);
  const FlightOutcome outcome = loop.fly(Eigen::Vector3d(-9800, 61, -87), SineNoise(true));
  // The start was 11 m and 13 m off the mean; nothing corrects it.
  EXPECT_NEAR(outcome.final_position.y(), 11.0, 1e-9);
  EXPECT_NEAR(outcome.final_position.z(), 13.0, 1e-9);
}

TEST(Flight, WithoutMeasurementsNothingIsLearnt) {
  PlanProblem prior = paper(10.0);
  prior.measurement_interval_s = 100.0;
  const FlightLoop loop(prior, FlightSettings{});
  EXPECT_EQ(loop.measurements(), 0);
  const FlightOutcome outcome = loop.fly(Eigen::Vector3d(-9500, 60, -85), SineNoise(true));
  EXPECT_NEAR(outcome.error.x(), -500.0, 1e-9);
  EXPECT_LT((outcome.covariance - prior.covariance_m2).norm(), 1e-6);
}

TEST(Flight, EstimatesBehindThePlaneAreMovedBack) {
  const FlightLoop loop(paper(1.0), FlightSettings{});
  bool moved = false;
  const Plan plan = loop.plan_from(Eigen::Vector3d(-7900, 40, -80), paper(1.0).covariance_m2, 0.0, moved);
  EXPECT_TRUE(moved);
  EXPECT_DOUBLE_EQ(plan.x_start_m, -8200.0);
  EXPECT_NEAR(plan.position(0.0).y(), 40.0, 1e-9);
  EXPECT_TRUE(std::isfinite(plan.cost));
  (void)loop.plan_from(Eigen::Vector3d(-9000, 40, -80), paper(1.0).covariance_m2, 0.0, moved);
  EXPECT_FALSE(moved);
  // A truth behind the plane: the flight is still defined.
  const FlightOutcome outcome = loop.fly(Eigen::Vector3d(-7500, 40, -80), SineNoise(true));
  EXPECT_TRUE(outcome.error.allFinite());
  EXPECT_TRUE(outcome.covariance.allFinite());
}

TEST(Flight, RespectsTheSpeedLimit) {
  FlightSettings settings;
  settings.max_lateral_speed_mps = 6.0;
  const FlightLoop loop(paper(10.0), settings);
  double fastest = 0.0;
  double previous_time = 0.0;
  Eigen::Vector3d previous = Eigen::Vector3d::Zero();
  (void)loop.fly(Eigen::Vector3d(-9500, 60, -85), SineNoise(true),
                 [&](const FlightEvent& event, const Eigen::Vector3d& truth, const auto&) {
                   if (event.time_s > 0.0) {
                     fastest = std::max(fastest,
                                        (truth - previous).tail<2>().norm() / (event.time_s - previous_time));
                   }
                   previous = truth;
                   previous_time = event.time_s;
                 });
  EXPECT_LE(fastest, 6.0 + 1e-9);
  EXPECT_GT(fastest, 5.0);
}

TEST(Bearing, JacobiansMatchDifferences) {
  for (const BearingKind kind : {BearingKind::kTangents, BearingKind::kAngles}) {
    const Eigen::Vector3d position(-1300.0, 410.0, -270.0);
    const auto measured = trammel::observer::bearing(kind, position);
    for (int j = 0; j < 3; ++j) {
      const Eigen::Vector3d h = 0.01 * Eigen::Vector3d::Unit(j);
      const Eigen::Vector2d difference = (trammel::observer::bearing_value<double>(kind, position + h) -
                                          trammel::observer::bearing_value<double>(kind, position - h)) /
                                         0.02;
      EXPECT_LT((difference - measured.J_bearing_position.col(j)).norm(), 1e-12);
    }
  }
}

// The angles are those of the beacon as the vehicle sees it, and agree with the tangents to first order.
TEST(Bearing, AnglesHaveTheSignsOfTheTangents) {
  const Eigen::Vector3d position(-1000.0, 3.0, -4.0);
  const Eigen::Vector2d tangents = trammel::observer::bearing_value(BearingKind::kTangents, position);
  const Eigen::Vector2d angles = trammel::observer::bearing_value(BearingKind::kAngles, position);
  EXPECT_LT((tangents - angles).norm(), 1e-7);
}

TEST(Filter, InformationFormEqualsTheCovarianceForm) {
  trammel::RandomStream random(3);
  for (const BearingKind kind : {BearingKind::kTangents, BearingKind::kAngles}) {
    Eigen::Vector3d position(-10000, 50, -100);
    Eigen::Matrix3d covariance = paper(1.0).covariance_m2;
    covariance(0, 1) = covariance(1, 0) = -3000.0;
    BearingFilter filter(position, covariance, 0.002, kind, 0.0);
    for (int i = 0; i < 300; ++i) {
      const Eigen::Vector3d move(20.0, random.normal(), random.normal());
      const Eigen::Vector2d measured(0.005 + 0.002 * random.normal(), -0.003 + 0.002 * random.normal());
      position += move;
      filter.move(move);
      ASSERT_TRUE(filter.update(measured));
      // Joseph form.
      const auto h = trammel::observer::bearing(kind, position);
      const auto& jacobian = h.J_bearing_position;
      const Eigen::Matrix2d noise = 0.002 * 0.002 * Eigen::Matrix2d::Identity();
      const Eigen::Matrix2d innovation = jacobian * covariance * jacobian.transpose() + noise;
      const Eigen::Matrix<double, 3, 2> gain = innovation.llt().solve(jacobian * covariance).transpose();
      position += gain * (measured - h.value);
      const Eigen::Matrix3d rest = Eigen::Matrix3d::Identity() - gain * jacobian;
      covariance = (rest * covariance * rest.transpose() + gain * noise * gain.transpose()).eval();
    }
    EXPECT_LT((filter.position() - position).norm(), 1e-6);
    EXPECT_LT((filter.covariance() - covariance).norm(), 1e-8 * covariance.norm());
    EXPECT_LT((filter.covariance() * filter.information() - Eigen::Matrix3d::Identity()).norm(), 1e-9);
  }
}

TEST(Filter, GateSkipsMeasurementsNearThePlane) {
  BearingFilter filter(Eigen::Vector3d(-60, 1, 2), paper(1.0).covariance_m2, 0.002, BearingKind::kTangents,
                       50.0);
  const Eigen::Matrix3d before = filter.covariance();
  EXPECT_TRUE(filter.update({0.1, 0.1}));
  BearingFilter near(Eigen::Vector3d(-49, 1, 2), before, 0.002, BearingKind::kTangents, 50.0);
  EXPECT_FALSE(near.update({0.1, 0.1}));
  EXPECT_LT((near.covariance() - before).norm(), 1e-6);
  BearingFilter behind(Eigen::Vector3d(3, 1, 2), before, 0.002, BearingKind::kTangents, 0.0);
  EXPECT_FALSE(behind.update({0.1, 0.1}));
}

// A posterior by brute force: the likelihood of all measurements on a fine grid over x with y, z integrated
// out as a joint Gaussian least-squares problem.
TEST(Filter, RangeGridIsExactBayes) {
  Eigen::Matrix3d covariance;
  covariance << 250000, -1500, 2500, -1500, 400, 60, 2500, 60, 225;
  const Eigen::Vector3d mean(-5000, 50, -80);
  const double sigma0 = 0.002;
  trammel::observer::RangeGridFilter filter(mean, covariance, sigma0, 301);
  filter.restrict_start(-4300.0);
  trammel::RandomStream random(11);
  std::vector<Eigen::Vector3d> shifts;
  std::vector<Eigen::Vector2d> measured;
  Eigen::Vector3d truth(-5300, 66, -95);
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d move(100.0, 8.0 * std::sin(0.3 * i), 5.0 * std::cos(0.2 * i));
    truth += move;
    shift += move;
    filter.move(move);
    measured.emplace_back(truth.tail<2>() / truth.x() +
                          sigma0 * Eigen::Vector2d(random.normal(), random.normal()));
    shifts.push_back(shift);
    ASSERT_TRUE(filter.update(measured.back()));
  }
  const Eigen::Vector2d slope = covariance.block<2, 1>(1, 0) / covariance(0, 0);
  const Eigen::Matrix2d conditional = covariance.block<2, 2>(1, 1) - slope * covariance.block<1, 2>(0, 1);
  constexpr int kNodes = 20000;
  std::vector<double> logs;
  std::vector<double> nodes;
  std::vector<Eigen::Vector2d> means;
  std::vector<Eigen::Matrix2d> spreads;
  for (int j = 0; j < kNodes; ++j) {
    const double x0 = -4300.0 - 3000.0 * (j + 0.5) / kNodes;
    const Eigen::Vector2d prior = mean.tail<2>() + slope * (x0 - mean.x());
    Eigen::Matrix2d information = conditional.inverse();
    Eigen::Vector2d right = information * prior;
    double square = prior.dot(right);
    for (std::size_t i = 0; i < shifts.size(); ++i) {
      const double x = x0 + shifts[i].x();
      const Eigen::Vector2d seen = measured[i] - shifts[i].tail<2>() / x;
      information += Eigen::Matrix2d::Identity() / (x * x * sigma0 * sigma0);
      right += seen / (x * sigma0 * sigma0);
      square += seen.squaredNorm() / (sigma0 * sigma0);
    }
    const Eigen::Matrix2d spread = information.inverse();
    const Eigen::Vector2d posterior = spread * right;
    const double deviation = x0 - mean.x();
    logs.push_back(-0.5 * (square - right.dot(posterior) + std::log(information.determinant()) +
                           deviation * deviation / covariance(0, 0)));
    nodes.push_back(x0);
    means.push_back(posterior);
    spreads.push_back(spread);
  }
  const double largest = *std::max_element(logs.begin(), logs.end());
  double total = 0.0;
  Eigen::Vector3d expected = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (std::size_t j = 0; j < nodes.size(); ++j) {
    const double weight = std::exp(logs[j] - largest);
    const Eigen::Vector3d node(nodes[j], means[j].x(), means[j].y());
    total += weight;
    expected += weight * node;
    second += weight * (node * node.transpose());
    second.block<2, 2>(1, 1) += weight * spreads[j];
  }
  expected /= total;
  const Eigen::Matrix3d spread = second / total - expected * expected.transpose();
  EXPECT_LT((filter.position() - (expected + shift)).norm(), 1e-3);
  EXPECT_NEAR(filter.covariance()(0, 0), spread(0, 0), 1e-4 * spread(0, 0));
  EXPECT_NEAR(filter.covariance()(0, 1), spread(0, 1), 1e-4 * std::sqrt(spread(0, 0) * spread(1, 1)));
  EXPECT_NEAR(filter.covariance()(2, 2), spread(2, 2), 1e-4 * spread(2, 2));
}

TEST(Filter, RangeGridRefinesItselfWhenThePosteriorNarrows) {
  FlightSettings settings;
  settings.filter = FilterKind::kRangeGrid;
  PlanProblem prior = paper(10.0);
  const FlightLoop grid(prior, settings);
  const FlightLoop kalman(prior, FlightSettings{});
  const Eigen::Vector3d start(-9500, 60, -85);
  const FlightOutcome exact = grid.fly(start, SineNoise(true));
  const FlightOutcome linear = kalman.fly(start, SineNoise(true));
  EXPECT_NEAR(std::sqrt(exact.covariance(0, 0)), std::sqrt(linear.covariance(0, 0)),
              0.05 * std::sqrt(linear.covariance(0, 0)));
  EXPECT_NEAR(exact.error.x(), linear.error.x(), 0.2 * std::sqrt(linear.covariance(0, 0)));
}

TEST(Limits, SpeedAccuracyEnergy) {
  const PlanProblem problem = paper(10.0);
  const auto slow = trammel::observer::plan_with_speed_limit(problem, 10.0);
  EXPECT_NEAR(slow.plan.max_speed_mps(), 10.0, 1e-9);
  EXPECT_LT(slow.beta_per_s.x(), 10.0);
  EXPECT_EQ(slow.beta_per_s.y(), 0.0);
  const auto unlimited = trammel::observer::plan_with_speed_limit(problem, 30.0);
  EXPECT_EQ(unlimited.beta_per_s.x(), 10.0);
  EXPECT_THROW((void)trammel::observer::plan_with_speed_limit(problem, 1.39), trammel::Error);

  const auto fine = trammel::observer::plan_for_accuracy(problem, 20.440037109968575);
  EXPECT_NEAR(fine.beta_per_s.x(), 10.0, 1e-6);
  EXPECT_NEAR(std::sqrt(fine.plan.final_covariance_m2(0, 0)), 20.440037109968575, 1e-9);
  const auto coarse = trammel::observer::plan_for_accuracy(problem, 500.0);
  EXPECT_EQ(coarse.beta_per_s.norm(), 0.0);

  const auto thrifty = trammel::observer::plan_for_energy(problem, 3813.0550246008775);
  EXPECT_NEAR(thrifty.beta_per_s.x(), 10.0, 1e-6);
  EXPECT_THROW((void)trammel::observer::plan_for_energy(problem, 100.0), trammel::Error);

  PlanProblem general = problem;
  general.beta_per_s << 0.1, 1000, 10;
  const auto scaled = trammel::observer::plan_with_speed_limit(general, 3.0);
  EXPECT_NEAR(scaled.plan.max_speed_mps(), 3.0, 1e-8);
  EXPECT_NEAR(scaled.beta_per_s.y() / scaled.beta_per_s.x(), 1e4, 1e-6);

  // A symmetric start breaks away to either side as soon as that pays.
  PlanProblem symmetric = paper_problem({-10000, 0, 0}, kPaperCovariance, 80, {10, 0, 0});
  const auto breaks = trammel::observer::plan_for_accuracy(symmetric, 30.0);
  EXPECT_NEAR(std::sqrt(breaks.plan.final_covariance_m2(0, 0)), 30.0, 1e-6);
}

TEST(Flight, RejectsBadSettings) {
  const auto rejects = [](FlightSettings settings, const char* where) {
    try {
      const FlightLoop loop(paper(1.0), settings);
      ADD_FAILURE() << where;
    } catch (const trammel::Error& error) {
      EXPECT_EQ(error.detail().where, where);
    }
  };
  rejects({.replan_interval_s = 0.0}, "replan_interval_s");
  rejects({.replan_interval_s = std::nan("")}, "replan_interval_s");
  rejects({.min_final_distance_m = -1.0}, "min_final_distance_m");
  rejects({.gate_m = -1.0}, "gate_m");
  rejects({.max_lateral_speed_mps = 0.0}, "max_lateral_speed_mps");
  rejects({.measured = BearingKind::kAngles, .filter = FilterKind::kRangeGrid}, "filter");
  rejects({.replan_interval_s = 1e-9}, "measurement_interval_s");
}

TEST(Flight, EverySettingIsDescribed) {
  const FlightSettings settings;
  int fields = 0;
  visit_fields(settings, [&](const trammel::FieldDoc& doc, const auto&) {
    EXPECT_FALSE(doc.meaning.empty());
    ++fields;
  });
  EXPECT_EQ(fields, 6);
}

}  // namespace
