// SPDX-License-Identifier: Apache-2.0
// The published example with data from SplitMix64: sums, sections, polygons, estimates. The numbers are from
// an independent prototype; parts of it were repeated by a second program.
#include <gtest/gtest.h>

#include "example_data.hpp"
#include "trammel/region/lscr.hpp"
#include "trammel/region/planar.hpp"
#include "trammel/region/self_normalised.hpp"
#include "trammel/region/sps.hpp"

namespace {

using namespace trammel::region;
using trammel::test::example_2;
using trammel::test::example_model;
using trammel::test::ExampleData;
using trammel::test::small_example;

constexpr double kRelative = 1e-12;

void expect_close(double found, double expected, const char* what) {
  EXPECT_NEAR(found, expected, kRelative * std::max(1.0, std::abs(expected))) << what;
}

/// What the reference gives for one form of the prediction residuals.
struct PredictionReference {
  KnownTerms terms;
  SignCounts counts[2];
  Interval theta1;
  Interval theta2_at_1;
  double area = 0.0;
  double plant_area = 0.0;
  Interval a_range;
  double sum_target[2];  ///< sum over the strings of P and P2
  std::vector<std::pair<double, double>> lower;
  std::vector<std::pair<double, double>> upper;
};

struct PlantReference {
  ResidualFilter::Kind filter;
  double estimate[2];
  SignCounts counts[2];
  Interval b_section[2];
  int greater;
  Interval sps_b_section;
  Interval sps_a_section;
  double gamma;
  double ellipsoid_area;
};

class Example {
 public:
  explicit Example(ExampleData data) : data_(std::move(data)) {
    ties_.assign(static_cast<std::size_t>(data_.strings.count()), 0);
    sign_ties_.assign(static_cast<std::size_t>(data_.signs.count()), 0);
  }

  void check(const PredictionReference& reference) const {
    ProbedResiduals residuals;
    prediction_residuals(example_model(), data_.record, reference.terms, residuals);
    LscrRegion region;
    region.assign(residuals, data_.strings, ties_, data_.excluded, ResidualForm::kPrediction);
    const Eigen::Vector2d truth(1.0, 3.6);
    for (int channel = 0; channel < 2; ++channel) {
      EXPECT_EQ(region.counts(channel, truth).positive, reference.counts[channel].positive);
      EXPECT_EQ(region.counts(channel, truth).negative, reference.counts[channel].negative);
      double sum = 0.0;
      for (int j = 0; j < data_.strings.count(); ++j) {
        sum += region.constant(j, channel);
      }
      expect_close(sum, reference.sum_target[channel], "sum of the constants");
    }
    CountSweep sweep;
    IntervalList section;
    region.channel_section(0, Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(1.0, 0.0), sweep, section);
    ASSERT_EQ(section.size(), 1U);
    expect_close(section[0].lower, reference.theta1.lower, "theta_1, lower");
    expect_close(section[0].upper, reference.theta1.upper, "theta_1, upper");
    region.channel_section(1, Eigen::Vector2d(1.0, 0.0), Eigen::Vector2d(0.0, 1.0), sweep, section);
    ASSERT_EQ(section.size(), 1U);
    expect_close(section[0].lower, reference.theta2_at_1.lower, "theta_2 at theta_1 = 1, lower");
    expect_close(section[0].upper, reference.theta2_at_1.upper, "theta_2 at theta_1 = 1, upper");
    check_polygon(region, reference);
  }

  void check(const PlantReference& reference) const {
    ProbedResiduals residuals;
    plant_residuals(example_model(), data_.record, 0, {.kind = reference.filter, .period = 0, .taps = {}},
                    residuals);
    LscrRegion region;
    region.assign(residuals, data_.strings, ties_, data_.excluded, ResidualForm::kPlant);
    const InstrumentalEstimate estimate = region.estimate();
    expect_close(estimate.parameters(0), reference.estimate[0], "a");
    expect_close(estimate.parameters(1), reference.estimate[1], "b");
    const Eigen::Vector2d truth(-2.0, 1.0);
    CountSweep sweep;
    IntervalList section;
    for (int channel = 0; channel < 2; ++channel) {
      EXPECT_EQ(region.counts(channel, truth).positive, reference.counts[channel].positive);
      EXPECT_EQ(region.counts(channel, truth).negative, reference.counts[channel].negative);
      region.channel_section(channel, Eigen::Vector2d(-2.0, 0.0), Eigen::Vector2d(0.0, 1.0), sweep, section);
      ASSERT_EQ(section.size(), 1U);
      expect_close(section[0].lower, reference.b_section[channel].lower, "b at a = -2, lower");
      expect_close(section[0].upper, reference.b_section[channel].upper, "b at a = -2, upper");
    }
    // Channel 1 alone says nothing about a.
    region.channel_section(0, Eigen::Vector2d(0.0, 1.0), Eigen::Vector2d(1.0, 0.0), sweep, section);
    ASSERT_EQ(section.size(), 1U);
    EXPECT_TRUE(std::isinf(section[0].lower) && std::isinf(section[0].upper));

    SpsRegion sps;
    sps.assign(residuals, data_.signs, sign_ties_, data_.signs_excluded);
    EXPECT_EQ(sps.count_greater(truth), reference.greater);
    sps.section(Eigen::Vector2d(estimate.parameters(0), 0.0), Eigen::Vector2d(0.0, 1.0), section);
    ASSERT_EQ(section.size(), 1U);
    expect_close(section[0].lower, reference.sps_b_section.lower, "b at a^, lower");
    expect_close(section[0].upper, reference.sps_b_section.upper, "b at a^, upper");
    sps.section(Eigen::Vector2d(0.0, estimate.parameters(1)), Eigen::Vector2d(1.0, 0.0), section);
    ASSERT_EQ(section.size(), 1U);
    expect_close(section[0].lower, reference.sps_a_section.lower, "a at b^, lower");
    expect_close(section[0].upper, reference.sps_a_section.upper, "a at b^, upper");
    const EllipsoidRegion ellipsoid = outer_ellipsoid(sps);
    if (std::isinf(reference.gamma)) {
      EXPECT_TRUE(std::isinf(ellipsoid.gamma()));
    } else {
      EXPECT_NEAR(ellipsoid.gamma(), reference.gamma, 1e-8 * reference.gamma);
      EXPECT_NEAR(ellipsoid.volume(), reference.ellipsoid_area, 1e-8 * reference.ellipsoid_area);
    }
  }

  void check_self_normalised(double rho2, Interval expected) const {
    ProbedResiduals residuals;
    prediction_residuals(example_model(), data_.record, KnownTerms::kOnce, residuals);
    SelfNormalisedRegion region;
    region.assign(residuals, 0.025, rho2);
    IntervalList section;
    region.channel_section(0, Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(1.0, 0.0), section);
    const auto near = std::find_if(section.begin(), section.end(), [](const Interval& interval) {
      return interval.lower < 1.0 && interval.upper > 1.0;
    });
    ASSERT_NE(near, section.end());
    if (std::isinf(expected.lower)) {
      EXPECT_TRUE(std::isinf(near->lower));
    } else {
      expect_close(near->lower, expected.lower, "lower");
    }
    expect_close(near->upper, expected.upper, "upper");
  }

 private:
  static void check_polygon(const LscrRegion& region, const PredictionReference& reference) {
    PlanarWork work;
    PlanarRegion polygon;
    ASSERT_TRUE(exact_polygon(region, work, polygon));
    EXPECT_TRUE(polygon.exact);
    EXPECT_TRUE(polygon.bounded);
    expect_close(polygon.area, reference.area, "area");
    ASSERT_EQ(polygon.vertices.size(), reference.lower.size() + reference.upper.size());
    for (std::size_t k = 0; k < polygon.vertices.size(); ++k) {
      const auto& expected = k < reference.lower.size()
                                 ? reference.lower[k]
                                 : reference.upper[reference.upper.size() - 1 - (k - reference.lower.size())];
      expect_close(polygon.vertices[k](0), expected.first, "vertex, theta_1");
      expect_close(polygon.vertices[k](1), expected.second, "vertex, theta_2");
    }
    const PlantImage image = plant_image(polygon, example_model());
    expect_close(image.area, reference.plant_area, "area in a and b");
    expect_close(image.outline.lower(0), reference.a_range.lower, "a, lower");
    expect_close(image.outline.upper(0), reference.a_range.upper, "a, upper");
  }

  ExampleData data_;
  std::vector<char> ties_;
  std::vector<char> sign_ties_;
};

TEST(RegionReference, DataOfExample2) {
  const ExampleData data = example_2();
  expect_close(data.record.y(1), 1.3508018634901295, "y_0");
  expect_close(data.record.y(6), 0.015806955982145432, "y_5");
  expect_close(data.record.y.tail(960).sum(), 928.0787393263291, "sum of y");
  expect_close(data.record.y.tail(960).squaredNorm(), 2770.252069098593, "sum of squares of y");
  expect_close(data.record.probe.sum(), -10.0, "sum of the probes");
}

TEST(RegionReference, SmallExampleAsPrinted) {
  Example(small_example())
      .check(PredictionReference{
          .terms = KnownTerms::kPrinted,
          .counts = {{26, 5}, {11, 20}},
          .theta1 = {0.5127943412031154, 2.1362798577295266},
          .theta2_at_1 = {2.8041740950657688, 4.440481241287352},
          .area = 3.185763826179042,
          .plant_area = 2.5323426003967757,
          .a_range = {-3.1901736081744514, -0.9535698927224944},
          .sum_target = {3381.4745562130183, 3443.1454142011844},
          .lower = {{0.5127943412031154, 2.088985244929757}, {2.1362798577295266, 4.472165158406611}},
          .upper = {{0.5127943412031154, 3.2359029737273834}, {2.1362798577295266, 7.249845208584262}}});
}

TEST(RegionReference, SmallExampleCorrected) {
  Example(small_example())
      .check(PredictionReference{.terms = KnownTerms::kOnce,
                                 .counts = {{26, 5}, {12, 19}},
                                 .theta1 = {0.5127943412031154, 2.1362798577295266},
                                 .theta2_at_1 = {3.2467032456058784, 4.073816594945149},
                                 .area = 1.8729690006881545,
                                 .plant_area = 1.38617269439754,
                                 .a_range = {-2.514957289827343, -1.5545459154107837},
                                 .sum_target = {3381.4745562130183, 3852.71701183432},
                                 .lower = {{0.5127943412031154, 2.4839392682692236},
                                           {0.8165947513931573, 2.9817540415387493},
                                           {1.062066339495673, 3.3363649503479802},
                                           {1.1457189836974375, 3.466860841044906},
                                           {2.1362798577295266, 4.920945127007766}},
                                 .upper = {{0.5127943412031154, 2.889655866590985},
                                           {0.6188792457199306, 3.1315250397618204},
                                           {2.1362798577295266, 6.883180562242059}}});
}

TEST(RegionReference, SmallExamplePlantResiduals) {
  Example(small_example())
      .check(PlantReference{
          .filter = ResidualFilter::Kind::kNone,
          .estimate = {-2.068502319354167, 1.0168825323272412},
          .counts = {{29, 2}, {30, 1}},
          .b_section = {{0.994704352458246, 1.0606685103440943}, {0.9586581605392078, 0.9917141631427344}},
          .greater = 6,
          .sps_b_section = {0.9831583564941585, 1.054328082450733},
          .sps_a_section = {-2.166561555929056, -1.9818590354521788},
          .gamma = 2021.2246620553901,
          .ellipsoid_area = 0.24901280274066215});
}

TEST(RegionReference, SmallExampleWithoutMean) {
  Example(small_example())
      .check(PlantReference{
          .filter = ResidualFilter::Kind::kMean,
          .estimate = {-2.010617017255172, 1.0010245534940683},
          .counts = {{19, 12}, {19, 12}},
          .b_section = {{0.9741566177340754, 1.0215252955302558}, {0.9860583011930609, 1.006915978365401}},
          .greater = 18,
          .sps_b_section = {0.9900596554241695, 1.0123760252512832},
          .sps_a_section = {-2.052490674243829, -1.9806773182579438},
          .gamma = std::numeric_limits<double>::infinity(),
          .ellipsoid_area = 0.0});
}

TEST(RegionReference, Example2AsPrinted) {
  Example(example_2())
      .check(PredictionReference{.terms = KnownTerms::kPrinted,
                                 .counts = {{221, 258}, {143, 336}},
                                 .theta1 = {0.5320755326334967, 1.3966584332338696},
                                 .theta2_at_1 = {2.934967735285644, 4.05944519941238},
                                 .area = 0.9550437437770158,
                                 .plant_area = 1.0389429667045484,
                                 .a_range = {-2.720197658986673, -0.9838490966045692},
                                 .sum_target = {115089.79480771445, 176876.0502601305},
                                 .lower = {{0.5320755326334967, 2.123482032106861},
                                           {0.5567320335842101, 2.16621386729722},
                                           {0.5884557344478798, 2.219525160575099},
                                           {0.6053076581589553, 2.2503995993987056},
                                           {0.9876641799357099, 2.913056312335526},
                                           {1.3966584332338696, 3.6395297872629055}},
                                 .upper = {{0.5320755326334967, 3.047350618273725},
                                           {0.8913551947486392, 3.823530116337321},
                                           {1.0339630975034404, 4.13319384252949},
                                           {1.082988057037707, 4.237529333516361},
                                           {1.3966584332338696, 4.9151755819013605}}});
}

TEST(RegionReference, Example2Corrected) {
  Example(example_2())
      .check(PredictionReference{.terms = KnownTerms::kOnce,
                                 .counts = {{221, 258}, {124, 355}},
                                 .theta1 = {0.5320755326334967, 1.3966584332338696},
                                 .theta2_at_1 = {3.1162851363236603, 3.9315796524603845},
                                 .area = 0.6954508574532109,
                                 .plant_area = 0.74987737208222,
                                 .a_range = {-2.4772915550871244, -1.2646080872571677},
                                 .sum_target = {115089.79480771445, 180586.71247090225},
                                 .lower = {{0.5320755326334967, 2.272867021599985},
                                           {0.7591242246300569, 2.698826716127156},
                                           {1.3966584332338696, 3.8037282909585217}},
                                 .upper = {{0.5320755326334967, 2.9181062236614452},
                                           {0.538030876371598, 2.9313673290511484},
                                           {0.5702163340838998, 3.0010522707320257},
                                           {0.571117441340016, 3.002847498636811},
                                           {0.572686892416956, 3.006401292482691},
                                           {0.6593728013969384, 3.1940855120398686},
                                           {0.693393379815503, 3.275438253633232},
                                           {0.7475729562999244, 3.3850482351926203},
                                           {1.3056253428093332, 4.593291049583881},
                                           {1.3966584332338696, 4.7870287349532585}}});
}

TEST(RegionReference, Example2PlantResiduals) {
  Example(example_2())
      .check(PlantReference{
          .filter = ResidualFilter::Kind::kNone,
          .estimate = {-1.9490509045134274, 0.9774824855983757},
          .counts = {{94, 385}, {214, 265}},
          .b_section = {{0.9231996866337936, 1.0343380961242692}, {0.9707695068768315, 1.0346520971232986}},
          .greater = 254,
          .sps_b_section = {0.9441546380746882, 1.0116977108439846},
          .sps_a_section = {-2.0179585412594148, -1.8570527986908232},
          .gamma = 3278.3455498924554,
          .ellipsoid_area = 0.044798355181964726});
}

TEST(RegionReference, Example2WithoutMean) {
  Example(example_2())
      .check(PlantReference{
          .filter = ResidualFilter::Kind::kMean,
          .estimate = {-1.9813216009926804, 0.9877831044864857},
          .counts = {{96, 383}, {313, 166}},
          .b_section = {{0.9554101137734893, 1.018800454992604}, {0.9796551377479096, 1.0136381168397357}},
          .greater = 244,
          .sps_b_section = {0.9723913279439192, 1.003476914162789},
          .sps_a_section = {-2.0166602295408778, -1.9447468398253005},
          .gamma = 396.6738800293285,
          .ellipsoid_area = 0.005130088754256673});
}

TEST(RegionReference, SelfNormalisedIntervals) {
  Example(example_2()).check_self_normalised(480.0, {0.30196041174740007, 1.5527694621297772});
  Example(small_example())
      .check_self_normalised(32.0, {-std::numeric_limits<double>::infinity(), 2.697111318889749});
}

/// The full region of example 2, by an independent scan accurate to a few digits.
TEST(RegionReference, Example2PlantPolygonAgreesWithScan) {
  const ExampleData data = example_2();
  const std::vector<char> ties(479, 0);
  const double areas[] = {0.021908680367797938, 0.004529196910919997};
  const ResidualFilter::Kind filters[] = {ResidualFilter::Kind::kNone, ResidualFilter::Kind::kMean};
  for (int k = 0; k < 2; ++k) {
    ProbedResiduals residuals;
    plant_residuals(example_model(), data.record, 0, {.kind = filters[k], .period = 0, .taps = {}},
                    residuals);
    LscrRegion region;
    region.assign(residuals, data.strings, ties, data.excluded, ResidualForm::kPlant);
    PlanarWork work;
    PlanarRegion polygon;
    ASSERT_TRUE(exact_polygon(region, work, polygon));
    EXPECT_NEAR(polygon.area, areas[k], 1e-5 * areas[k]);
  }
}

}  // namespace
