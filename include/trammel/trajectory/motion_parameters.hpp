// SPDX-License-Identifier: Apache-2.0
/// @file
/// Between spline coefficients and what a user sees: start, velocity, accelerations.
#pragma once

#include <Eigen/Core>

#include "trammel/trajectory/spline_basis.hpp"

namespace trammel::inline TRAMMEL_ABI::trajectory {

/// Motion parameters of one axis, in this order: position (m) and velocity (m/s) at the first knot, then the
/// acceleration (m/s^2) of each segment: m = [x(T_0); v(T_0); w_1; ..; w_r], r + 2 numbers, the theta of
/// Mamaev and Semenikhin (README, Sources) for one axis.
///
/// Row of truncated powers a(t) with x(t) = a(t) m:
///   a(t) = [1, t - T_0, psi_1(t), .., psi_r(t)],  psi_i = 0 left of segment i, (t - T_{i-1})^2/2 on it,
///   h^2/2 + h (t - T_i) right of it, h = T_i - T_{i-1}.
template <class Scalar>
[[nodiscard]] Eigen::Matrix<Scalar, 1, Eigen::Dynamic> motion_row(const SplineBasis& basis,
                                                                  const Scalar& t_s) {
  Eigen::Matrix<Scalar, 1, Eigen::Dynamic> row =
      Eigen::Matrix<Scalar, 1, Eigen::Dynamic>::Zero(basis.coefficients());
  row(0) = Scalar(1);
  row(1) = t_s - Scalar(basis.begin_s());
  const Eigen::Index current = basis.segment_at(t_s);
  for (Eigen::Index i = 0; i < current; ++i) {
    const double h = basis.length_s(i);
    row(2 + i) = Scalar(h) * (t_s - Scalar(basis.knot(i + 1)) + Scalar(h / 2));
  }
  const Scalar since = t_s - Scalar(basis.knot(current));
  row(2 + current) = since * since / Scalar(2);
  return row;
}

/// What gives motion parameter l of one axis from three spline coefficients: `weight` times those from
/// `first` on.
struct MotionRow {
  Eigen::Index first = 0;
  Eigen::RowVector3d weight;
};
[[nodiscard]] inline MotionRow motion_row_of_coefficients(const SplineBasis& basis, Eigen::Index l) {
  if (l < 2) {
    const LocalBasis<double> start = basis.at(basis.begin_s());
    return {.first = 0, .weight = l == 0 ? start.value : start.rate};
  }
  return {.first = l - 2, .weight = basis.on_segment(l - 2, basis.knot(l - 2)).second_rate};
}

/// (r + 2) x (r + 2) matrix that takes the B-spline coefficients of one axis to its motion parameters (three
/// numbers per row).
[[nodiscard]] inline Eigen::MatrixXd motion_from_coefficients(const SplineBasis& basis) {
  const Eigen::Index count = basis.coefficients();
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(count, count);
  for (Eigen::Index l = 0; l < count; ++l) {
    const MotionRow row = motion_row_of_coefficients(basis, l);
    result.row(l).segment<3>(row.first) = row.weight;
  }
  return result;
}

/// Its inverse, without solving: coefficient j is the polar form of the segment it belongs to,
/// c_j = x + v ((a + b)/2 - T) + w (a - T)(b - T)/2 with (a, b) = (T_{j-1}, T_j), and x, v, w those of a
/// segment that starts at T (de Boor 1978, chapter IX, dual functionals). Lower triangular but for the first
/// rows.
[[nodiscard]] inline Eigen::MatrixXd coefficients_from_motion(const SplineBasis& basis) {
  const Eigen::Index count = basis.coefficients();
  Eigen::MatrixXd result(count, count);
  Eigen::RowVectorXd velocity = Eigen::RowVectorXd::Unit(count, 1);
  Eigen::RowVectorXd position = Eigen::RowVectorXd::Unit(count, 0);
  const auto set = [&](Eigen::Index j, Eigen::Index segment) {
    const double a = basis.knot(j - 1) - basis.knot(segment);
    const double b = basis.knot(j) - basis.knot(segment);
    result.row(j) = position + (a + b) / 2 * velocity;
    result(j, 2 + segment) += a * b / 2;
  };
  set(0, 0);
  for (Eigen::Index i = 0; i < basis.segments(); ++i) {
    set(i + 1, i);
    if (i + 1 == basis.segments()) {
      set(i + 2, i);
      break;
    }
    const double h = basis.length_s(i);
    position += h * velocity;
    position(2 + i) += h * h / 2;
    velocity(2 + i) += h;
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::trajectory
