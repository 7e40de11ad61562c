// SPDX-License-Identifier: Apache-2.0
#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "trammel/core/random.hpp"
#include "trammel/sensor/any_sensor.hpp"
#include "trammel/sensor/sensor_laws.hpp"

namespace {

using trammel::Error;
using trammel::RandomStream;
using trammel::SensorKind;
namespace sensor = trammel::sensor;

constexpr std::uint64_t kSeed = 20240611;
constexpr int kDraws = 200;

template <class Scalar>
sensor::Vector3<Scalar> draw(RandomStream& stream, double scale) {
  return {static_cast<Scalar>(scale * stream.normal()), static_cast<Scalar>(scale * stream.normal()),
          static_cast<Scalar>(scale * stream.normal())};
}

template <class S>
class SensorLaws : public testing::Test {};

using Kinds =
    testing::Types<sensor::DirectionCosinesRange, sensor::AzimuthElevationRange, sensor::Range,
                   sensor::DirectionCosines, sensor::AzimuthElevation, sensor::RangeRate, sensor::Position>;

struct KindName {
  template <class S>
  static std::string GetName(int /*index*/) {
    return std::string(trammel::describe(S::kKind).name);
  }
};
TYPED_TEST_SUITE(SensorLaws, Kinds, KindName);

template <class S, class Scalar>
void expect_dual_agrees(double tolerance) {
  RandomStream stream(kSeed, static_cast<std::uint64_t>(S::kKind));
  for (int i = 0; i < kDraws; ++i) {
    const sensor::Vector3<Scalar> position = draw<Scalar>(stream, 1e4);
    const sensor::Vector3<Scalar> velocity = draw<Scalar>(stream, 200.0);
    const auto J = S::jacobian(position, velocity);
    const auto dual = sensor::dual_jacobian<S, ceres::Jet<Scalar, 6>>(position, velocity);
    EXPECT_LT(sensor::jacobian_deviation(J, dual), tolerance) << "seed " << kSeed << " draw " << i;
  }
}

TYPED_TEST(SensorLaws, JacobianAgreesWithDualNumbersInDouble) {
  expect_dual_agrees<TypeParam, double>(1e-11);
}

// Near the zenith the elevation's row loses about |x|/h digits; the draws come within 1e-2.
TYPED_TEST(SensorLaws, JacobianAgreesWithDualNumbersInFloat) { expect_dual_agrees<TypeParam, float>(1e-3); }

TYPED_TEST(SensorLaws, JacobianAgreesWithDifferences) {
  RandomStream stream(kSeed + 1, static_cast<std::uint64_t>(TypeParam::kKind));
  for (int i = 0; i < kDraws; ++i) {
    const sensor::Vector3<double> position = draw<double>(stream, 1e4);
    const sensor::Vector3<double> velocity = draw<double>(stream, 200.0);
    const double step_m = 1e-5 * position.head<2>().norm();
    const auto J = TypeParam::jacobian(position, velocity);
    const auto other = sensor::difference_jacobian<TypeParam, double>(position, velocity, step_m, 1e-2);
    EXPECT_LT(sensor::jacobian_deviation(J, other), 2e-5) << "seed " << kSeed + 1 << " draw " << i;
  }
}

// The Jacobian evaluated in dual numbers: its derivative along a direction agrees with differences of it.
TYPED_TEST(SensorLaws, JacobianWorksOnDualNumbers) {
  using Dual = ceres::Jet<double, 1>;
  RandomStream stream(kSeed + 2, static_cast<std::uint64_t>(TypeParam::kKind));
  for (int i = 0; i < kDraws; ++i) {
    const sensor::Vector3<double> position = draw<double>(stream, 1e4);
    const sensor::Vector3<double> velocity = draw<double>(stream, 200.0);
    const sensor::Vector3<double> along = draw<double>(stream, 1.0);
    const double step = 1e-5 * position.head<2>().norm();
    sensor::Vector3<Dual> p;
    for (int k = 0; k < 3; ++k) {
      p(k) = Dual(position(k), Eigen::Matrix<double, 1, 1>(along(k)));
    }
    const auto J = TypeParam::jacobian(p, sensor::Vector3<Dual>(velocity.cast<Dual>()));
    const auto after = TypeParam::jacobian(sensor::Vector3<double>(position + step * along), velocity);
    const auto before = TypeParam::jacobian(sensor::Vector3<double>(position - step * along), velocity);
    const Eigen::MatrixXd slope = (after.position - before.position) / (2 * step);
    const double size = std::max(slope.cwiseAbs().maxCoeff(), 1e-300);
    for (int r = 0; r < TypeParam::kComponents; ++r) {
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(J.position(r, c).v(0) / size, slope(r, c) / size, 1e-5) << "seed " << kSeed + 2;
      }
    }
  }
}

TYPED_TEST(SensorLaws, RunTimeKindIsTheSameSensor) {
  const sensor::Vector3<double> position(300.0, -4000.0, 1500.0);
  const sensor::Vector3<double> velocity(70.0, 20.0, -5.0);
  const sensor::Linearised any = sensor::linearise(TypeParam::kKind, position, velocity);
  constexpr int kRows = TypeParam::kComponents;
  EXPECT_EQ(any.value.template head<kRows>(), TypeParam::value(position, velocity));
  EXPECT_EQ(any.value.template tail<3 - kRows>().norm(), 0.0);
  EXPECT_EQ(any.value, sensor::measure(TypeParam::kKind, position, velocity));
  EXPECT_EQ(any.J_value_position.template topRows<kRows>(), TypeParam::jacobian(position, velocity).position);
  EXPECT_EQ(any.J_value_velocity.template topRows<kRows>(), TypeParam::jacobian(position, velocity).velocity);
  EXPECT_EQ(trammel::components(TypeParam::kKind), TypeParam::kComponents);
  EXPECT_EQ(trammel::find_sensor_kind(trammel::describe(TypeParam::kKind).name), TypeParam::kKind);
}

TYPED_TEST(SensorLaws, RefusesTheStationItself) {
  const sensor::Vector3<double> zero = sensor::Vector3<double>::Zero();
  const sensor::Vector3<double> velocity(70.0, 20.0, -5.0);
  if (TypeParam::kKind == SensorKind::kPosition) {
    EXPECT_EQ(TypeParam::value(zero, velocity).norm(), 0.0);
    return;
  }
  EXPECT_THROW((void)TypeParam::value(zero, velocity), Error);
  EXPECT_THROW((void)TypeParam::jacobian(zero, velocity), Error);
}

TEST(Sensor, AzimuthRefusesTheZenith) {
  const sensor::Vector3<double> overhead(0.0, 0.0, 900.0);
  const sensor::Vector3<double> velocity(1.0, 0.0, 0.0);
  EXPECT_THROW((void)sensor::linearise(SensorKind::kAzimuthElevationRange, overhead, velocity), Error);
  EXPECT_THROW((void)sensor::linearise(SensorKind::kAzimuthElevation, overhead, velocity), Error);
  EXPECT_NO_THROW((void)sensor::linearise(SensorKind::kDirectionCosinesRange, overhead, velocity));
}

TEST(Sensor, AnglesFollowTheConvention) {
  const sensor::Vector3<double> still = sensor::Vector3<double>::Zero();
  const double quarter = std::numbers::pi / 2;
  const auto azimuth = [&](double x, double y) {
    return sensor::measure(SensorKind::kAzimuthElevation, {x, y, 0.0}, still)(0);
  };
  EXPECT_DOUBLE_EQ(azimuth(0.0, 5.0), 0.0);        // north
  EXPECT_DOUBLE_EQ(azimuth(5.0, 0.0), quarter);    // east
  EXPECT_DOUBLE_EQ(azimuth(-5.0, 0.0), -quarter);  // west
  EXPECT_DOUBLE_EQ(sensor::measure(SensorKind::kAzimuthElevation, {3.0, 4.0, 5.0}, still)(1), quarter / 2);
}

TEST(Sensor, AnglesAreComparedModuloATurn) {
  const sensor::Padded d =
      sensor::difference(SensorKind::kAzimuthElevationRange, {3.1, 0.2, 7000.0}, {-3.1, 0.1, 10.0});
  EXPECT_NEAR(d(0), 6.2 - 2 * std::numbers::pi, 1e-15);
  EXPECT_NEAR(d(1), 0.1, 1e-15);
  EXPECT_EQ(d(2), 6990.0);
  EXPECT_EQ(sensor::wrap_angle(-std::numbers::pi), std::numbers::pi);
}

// A type with the wrong number of rows is not a sensor.
struct WrongShape : sensor::Range {
  static constexpr int kComponents = 2;
};
static_assert(!sensor::Sensor<WrongShape>);
static_assert(!sensor::Sensor<int>);

}  // namespace
