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

/// A constant error of a station that is estimated along with the motion.
struct BiasParameter {
  std::size_t station = 0;     ///< index into Scenario::stations
  Eigen::Index component = 0;  ///< of the station's kind, or kTimeOffset
  double semi_axis = 0.0;      ///< unit of the component, s for the time offset; infinity: unbounded

  static constexpr Eigen::Index kTimeOffset = -1;
};

/// The biases of a scenario's stations whose semi-axis is not zero: station by station, components in order,
/// then the time offset.
[[nodiscard]] std::vector<BiasParameter> bias_parameters(const Scenario& scenario);

/// Deviation from the reference in three descriptions:
///
/// | symbol | meaning                                                                    | shape       |
/// |--------|----------------------------------------------------------------------------|-------------|
/// | theta  | position (m), velocity (m/s) at the first knot, acceleration (m/s^2) per   | 3 (r + 2)   |
/// |        | segment, three axes each: what the user sees; removed ones exactly zero    |             |
/// | c      | B-spline coefficients (m), coefficient by coefficient, three axes each     | 3 (r + 2)   |
/// | b      | biases of stations, in their units                                         | q           |
/// | z      | parameters of the problem: those of the motion, then those of the biases   | p           |
///
/// (c, b) = diag(N, I) D z with a diagonal D that gives the columns of the problem unit length. Without
/// removed parameters N is the identity and everything is banded; otherwise N is, per axis, an orthonormal
/// basis of the coefficients whose removed motion parameters vanish.
class MotionCoordinates {
 public:
  using Rows3 = Eigen::Matrix<double, 3, Eigen::Dynamic>;

  /// Removes the parameters whose semi-axis in `bounds` is zero. Throws Error when none is left.
  MotionCoordinates(trajectory::SplineBasis basis, const MotionBounds& bounds,
                    std::vector<BiasParameter> biases = {});

  [[nodiscard]] const trajectory::SplineBasis& basis() const noexcept { return basis_; }
  /// p.
  [[nodiscard]] Eigen::Index parameters() const noexcept { return scale_.size(); }
  /// 3 (r + 2).
  [[nodiscard]] Eigen::Index all_parameters() const noexcept { return 3 * basis_.coefficients(); }
  /// Per entry of theta, whether it was removed.
  [[nodiscard]] const std::vector<bool>& removed() const noexcept { return removed_; }
  /// Places in theta of the p - q parameters that are left, ascending.
  [[nodiscard]] const std::vector<Eigen::Index>& kept() const noexcept { return kept_; }
  /// p - q: the parameters of z that describe the motion.
  [[nodiscard]] Eigen::Index motion_parameters() const noexcept {
    return static_cast<Eigen::Index>(kept_.size());
  }
  /// The q biases.
  [[nodiscard]] const std::vector<BiasParameter>& bias_parameters() const noexcept { return biases_; }

  /// Chooses D: `scale` has p positive entries.
  void set_scale(const Eigen::VectorXd& scale);

  /// Rows in c (k x 3 (r + 2)) or (c, b) (k x (3 (r + 2) + q)) as rows in z (k x p).
  [[nodiscard]] Eigen::MatrixXd restrict_rows(const Eigen::MatrixXd& rows) const;
  /// c for every column of `z`.
  [[nodiscard]] Eigen::MatrixXd coefficients(const Eigen::MatrixXd& z) const;
  /// theta for every column of `z`.
  [[nodiscard]] Eigen::MatrixXd motion(const Eigen::MatrixXd& z) const;
  /// b for every column of `z`.
  [[nodiscard]] Eigen::MatrixXd biases(const Eigen::MatrixXd& z) const;
  /// The time offset (s) of each of `stations` stations in the biases of `z`; 0 where it has none.
  [[nodiscard]] std::vector<double> time_offsets_s(const Eigen::VectorXd& z, std::size_t stations) const;
  /// z for every column of `theta` without biases; what theta says about removed parameters is ignored.
  [[nodiscard]] Eigen::MatrixXd from_motion(const Eigen::MatrixXd& theta) const;
  /// z for every column of `theta` and of `biases` (q rows).
  [[nodiscard]] Eigen::MatrixXd from_motion(const Eigen::MatrixXd& theta,
                                            const Eigen::MatrixXd& biases) const;
  /// z of the same motion and biases as `z` in `other`, coordinates of the same bounds and stations.
  [[nodiscard]] Eigen::MatrixXd moved_from(const MotionCoordinates& other, const Eigen::MatrixXd& z) const {
    return from_motion(other.motion(z), other.biases(z));
  }
  /// p x p: z from the kept entries of theta followed by the biases.
  [[nodiscard]] Eigen::MatrixXd from_kept_motion() const;
  /// Rows in z that give the kept entries of theta followed by the biases, p x p.
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
  std::vector<BiasParameter> biases_;
  Eigen::MatrixXd null_space_;  ///< N, 3 (r + 2) x (p - q); empty: the identity
  Eigen::VectorXd scale_;       ///< diagonal of D
};

}  // namespace trammel::inline TRAMMEL_ABI

#ifndef TRAMMEL_COMPILED
#include "trammel/problem/motion_coordinates_impl.hpp"
#endif
