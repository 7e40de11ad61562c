// SPDX-License-Identifier: Apache-2.0
/// @file
/// What one estimator guarantees at single times.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/problem/assemble.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

/// Guaranteed rms error (m) of the position at single times, of the estimate z = K F'y of a trajectory
/// problem:
///
///   sqrt( |B(t) K F'|_F^2 + max over the bounds of |B(t) (K F'F - I) z|^2 ).
///
/// | symbol | meaning                                              | shape |
/// |--------|------------------------------------------------------|-------|
/// | B(t)   | rows of the position at t                            | 3 x p |
/// | K      | gain of the solution                                 | p x p |
/// | F      | information factor                                   | m x p |
///
/// The maximum is replaced by the proved bound of bound_bias. Where an unbounded motion is not followed
/// exactly the value is infinite; deviations of the size of rounding errors (kRounding of the motion itself)
/// are taken as none. Cost: O(p^3) once, O(p^2) per time.
class PointwiseGuarantee {
 public:
  /// `bounds` are those of the scenario that `problem` was made from. Throws Error for a gain of another
  /// shape.
  PointwiseGuarantee(const TrajectoryProblem& problem, const MotionBounds& bounds,
                     const Eigen::MatrixXd& gain);

  /// Proved upper bound of the rms error at a time within the knots, m.
  [[nodiscard]] double rms_m(double t_s) const;

 private:
  static constexpr double kRounding = 1e-6;

  const MotionCoordinates& coordinates_;
  Eigen::MatrixXd noise_;     ///< K F', p x m
  Eigen::MatrixXd bias_;      ///< (K F'F - I) z(theta), p x p, columns over semi-axes; kept entries of theta
  Eigen::MatrixXd free_;      ///< the same columns for unbounded entries, unscaled
  Eigen::MatrixXd free_own_;  ///< z(theta) of unbounded entries, to compare with
  std::vector<Eigen::Index> block_sizes_;
};

}  // namespace trammel::inline TRAMMEL_ABI::estimate

#ifndef TRAMMEL_COMPILED
#include "trammel/estimate/pointwise_guarantee_impl.hpp"
#endif
