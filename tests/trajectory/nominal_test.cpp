// SPDX-License-Identifier: Apache-2.0
#include "trammel/trajectory/nominal_trajectory.hpp"

#include <ceres/jet.h>
#include <gtest/gtest.h>

namespace {

using trammel::Error;
using trammel::trajectory::NominalTrajectory;

Eigen::Vector3d cubic(double t) { return {1 + t * (2 - t * (3 - 0.5 * t)), 4 - t * t * t, 7 * t}; }
Eigen::Vector3d cubic_rate(double t) { return {2 - 6 * t + 1.5 * t * t, -3 * t * t, 7.0}; }

NominalTrajectory sampled(const std::vector<double>& times, Eigen::Vector3d (*path)(double)) {
  std::vector<Eigen::Vector3d> positions;
  for (const double t : times) {
    positions.push_back(path(t));
  }
  return NominalTrajectory::through(times, positions);
}

TEST(Nominal, ReproducesCubicsFromFourSamples) {
  for (const std::vector<double>& times : {std::vector<double>{0, 1, 3, 3.5}, {-1, 0, 0.5, 2, 2.25, 4}}) {
    const NominalTrajectory path = sampled(times, cubic);
    for (double t = times.front(); t <= times.back(); t += 0.1) {
      EXPECT_LT((path.position(t) - cubic(t)).norm(), 1e-12);
      EXPECT_LT((path.velocity(t) - cubic_rate(t)).norm(), 1e-12);
      EXPECT_NEAR(path.acceleration(t)(0), -6 + 3 * t, 1e-11);
    }
  }
}

TEST(Nominal, ReproducesParabolasFromThreeAndLinesFromTwo) {
  const auto parabola = [](double t) { return Eigen::Vector3d(t * t, 1 - t + 2 * t * t, 3.0); };
  const NominalTrajectory three = sampled({0, 1, 4}, parabola);
  const NominalTrajectory two = sampled({0, 4}, parabola);
  for (double t = 0; t <= 4; t += 0.25) {
    EXPECT_LT((three.position(t) - parabola(t)).norm(), 1e-12);
    EXPECT_LT((two.position(t) - parabola(4) * t / 4 - parabola(0) * (4 - t) / 4).norm(), 1e-12);
  }
}

// Fourth order: a quarter of the spacing, 1/256 of the error; smooth across samples.
TEST(Nominal, ConvergesWithFourthOrderUpToTheEnds) {
  const auto circle = [](double t) { return Eigen::Vector3d(std::cos(t), std::sin(t), 0.0); };
  const auto error = [&](int parts) {
    std::vector<double> times;
    for (int i = 0; i <= parts; ++i) {
      times.push_back(4.0 * i / parts);
    }
    const NominalTrajectory path = sampled(times, circle);
    double worst = 0.0;
    for (int i = 0; i <= 1000; ++i) {
      worst = std::max(worst, (path.position(0.004 * i) - circle(0.004 * i)).norm());
    }
    return worst;
  };
  EXPECT_GT(error(16) / error(64), 150.0);
  const NominalTrajectory path = sampled({0, 0.5, 1, 1.5, 2}, circle);
  EXPECT_LT((path.velocity(1.0 - 1e-9) - path.velocity(1.0)).norm(), 1e-8);
  EXPECT_LT((path.acceleration(1.0 - 1e-9) - path.acceleration(1.0)).norm(), 1e-7);
  for (const double t : {0.0, 0.5, 1.0, 1.5, 2.0}) {
    EXPECT_LT((path.position(t) - circle(t)).norm(), 1e-15);
  }
}

TEST(Nominal, WorksOnDualNumbersAndFloats) {
  using Dual = ceres::Jet<double, 1>;
  const NominalTrajectory path = sampled({0, 1, 3, 3.5, 6}, cubic);
  EXPECT_NEAR(path.position(Dual(2.2, 0))(0).v(0), path.velocity(2.2)(0), 1e-12);
  EXPECT_NEAR(path.position(2.25F)(0), path.position(2.25)(0), 1e-4);
}

TEST(Nominal, LineNeverEnds) {
  const NominalTrajectory line = NominalTrajectory::line(10.0, {1, 2, 3}, {4, 5, 6});
  EXPECT_EQ(line.position(12.0), Eigen::Vector3d(9, 12, 15));
  EXPECT_EQ(line.position(9.0), Eigen::Vector3d(-3, -3, -3));
  EXPECT_EQ(line.velocity(500.0), Eigen::Vector3d(4, 5, 6));
  EXPECT_TRUE(line.covers(1e9));
}

TEST(Nominal, RefusesBadSamples) {
  const Eigen::Vector3d x = Eigen::Vector3d::Zero();
  const Eigen::Vector3d bad(0.0, std::nan(""), 0.0);
  EXPECT_THROW((void)NominalTrajectory::through({0}, {x}), Error);
  EXPECT_THROW((void)NominalTrajectory::through({0, 1}, {x}), Error);
  EXPECT_THROW((void)NominalTrajectory::through({0, 0}, {x, x}), Error);
  EXPECT_THROW((void)NominalTrajectory::through({0, std::nan("")}, {x, x}), Error);
  EXPECT_THROW((void)NominalTrajectory::through({0, 1}, {x, bad}), Error);
  EXPECT_THROW((void)NominalTrajectory::line(0, bad, x), Error);
  EXPECT_FALSE(NominalTrajectory::through({0, 1}, {x, x}).covers(1.1));
}

}  // namespace
