// SPDX-License-Identifier: Apache-2.0
#include "trammel/geodesy/wgs84.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "trammel/core/random.hpp"

namespace {

using trammel::Geodetic;
using trammel::kRadiansPerDegree;
using trammel::LocalFrame;
using trammel::Wgs84;

constexpr double kDeg = kRadiansPerDegree;

// Numbers from the closed formulas with 40 digits.
TEST(Wgs84, KnownPositions) {
  struct Case {
    double latitude_deg, longitude_deg, height_m, x, y, z;
  };
  const Case cases[] = {
      {51.9405, -0.6828, 812.0, 3940396.037437853071, -46960.34874777912741, 4999364.07349315865},
      {47.6393, 15.8629, 1488.0, 4142443.955511313604, 1177106.780124949105, 4691046.665638164595},
      {-33.8568, 151.2153, 0.0, -4646968.637362167429, 2553076.920179037835, -3533267.127490254138},
      {78.2, -120.5, -2000.0, -663910.0485371513593, -1127095.603951515468, 6219583.137011696482},
      {-0.001, 179.999, 35786000.0, -42164136.98716257261, 735.9030167661457634, -735.1578019030742566},
      {89.9999, 12.0, 400000.0, 11.60819566072798865, 2.467398156837211952, 6756752.314234823124},
  };
  for (const Case& c : cases) {
    const Geodetic place = trammel::geodetic_from_degrees(c.latitude_deg, c.longitude_deg, c.height_m);
    const Eigen::Vector3d p = trammel::ecef_from_geodetic(place);
    EXPECT_LT((p - Eigen::Vector3d(c.x, c.y, c.z)).norm(), 1e-15 * p.norm());
    const Geodetic back = trammel::geodetic_from_ecef(Eigen::Vector3d(c.x, c.y, c.z));
    EXPECT_NEAR(back.latitude_rad, place.latitude_rad, 1e-15);
    EXPECT_NEAR(back.longitude_rad, place.longitude_rad, 1e-15);
    EXPECT_NEAR(back.height_m, place.height_m, 3e-9);
  }
}

TEST(Wgs84, PolesEquatorAxisAndCentre) {
  const double a = Wgs84::kSemiMajorAxis_m;
  const double b = Wgs84::kSemiMinorAxis_m;
  for (const double sign : {1.0, -1.0}) {
    const Geodetic pole = trammel::geodetic_from_ecef<double>({0.0, 0.0, sign * (b + 100.0)});
    EXPECT_EQ(pole.latitude_rad, sign * M_PI / 2);
    EXPECT_EQ(pole.longitude_rad, 0.0);
    EXPECT_NEAR(pole.height_m, 100.0, 3e-9);
    const Geodetic deep = trammel::geodetic_from_ecef<double>({0.0, 0.0, sign * 1e-3});
    EXPECT_EQ(deep.latitude_rad, sign * M_PI / 2);
    EXPECT_NEAR(deep.height_m, 1e-3 - b, 3e-9);
  }
  const Geodetic equator = trammel::geodetic_from_ecef<double>({0.0, a + 7.0, 0.0});
  EXPECT_EQ(equator.latitude_rad, 0.0);
  EXPECT_NEAR(equator.longitude_rad, M_PI / 2, 1e-15);
  EXPECT_NEAR(equator.height_m, 7.0, 3e-9);
  const Geodetic centre = trammel::geodetic_from_ecef<double>({0.0, 0.0, 0.0});
  EXPECT_EQ(centre.latitude_rad, M_PI / 2);
  EXPECT_NEAR(centre.height_m, -b, 3e-9);
  // On the equatorial disc inside the evolute the nearest feet lie north and south: the northern is taken.
  const Eigen::Vector3d inside(20000.0, -15000.0, 0.0);
  const Geodetic foot = trammel::geodetic_from_ecef(inside);
  EXPECT_GT(foot.latitude_rad, 0.5);
  EXPECT_LT((trammel::ecef_from_geodetic(foot) - inside).norm(), 3e-9);
}

TEST(Wgs84, LatitudesNextToThePolesKeepTheirDigits) {
  for (const double from_pole : {1e-3, 1e-6, 1e-9, 1e-12}) {
    Geodetic place;
    place.latitude_rad = M_PI / 2 - from_pole;
    place.longitude_rad = -2.5;
    place.height_m = 3000.0;
    const Geodetic back = trammel::geodetic_from_ecef(trammel::ecef_from_geodetic(place));
    EXPECT_NEAR(back.latitude_rad, place.latitude_rad, 2.3e-16);
    EXPECT_NEAR(back.longitude_rad, place.longitude_rad, 1e-14);
  }
}

TEST(Wgs84, NearestFootEverywhere) {
  constexpr std::uint64_t kSeed = 99;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  trammel::RandomStream random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const double scale = std::pow(10.0, -6.0 + 18.0 * random.uniform());
    const Eigen::Vector3d p(scale * random.normal(), scale * random.normal(),
                            scale * random.normal() * std::pow(10.0, -12.0 * random.uniform()));
    const Geodetic place = trammel::geodetic_from_ecef(p);
    const double tolerance = 1e-8 * (1.0 + p.norm() / Wgs84::kSemiMajorAxis_m);
    ASSERT_LT((trammel::ecef_from_geodetic(place) - p).norm(), tolerance) << p.transpose();
    ASSERT_GE(place.latitude_rad * p[2], 0.0);  // the nearest foot lies on the same side of the equator
  }
}

TEST(Wgs84, LocalFrameIsARotationAboutItsOrigin) {
  const LocalFrame frame(trammel::geodetic_from_degrees(50.0, 30.5, 200.0));
  const Eigen::Matrix3d& r = frame.r_local_ecef();
  EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-15);
  const Eigen::Vector3d up = r.row(0).cross(r.row(1));  // east, north, up are right-handed
  EXPECT_LT((up - r.row(2).transpose()).norm(), 1e-15);
  EXPECT_LT(frame.local_from_geodetic(frame.origin()).norm(), 1e-9);
  Geodetic above = frame.origin();
  above.height_m += 1000.0;
  EXPECT_LT((frame.local_from_geodetic(above) - Eigen::Vector3d(0, 0, 1000.0)).norm(), 2e-9);
  Geodetic east = frame.origin();
  east.longitude_rad += 1e-6;
  const Eigen::Vector3d step = frame.local_from_geodetic(east);
  EXPECT_GT(step[0], 4.0);
  EXPECT_LT(std::abs(step[1]), 1e-4);
  Geodetic north = frame.origin();
  north.latitude_rad += 1e-6;
  EXPECT_GT(frame.local_from_geodetic(north)[1], 6.0);
}

TEST(Wgs84, VelocityIsTheDerivativeOfThePosition) {
  const LocalFrame frame(trammel::geodetic_from_degrees(-33.0, 151.0, 40.0));
  const Eigen::Vector3d p(3000.0, -2000.0, 900.0);
  const Eigen::Vector3d v(-70.0, 120.0, 5.0);
  const Eigen::Vector3d moved = frame.ecef_from_local<double>(p + v) - frame.ecef_from_local(p);
  EXPECT_LT((frame.ecef_velocity(v) - moved).norm(), 1e-8);
  EXPECT_LT((frame.local_velocity(frame.ecef_velocity(v)) - v).norm(), 1e-13);
}

TEST(Wgs84, SinglePrecisionWorksToItsAccuracy) {
  trammel::GeodeticPoint<float> place;
  place.latitude_rad = 0.9F;
  place.longitude_rad = -1.7F;
  place.height_m = 5000.0F;
  const auto back = trammel::geodetic_from_ecef(trammel::ecef_from_geodetic(place));
  EXPECT_NEAR(back.latitude_rad, place.latitude_rad, 1e-6);
  EXPECT_NEAR(back.longitude_rad, place.longitude_rad, 1e-6);
  EXPECT_NEAR(back.height_m, place.height_m, 5.0);
  const auto disc = trammel::geodetic_from_ecef<float>({1000.0F, 0.0F, 0.0F});
  EXPECT_TRUE(std::isfinite(disc.height_m));
}

TEST(Wgs84, WrongDegreesAreErrors) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)trammel::geodetic_from_degrees(90.1, 0, 0), trammel::Error);
  EXPECT_THROW((void)trammel::geodetic_from_degrees(nan, 0, 0), trammel::Error);
  EXPECT_THROW((void)trammel::geodetic_from_degrees(0, 361, 0), trammel::Error);
  EXPECT_THROW((void)trammel::geodetic_from_degrees(0, 0, 1.0 / 0.0), trammel::Error);
  EXPECT_DOUBLE_EQ(trammel::geodetic_from_degrees(45, -90, 1).latitude_rad, 45 * kDeg);
}

}  // namespace
