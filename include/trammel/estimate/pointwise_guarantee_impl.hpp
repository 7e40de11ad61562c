// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of pointwise_guarantee.hpp.
#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/estimate/bias_bound.hpp"
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
  const Eigen::MatrixXd from_motion = coordinates_.from_kept_motion();
  const Eigen::MatrixXd motion_bias = error * from_motion;

  std::vector<Eigen::Index> bounded;
  std::vector<Eigen::Index> unbounded;
  Eigen::VectorXd axes(p);
  Eigen::Index last = -1;
  for (Eigen::Index k = 0; k < p; ++k) {
    const Eigen::Index place = coordinates_.kept()[static_cast<std::size_t>(k)];
    axes(k) = semi_axes(bounds, place / 3)(place % 3);
    if (!std::isfinite(axes(k))) {
      unbounded.push_back(k);
      continue;
    }
    bounded.push_back(k);
    if (place / 3 != last) {
      block_sizes_.push_back(0);
      last = place / 3;
    }
    ++block_sizes_.back();
  }
  bias_ = motion_bias(Eigen::all, bounded) * axes(bounded).asDiagonal();
  free_ = motion_bias(Eigen::all, unbounded);
  free_own_ = from_motion(Eigen::all, unbounded);
}

TRAMMEL_INLINE double PointwiseGuarantee::rms_m(double t_s) const {
  const MotionCoordinates::Rows3 rows = coordinates_.position_rows(t_s);
  if (free_.cols() > 0) {
    const double seen = (rows * free_).norm();
    if (seen > kRounding * (rows * free_own_).norm()) {
      return std::numeric_limits<double>::infinity();
    }
  }
  const Eigen::Matrix3Xd bias = rows * bias_;
  std::vector<Eigen::Matrix3Xd> blocks;
  Eigen::Index at = 0;
  for (const Eigen::Index size : block_sizes_) {
    blocks.emplace_back(bias.middleCols(at, size));
    at += size;
  }
  return std::sqrt((rows * noise_).squaredNorm() + bound_bias(blocks).upper);
}

}  // namespace trammel::inline TRAMMEL_ABI::estimate
