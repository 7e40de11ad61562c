// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of pointwise_guarantee.hpp.
#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/estimate/bias_bound.hpp"
#include "trammel/estimate/bounded_motion.hpp"
#include "trammel/estimate/pointwise_guarantee.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

TRAMMEL_INLINE PointwiseGuarantee::PointwiseGuarantee(const TrajectoryProblem& problem,
                                                      const MotionBounds& bounds, const Eigen::MatrixXd& gain)
    : coordinates_(problem.coordinates) {
  const Eigen::Index p = coordinates_.parameters();
  if (gain.rows() != p || gain.cols() != p) {
    throw Error({"gain", std::to_string(gain.rows()) + " x " + std::to_string(gain.cols()),
                 std::to_string(p) + " x " + std::to_string(p)});
  }
  const Eigen::MatrixXd& F = problem.problem.information_factor;
  noise_ = gain * F.transpose();
  Eigen::MatrixXd error = noise_ * F;
  error.diagonal().array() -= 1.0;
  BoundedMotion motion = bounded_motion(coordinates_, bounds);
  bias_ = error * motion.bounded;
  free_ = error * motion.free;
  free_own_ = std::move(motion.free);
  block_sizes_ = std::move(motion.block_sizes);
}

TRAMMEL_INLINE double PointwiseGuarantee::rms_m(double t_s) const {
  const MotionCoordinates::Rows3 rows = coordinates_.position_rows(t_s);
  if (free_.cols() > 0) {
    const double seen = (rows * free_).norm();
    if (seen > kRounding * (rows * free_own_).norm()) {
      return std::numeric_limits<double>::infinity();
    }
  }
  return std::sqrt((rows * noise_).squaredNorm() + bound_bias(rows * bias_, block_sizes_).upper);
}

}  // namespace trammel::inline TRAMMEL_ABI::estimate
