// SPDX-License-Identifier: Apache-2.0
// Remainder bounds: drawn deviations never exceed them and come close.
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "trammel/core/random.hpp"
#include "trammel/localise/remainder.hpp"

namespace {

using namespace trammel;

constexpr std::uint64_t kSeed = 55001;

Eigen::Vector3d direction(RandomStream& stream) {
  return Eigen::Vector3d(stream.normal(), stream.normal(), stream.normal()).normalized();
}

/// A reference and a deviation of it.
struct Draw {
  Eigen::Vector3d x, v, dx, dv;
};

Draw draw(RandomStream& stream) {
  Draw d;
  const double r = std::pow(10.0, 2.0 + 3.0 * stream.uniform());
  d.x = r * direction(stream);
  if (stream.uniform() < 0.3) {
    d.x.z() *= 0.02;  // low above the horizon
  }
  d.v = 200.0 * stream.uniform() * direction(stream);
  const double share = stream.uniform() < 0.5 ? 1e-3 : 0.49 * stream.uniform();
  const double length = stream.uniform() < 0.3 ? stream.uniform() : 1.0;
  d.dx = share * length * d.x.norm() * direction(stream);
  d.dv = 30.0 * stream.uniform() * direction(stream);
  if (stream.uniform() < 0.5) {
    d.dv.setZero();
  }
  return d;
}

sensor::Padded remainder(SensorKind kind, const Draw& d) {
  const sensor::Linearised model = sensor::linearise(kind, d.x, d.v);
  return sensor::difference(kind, sensor::measure(kind, d.x + d.dx, d.v + d.dv), model.value) -
         model.J_value_position * d.dx - model.J_value_velocity * d.dv;
}

localise::DeviationRadius radius(const Draw& d) {
  const Eigen::Vector3d e = d.x.normalized();
  return {.all_m = d.dx.norm(),
          .across_m = (d.dx - e * e.dot(d.dx)).norm(),
          .horizontal_m = d.dx.head<2>().norm(),
          .velocity_mps = d.dv.norm()};
}

struct Expected {
  SensorKind kind;
  std::array<double, 3> closest;  ///< largest |delta|/bound that the draws must reach
};

class Remainder : public testing::TestWithParam<Expected> {};

TEST_P(Remainder, IsNeverExceededAndNearlyReached) {
  const SensorKind kind = GetParam().kind;
  RandomStream stream(kSeed);
  constexpr int kDraws = 100000;
  Eigen::Vector3d closest = Eigen::Vector3d::Zero();
  int used = 0;
  for (int i = 0; i < kDraws; ++i) {
    const Draw d = draw(stream);
    const localise::RemainderBound bound = localise::bound_remainder(kind, d.x, d.v, radius(d));
    if (!bound.valid) {
      continue;
    }
    ++used;
    const sensor::Padded delta = remainder(kind, d);
    // Rounding of the difference of two nearly equal measurements.
    const double rounding = 1e-14 * (1.0 + sensor::measure(kind, d.x, d.v).norm() + d.x.norm());
    for (Eigen::Index c = 0; c < components(kind); ++c) {
      ASSERT_LE(std::abs(delta(c)), bound.half_width(c) + rounding)
          << "seed " << kSeed << ", draw " << i << ", component " << c;
      if (bound.half_width(c) > 1e6 * rounding) {
        closest(c) = std::max(closest(c), std::abs(delta(c)) / bound.half_width(c));
      }
    }
    for (Eigen::Index c = components(kind); c < 3; ++c) {
      EXPECT_EQ(bound.half_width(c), 0.0);
    }
    if (kind == SensorKind::kRange) {
      ASSERT_GE(delta(0), -rounding);
    }
  }
  EXPECT_GT(used, kDraws / 2);
  for (Eigen::Index c = 0; c < components(kind); ++c) {
    EXPECT_GE(closest(c), GetParam().closest[static_cast<std::size_t>(c)]) << "component " << c;
  }
}

INSTANTIATE_TEST_SUITE_P(Localise, Remainder,
                         testing::Values(Expected{SensorKind::kDirectionCosinesRange, {0.95, 0.95, 0.99}},
                                         Expected{SensorKind::kAzimuthElevationRange, {0.95, 0.95, 0.99}},
                                         Expected{SensorKind::kRange, {0.99, 0.0, 0.0}},
                                         Expected{SensorKind::kDirectionCosines, {0.95, 0.95, 0.0}},
                                         Expected{SensorKind::kAzimuthElevation, {0.95, 0.95, 0.0}},
                                         Expected{SensorKind::kRangeRate, {0.95, 0.0, 0.0}},
                                         Expected{SensorKind::kPosition, {0.0, 0.0, 0.0}}),
                         [](const auto& tested) { return std::string(describe(tested.param.kind).name); });

TEST(Remainder, OfTheRangeRateIsReachedAlsoByTheVelocityAlone) {
  // A station that sees the deviation at right angles to the new line of sight, the velocity along the chord.
  const double r = 1000.0;
  const double rho = 300.0;
  const double angle = std::asin(rho / r);
  Draw d{.x = {r, 0.0, 0.0},
         .v = Eigen::Vector3d::Zero(),
         .dx = rho * Eigen::Vector3d(-std::sin(angle), std::cos(angle), 0.0),
         .dv = Eigen::Vector3d::Zero()};
  d.dv = 10.0 * ((d.x + d.dx).normalized() - d.x.normalized()).normalized();
  const double delta = remainder(SensorKind::kRangeRate, d)(0);
  EXPECT_NEAR(delta, localise::bound_remainder(SensorKind::kRangeRate, d.x, d.v, radius(d)).half_width(0),
              1e-12);
}

TEST(Remainder, IsNotBoundedWhereTheDeviationReachesHalfTheDistance) {
  const Eigen::Vector3d x(30.0, 40.0, 1000.0);
  localise::DeviationRadius near{.all_m = 24.0, .across_m = 24.0, .horizontal_m = 24.0};
  EXPECT_TRUE(
      localise::bound_remainder(SensorKind::kAzimuthElevation, x, Eigen::Vector3d::Zero(), near).valid);
  near.horizontal_m = 26.0;  // over half the horizontal distance, 50 m
  const auto overhead =
      localise::bound_remainder(SensorKind::kAzimuthElevation, x, Eigen::Vector3d::Zero(), near);
  EXPECT_FALSE(overhead.valid);
  EXPECT_TRUE(overhead.half_width.allFinite());
  EXPECT_TRUE(localise::bound_remainder(SensorKind::kRange, x, Eigen::Vector3d::Zero(), near).valid);
  near.all_m = 501.0;
  EXPECT_FALSE(localise::bound_remainder(SensorKind::kRange, x, Eigen::Vector3d::Zero(), near).valid);
  near.all_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(localise::bound_remainder(SensorKind::kRange, x, Eigen::Vector3d::Zero(), near).valid);
}

// Drawn motions and clocks never exceed the bound of the remainder, and come close to it.
TEST(Remainder, OfAWrongClockIsBounded) {
  RandomStream stream(kSeed + 1);
  for (const SensorKind kind : {SensorKind::kAzimuthElevationRange, SensorKind::kRangeRate,
                                SensorKind::kDirectionCosinesRange, SensorKind::kPosition}) {
    double closest = 0.0;
    for (int draw = 0; draw < 4000; ++draw) {
      const auto random = [&](double size) { return Eigen::Vector3d(size * direction(stream)); };
      const Eigen::Vector3d x = random(5000.0), v = random(200.0), a = random(5.0);  // reference
      const Eigen::Vector3d dx = random(draw % 3 == 0 ? 0.0 : 50.0), dv = random(20.0), w = random(9.0);
      const double s = (2 * stream.uniform() - 1) * (draw % 2 == 0 ? 0.01 : 1.0);
      const sensor::Linearised model = sensor::linearise(kind, x, v);
      const Eigen::Vector3d linear = dx + v * s;
      const localise::RemainderBound bound = localise::bound_remainder(
          kind, x, v, model, radius({.x = x, .v = v, .dx = linear, .dv = dv}),
          {.offset_s = std::abs(s), .reference_mps2 = a.norm(), .acceleration_mps2 = w.norm()});
      const Eigen::Vector3d position = x + dx + (v + dv) * s + w * s * s / 2;
      const Eigen::Vector3d velocity = v + dv + w * s;
      const sensor::Padded left =
          sensor::difference(kind, sensor::measure(kind, position, velocity), model.value) -
          model.J_value_position * linear - model.J_value_velocity * (dv + a * s);
      for (Eigen::Index c = 0; bound.valid && c < components(kind); ++c) {
        EXPECT_LE(std::abs(left(c)), bound.half_width(c) * (1 + 1e-9) + 1e-9) << draw;
        closest = std::max(closest, std::abs(left(c)) / (bound.half_width(c) + 1e-9));
      }
    }
    EXPECT_GT(closest, 0.5) << describe(kind).name;
  }
}

}  // namespace
