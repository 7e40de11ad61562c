// SPDX-License-Identifier: Apache-2.0
/// @file
/// The motions that bounds allow, as columns.
#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/problem/motion_coordinates.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

/// Deviations z = bounded * u + free * f with |u_l| <= 1 per block l and any f: exactly those within the
/// bounds, of the motion and of the stations' biases.
struct BoundedMotion {
  Eigen::MatrixXd bounded;  ///< p x k, one column per bounded entry of theta, and bias, at its semi-axis
  Eigen::MatrixXd free;     ///< p x (p - k), one column per unbounded one (1 m, m/s, m/s^2, unit of a bias)
  std::vector<Eigen::Index> block_sizes;  ///< columns of `bounded` per bound; sum k
};

/// The motions within `bounds`, which must be those the coordinates were made for.
[[nodiscard]] inline BoundedMotion bounded_motion(const MotionCoordinates& coordinates,
                                                  const MotionBounds& bounds) {
  const Eigen::MatrixXd from_motion = coordinates.from_kept_motion();
  std::vector<Eigen::Index> bounded;
  std::vector<Eigen::Index> unbounded;
  std::vector<double> axes;
  BoundedMotion result;
  Eigen::Index last = -1;
  const auto add = [&](Eigen::Index k, Eigen::Index block, double axis) {
    if (!std::isfinite(axis)) {
      unbounded.push_back(k);
      return;
    }
    bounded.push_back(k);
    axes.push_back(axis);
    if (block != last) {
      result.block_sizes.push_back(0);
      last = block;
    }
    ++result.block_sizes.back();
  };
  const Eigen::Index motions = coordinates.motion_parameters();
  for (Eigen::Index k = 0; k < motions; ++k) {
    const Eigen::Index place = coordinates.kept()[static_cast<std::size_t>(k)];
    add(k, place / 3, semi_axes(bounds, place / 3)(place % 3));
  }
  for (Eigen::Index k = motions; k < coordinates.parameters(); ++k) {
    const BiasParameter& bias = coordinates.bias_parameters()[static_cast<std::size_t>(k - motions)];
    add(k, coordinates.basis().coefficients() + static_cast<Eigen::Index>(bias.station), bias.semi_axis);
  }
  result.bounded = from_motion(Eigen::all, bounded);
  for (Eigen::Index k = 0; k < result.bounded.cols(); ++k) {
    result.bounded.col(k) *= axes[static_cast<std::size_t>(k)];
  }
  result.free = from_motion(Eigen::all, unbounded);
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::estimate
