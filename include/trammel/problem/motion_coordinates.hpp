// SPDX-License-Identifier: Apache-2.0
/// @file
/// The coordinates in which the guaranteed problem of a trajectory is solved, and the way back.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/problem/scenario.hpp"
#include "trammel/trajectory/quadratic_spline.hpp"
#include "trammel/trajectory/spline_basis.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// Semi-axes of bound l of a scenario: position, velocity, segments in order.
[[nodiscard]] inline const Eigen::Vector3d& semi_axes(const MotionBounds& bounds, Eigen::Index l) {
  return l == 0   ? bounds.position_m
         : l == 1 ? bounds.velocity_mps
                  : bounds.acceleration_mps2[static_cast<std::size_t>(l - 2)];
}

/// Deviation from the reference in three descriptions:
///
/// | symbol | meaning                                                                    | shape       |
/// |--------|----------------------------------------------------------------------------|-------------|
/// | theta  | position (m), velocity (m/s) at the first knot, acceleration (m/s^2) per   | 3 (r + 2)   |
/// |        | segment, three axes each: what the user sees; removed ones exactly zero    |             |
/// | c      | B-spline coefficients (m), coefficient by coefficient, three axes each     | 3 (r + 2)   |
/// | z      | parameters of the problem                                                  | p           |
///
/// c = N D z with a diagonal D that gives the columns of the problem unit length. Without removed parameters
/// N is the identity and everything is banded; otherwise N is, per axis, an orthonormal basis of the
/// coefficients whose removed motion parameters vanish.
class MotionCoordinates {
 public:
  using Rows3 = Eigen::Matrix<double, 3, Eigen::Dynamic>;

  /// Removes the parameters whose semi-axis in `bounds` is zero. Throws Error when none is left.
  MotionCoordinates(trajectory::SplineBasis basis, const MotionBounds& bounds);

  [[nodiscard]] const trajectory::SplineBasis& basis() const noexcept { return basis_; }
  /// p.
  [[nodiscard]] Eigen::Index parameters() const noexcept { return scale_.size(); }
  /// 3 (r + 2).
  [[nodiscard]] Eigen::Index all_parameters() const noexcept { return 3 * basis_.coefficients(); }
  /// Per entry of theta, whether it was removed.
  [[nodiscard]] const std::vector<bool>& removed() const noexcept { return removed_; }
  /// Places in theta of the p parameters that are left, ascending.
  [[nodiscard]] const std::vector<Eigen::Index>& kept() const noexcept { return kept_; }

  /// Chooses D: `scale` has p positive entries.
  void set_scale(const Eigen::VectorXd& scale);

  /// Rows in c (k x 3 (r + 2)) as rows in z (k x p).
  [[nodiscard]] Eigen::MatrixXd restrict_rows(const Eigen::MatrixXd& rows) const;
  /// c = N D z for every column of `z`.
  [[nodiscard]] Eigen::MatrixXd coefficients(const Eigen::MatrixXd& z) const;
  /// theta for every column of `z`.
  [[nodiscard]] Eigen::MatrixXd motion(const Eigen::MatrixXd& z) const;
  /// z for every column of `theta`; what theta says about removed parameters is ignored.
  [[nodiscard]] Eigen::MatrixXd from_motion(const Eigen::MatrixXd& theta) const;
  /// p x p: z from the kept entries of theta.
  [[nodiscard]] Eigen::MatrixXd from_kept_motion() const;
  /// Rows in z that give the kept entries of theta, p x p.
  [[nodiscard]] Eigen::MatrixXd kept_motion_rows() const;

  /// Rows in z that give position (m), velocity (m/s), acceleration (m/s^2) at a time, 3 x p.
  [[nodiscard]] Rows3 position_rows(double t_s) const;
  [[nodiscard]] Rows3 velocity_rows(double t_s) const;
  [[nodiscard]] Rows3 acceleration_rows(double t_s) const;

  /// The deviation as a motion in space.
  [[nodiscard]] trajectory::QuadraticSpline<double> spline(const Eigen::VectorXd& z) const;

 private:
  [[nodiscard]] Rows3 local_rows(const trajectory::LocalBasis<double>& local,
                                 const Eigen::Matrix<double, 1, 3>& weight) const;
  void make_null_spaces();

  trajectory::SplineBasis basis_;
  std::vector<bool> removed_;
  std::vector<Eigen::Index> kept_;
  Eigen::MatrixXd null_space_;  ///< N, 3 (r + 2) x p; empty: the identity
  Eigen::VectorXd scale_;       ///< diagonal of D
};

}  // namespace trammel::inline TRAMMEL_ABI

#ifndef TRAMMEL_COMPILED
#include "trammel/problem/motion_coordinates_impl.hpp"
#endif
