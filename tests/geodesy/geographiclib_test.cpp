// SPDX-License-Identifier: Apache-2.0
// The geodesy against GeographicLib at random places, from the centre of the Earth to beyond the Moon.
#include <cmath>

#include <gtest/gtest.h>
#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/LocalCartesian.hpp>

#include "trammel/core/random.hpp"
#include "trammel/geodesy/wgs84.hpp"

namespace {

using trammel::Geodetic;
using trammel::kRadiansPerDegree;

constexpr int kPoints = 200000;
constexpr double kAngle_rad = 2e-15;
constexpr double kLength_m = 2e-8;  // in the Earth's size; beyond, relative to the distance

double uniform(trammel::RandomStream& random, double low, double high) {
  return low + (high - low) * random.uniform();
}

/// Latitudes uniform, or within metres to nanometres of the poles and the equator; heights from below the
/// surface to deep space.
Geodetic random_place(trammel::RandomStream& random) {
  double latitude = uniform(random, -90.0, 90.0);
  const double choice = random.uniform();
  const double tiny = std::pow(10.0, uniform(random, -14.0, -3.0));
  if (choice < 0.1) {
    latitude = 90.0 - tiny;
  } else if (choice < 0.2) {
    latitude = -90.0 + tiny;
  } else if (choice < 0.3) {
    latitude = random.uniform() < 0.5 ? tiny : -tiny;
  }
  double height = uniform(random, -12000.0, 60000.0);
  if (random.uniform() < 0.3) {
    height = std::pow(10.0, uniform(random, 3.0, 11.0));
  } else if (random.uniform() < 0.2) {
    height = uniform(random, -6.2e6, 0.0);
  }
  return trammel::geodetic_from_degrees(latitude, uniform(random, -180.0, 180.0), height);
}

TEST(GeographicLib, EcefAndBackAgree) {
  constexpr std::uint64_t kSeed = 20240501;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  trammel::RandomStream random(kSeed);
  const auto& earth = GeographicLib::Geocentric::WGS84();
  double worst_position = 0.0;
  double worst_angle = 0.0;
  double worst_height = 0.0;
  for (int i = 0; i < kPoints; ++i) {
    const Geodetic place = random_place(random);
    const Eigen::Vector3d ours = trammel::ecef_from_geodetic(place);
    Eigen::Vector3d theirs;
    earth.Forward(place.latitude_rad / kRadiansPerDegree, place.longitude_rad / kRadiansPerDegree,
                  place.height_m, theirs[0], theirs[1], theirs[2]);
    const double size = std::max(1.0, theirs.norm() / trammel::Wgs84::kSemiMajorAxis_m);
    worst_position = std::max(worst_position, (ours - theirs).norm() / size);

    const Geodetic back = trammel::geodetic_from_ecef(theirs);
    double latitude = 0.0;
    double longitude = 0.0;
    double height = 0.0;
    earth.Reverse(theirs[0], theirs[1], theirs[2], latitude, longitude, height);
    worst_angle = std::max(worst_angle, std::abs(back.latitude_rad - latitude * kRadiansPerDegree));
    const double turn = std::remainder(back.longitude_rad - longitude * kRadiansPerDegree, 2 * M_PI);
    worst_angle = std::max(worst_angle, std::abs(turn));
    worst_height = std::max(worst_height, std::abs(back.height_m - height) / size);
  }
  EXPECT_LT(worst_position, kLength_m);
  EXPECT_LT(worst_angle, kAngle_rad);
  EXPECT_LT(worst_height, kLength_m);
  RecordProperty("worst_position_m", std::to_string(worst_position * 1e9) + "e-9");
  RecordProperty("worst_angle_rad", std::to_string(worst_angle * 1e15) + "e-15");
  RecordProperty("worst_height_m", std::to_string(worst_height * 1e9) + "e-9");
}

// Near the centre a position may have several feet on the ellipsoid: both take the nearest one.
TEST(GeographicLib, DeepInsideTheEarthAgrees) {
  constexpr std::uint64_t kSeed = 77;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  trammel::RandomStream random(kSeed);
  const auto& earth = GeographicLib::Geocentric::WGS84();
  for (int i = 0; i < kPoints; ++i) {
    const double scale = std::pow(10.0, uniform(random, -3.0, 6.5));
    const Eigen::Vector3d p(scale * random.normal(), scale * random.normal(), scale * random.normal());
    double latitude = 0.0;
    double longitude = 0.0;
    double height = 0.0;
    earth.Reverse(p[0], p[1], p[2], latitude, longitude, height);
    const Geodetic ours = trammel::geodetic_from_ecef(p);
    ASSERT_NEAR(ours.height_m, height, 1e-8) << p.transpose();
    // The foot's direction is ill-conditioned near the evolute (a curve 43 km around the centre): compare
    // the feet by where the coordinates lead back to.
    ASSERT_LT((trammel::ecef_from_geodetic(ours) - p).norm(), 2e-8) << p.transpose();
    ASSERT_NEAR(std::remainder(ours.longitude_rad - longitude * kRadiansPerDegree, 2 * M_PI), 0.0, 1e-14);
  }
}

TEST(GeographicLib, LocalFrameAgrees) {
  constexpr std::uint64_t kSeed = 4242;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  trammel::RandomStream random(kSeed);
  for (int i = 0; i < kPoints / 10; ++i) {
    const Geodetic origin = random_place(random);
    const Geodetic place = random_place(random);
    const trammel::LocalFrame frame(origin);
    const GeographicLib::LocalCartesian theirs(origin.latitude_rad / kRadiansPerDegree,
                                               origin.longitude_rad / kRadiansPerDegree, origin.height_m);
    Eigen::Vector3d p;
    std::vector<double> matrix(9);
    theirs.Forward(place.latitude_rad / kRadiansPerDegree, place.longitude_rad / kRadiansPerDegree,
                   place.height_m, p[0], p[1], p[2], matrix);
    const double size = 1.0 + (std::abs(place.height_m) + std::abs(origin.height_m)) / 6.4e6;
    ASSERT_LT((frame.local_from_geodetic(place) - p).norm(), 1e-8 * size);
    const Geodetic back = frame.geodetic_from_local(p);
    ASSERT_LT((trammel::ecef_from_geodetic(back) - trammel::ecef_from_geodetic(place)).norm(), 2e-8 * size);
    // GeographicLib's matrix turns the place's own east, north, up axes into the frame's.
    const Eigen::Matrix3d axes = Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(matrix.data());
    const Eigen::Vector3d v(random.normal(), random.normal(), random.normal());
    const Eigen::Vector3d ours = frame.local_velocity(trammel::LocalFrame(place).ecef_velocity(v));
    ASSERT_LT((ours - axes * v).norm(), 1e-14 * (1.0 + v.norm()));
  }
}

}  // namespace
