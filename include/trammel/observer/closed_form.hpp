// SPDX-License-Identifier: Apache-2.0
/// @file
/// Closed form of path, information and control energy of the bearing-observation problem, regular for every
/// spatial frequency from 0 to 2 pi.
#pragma once

#include <cmath>
#include <numbers>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/packet.hpp"
#include "trammel/observer/plan_problem.hpp"
#include "trammel/observer/regular_functions.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

template <class Real>
using Vector2 = Eigen::Matrix<Real, 2, 1>;
template <class Real>
using Vector3 = Eigen::Matrix<Real, 3, 1>;
template <class Real>
using Matrix3 = Eigen::Matrix<Real, 3, 3>;

/// Plane rotation from the y, z axes to the two channels in which the problem is diagonal.
template <class Real>
struct BasicChannelRotation {
  Real cosine = 1.0;
  Real sine = 0.0;

  [[nodiscard]] Vector2<Real> to_channels(const Vector2<Real>& yz) const {
    return {cosine * yz.x() + sine * yz.y(), cosine * yz.y() - sine * yz.x()};
  }
  [[nodiscard]] Vector2<Real> to_axes(const Vector2<Real>& channels) const {
    return {cosine * channels.x() - sine * channels.y(), sine * channels.x() + cosine * channels.y()};
  }
  /// Q diag(d) Q'
  [[nodiscard]] Eigen::Matrix<Real, 2, 2> to_axes_matrix(const Vector2<Real>& d) const {
    const Real off = cosine * sine * (d.x() - d.y());
    Eigen::Matrix<Real, 2, 2> matrix;
    matrix << cosine * cosine * d.x() + sine * sine * d.y(), off, off,
        sine * sine * d.x() + cosine * cosine * d.y();
    return matrix;
  }
};

using ChannelRotation = BasicChannelRotation<double>;

/// One Jacobi rotation diagonalises a symmetric positive definite 2 x 2 matrix: its inverse is
/// Q diag(precision) Q'.
template <class Real>
struct BasicChannelDiagonal {
  BasicChannelRotation<Real> rotation;
  Vector2<Real> precision;

  BasicChannelDiagonal(const Real& s11, const Real& s12, const Real& s22) {
    using std::copysign;
    using std::sqrt;
    const Real difference = s22 - s11;
    const Real twice = 2.0 * s12;
    const Real root = sqrt(difference * difference + twice * twice);
    const Real tangent = select(twice == 0.0, Real(0.0), twice / (difference + copysign(root, difference)));
    rotation.cosine = 1.0 / sqrt(1.0 + tangent * tangent);
    rotation.sine = -tangent * rotation.cosine;
    const Real first = s11 - tangent * s12;
    const Real second = s22 + tangent * s12;
    const Real larger = select(first >= second, first, second);
    // The smaller eigenvalue from the determinant: the difference above cancels.
    const Real by_determinant = larger / (s11 * s22 - s12 * s12);
    const Real by_larger = 1.0 / larger;
    precision << select(first >= second, by_larger, by_determinant),
        select(first >= second, by_determinant, by_larger);
  }
};

using ChannelDiagonal = BasicChannelDiagonal<double>;

/// A prior as x and what is known of y, z given x.
///
/// | symbol   | field         | unit  | meaning                                              |
/// |----------|---------------|-------|------------------------------------------------------|
/// | 1/g11    | information_x | 1/m^2 | inverse variance of x                                |
/// | Bs       | slope_y, _z   | 1     | (gamma_12, gamma_13)/gamma_11: mean of y, z per x    |
/// | H        | s11, s12, s22 | m^2   | covariance of y, z given x                           |
template <class Real>
struct ConditionalPrior {
  Real information_x;
  Real slope_y;
  Real slope_z;
  Real s11;
  Real s12;
  Real s22;
};

template <class Real>
[[nodiscard]] ConditionalPrior<Real> conditional_prior(const Matrix3<Real>& covariance) {
  ConditionalPrior<Real> prior;
  prior.information_x = 1.0 / covariance(0, 0);
  prior.slope_y = covariance(1, 0) * prior.information_x;
  prior.slope_z = covariance(2, 0) * prior.information_x;
  prior.s11 = covariance(1, 1) - covariance(1, 0) * prior.slope_y;
  prior.s12 = covariance(2, 1) - covariance(1, 0) * prior.slope_z;
  prior.s22 = covariance(2, 2) - covariance(2, 0) * prior.slope_z;
  return prior;
}

/// A PlanProblem in its natural variables. All 2-vectors are in channel coordinates.
///
/// | symbol | field        | unit  | meaning |
/// |--------|--------------|-------|--------------------------------------------------------------------------|
/// | V      | speed        | m/s   | closing speed | | x0, a  | x_start/end  | m     | both negative | | ds
/// | span         | 1/m   | 1/x0 - 1/a = V T/(x0 a)                                                  | | L |
/// gain         | 1     | ds/(V sigma^2), sigma^2 = sigma0^2 Delta: information of the flight      | | fm, fd
/// | middle, half_change | 1 | (phi0 + phia)/2 and (phi0 - phia)/2 of the tangents phi = (y, z)/x      | |
/// delta  | prior_precision | 1/m^2 | D22 = Q diag(delta) Q': information on y, z at the start              |
/// | Bs     | prior_slope  | 1     | (gamma_12, gamma_13)/gamma_11 | | e      | offset       | 1     | fm -
/// Bs                                                                  |
template <class Real>
struct BasicChannelProblem {
  double speed = 0.0;
  double sigma = 0.0;
  Real x_start = 0.0;
  Real x_end = 0.0;
  double inverse_flown = 0.0;  ///< 1/(V T), 1/m
  Real span = 0.0;
  Real gain = 0.0;
  Real prior_information = 0.0;  ///< 1/gamma_11
  BasicChannelRotation<Real> rotation;
  Vector2<Real> tangent_start = Vector2<Real>::Zero();
  Vector2<Real> tangent_end = Vector2<Real>::Zero();
  Vector2<Real> middle = Vector2<Real>::Zero();
  Vector2<Real> half_change = Vector2<Real>::Zero();
  Vector2<Real> prior_precision = Vector2<Real>::Zero();
  Vector2<Real> prior_slope = Vector2<Real>::Zero();
  Vector2<Real> offset = Vector2<Real>::Zero();

  /// `problem` must be valid (require_valid); nothing is checked here.
  explicit BasicChannelProblem(const PlanProblem& problem)
      : BasicChannelProblem(problem, problem.time_to_go_s, problem.position_m,
                            conditional_prior(problem.covariance_m2)) {}
  /// `problem` from another start with another time to go.
  BasicChannelProblem(const PlanProblem& problem, double time_to_go_s, const Vector3<Real>& position,
                      const ConditionalPrior<Real>& prior);

  /// Whether channel 0 has the larger prior precision: its v reaches zero first.
  [[nodiscard]] MaskOf<Real> first_is_weak() const { return prior_precision.x() >= prior_precision.y(); }
  [[nodiscard]] int weak_channel() const { return first_is_weak() ? 0 : 1; }

  /// v_i = delta_i cos(xi/2) + L sinc(xi/2): positive and decreasing up to xi_1.
  [[nodiscard]] Vector2<Real> stiffness(const BasicFrequency<Real>& f) const {
    return {prior_precision.x() * f.cos_half + gain * f.sinc_half,
            prior_precision.y() * f.cos_half + gain * f.sinc_half};
  }

  /// xi_1, the first zero of v of the weak channel, between pi and 2 pi.
  [[nodiscard]] double critical_frequency() const;
};

using ChannelProblem = BasicChannelProblem<double>;

/// A member of the family of extremal paths, phi = fm + fd sin(eta)/sin(xi/2) + w (wave of frequency xi).
template <class Real>
struct BasicPathShape {
  Real xi = 0.0;
  Vector2<Real> wave = Vector2<Real>::Zero();  ///< w, channel coordinates
};

using PathShape = BasicPathShape<double>;

/// What a path shape yields; valid for any shape, optimal or not.
struct PathValue {
  double range_information = 0.0;                   ///< q = 1/Gamma_11(T), 1/m^2
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< b = Gamma_1i/Gamma_11, channel coordinates
  double control_energy = 0.0;                      ///< m^2/s, of the motion relative to the beacon
};

/// q, b and the control energy of a path shape, without cancellation for every 0 <= xi < 2 pi.
/// The variance of x given everything else follows from a completed square,
///   q = 1/g11 + sum_i [L delta_i/(L + delta_i)] t_i^2 + L var,  t = mean(phi) - Bs,
/// and equals the inverse of (3.14), (3.17) of Emelyanov and Rubinovich (2020), whose literal forms lose all
/// digits at xi = 0 and xi = pi.
[[nodiscard]] inline PathValue evaluate(const ChannelProblem& p, const Frequency& f,
                                        const Eigen::Vector2d& wave) {
  const double wave_square = wave.squaredNorm();
  const double change_square = p.half_change.squaredNorm();
  const double variance =
      wave_square * f.wave_variance() + 2.0 * change_square * f.cubic_remainder * f.inverse_square;
  PathValue value;
  value.range_information = p.prior_information + p.gain * variance;
  for (int i = 0; i < 2; ++i) {
    const double mean_offset = p.offset[i] + wave[i] * f.wave_mean();
    const double share = p.gain / (p.gain + p.prior_precision[i]);
    value.slope[i] = p.prior_slope[i] + share * mean_offset;
    value.range_information += share * p.prior_precision[i] * mean_offset * mean_offset;
  }
  const double xi2 = f.xi * f.xi;
  const double bending = 0.5 * wave_square * xi2 * xi2 * f.cubic_remainder +
                         4.0 * change_square * f.half_power() * f.inverse_square;
  value.control_energy = p.speed * (bending / p.span - p.x_start * p.tangent_start.squaredNorm() +
                                    p.x_end * p.tangent_end.squaredNorm());
  return value;
}

template <class Real>
BasicChannelProblem<Real>::BasicChannelProblem(const PlanProblem& problem, double time_to_go_s,
                                               const Vector3<Real>& position,
                                               const ConditionalPrior<Real>& prior)
    : speed(problem.closing_speed_mps()),
      sigma(problem.sigma0 * std::sqrt(problem.measurement_interval_s)),
      x_start(position.x()),
      x_end(x_start + speed * time_to_go_s),
      inverse_flown(1.0 / (speed * time_to_go_s)) {
  const Real inverse_area = 1.0 / (x_start * x_end);
  span = speed * time_to_go_s * inverse_area;
  // A grid point that rounding puts just behind the end of the flight still belongs to it.
  constexpr double kTimeTolerance = 1e-9;
  const bool measured = problem.measurement_interval_s <= time_to_go_s * (1.0 + kTimeTolerance);
  gain = measured ? span * (1.0 / (speed * sigma * sigma)) : Real(0.0);
  prior_information = prior.information_x;
  const BasicChannelDiagonal<Real> diagonal(prior.s11, prior.s12, prior.s22);
  rotation = diagonal.rotation;
  prior_precision = diagonal.precision;
  prior_slope = rotation.to_channels({prior.slope_y, prior.slope_z});
  const Real inverse_start = x_end * inverse_area;
  const Real inverse_end = x_start * inverse_area;
  tangent_start = rotation.to_channels({position.y() * inverse_start, position.z() * inverse_start});
  tangent_end =
      rotation.to_channels({problem.terminal_m.x() * inverse_end, problem.terminal_m.y() * inverse_end});
  middle = 0.5 * (tangent_start + tangent_end);
  half_change = 0.5 * (tangent_start - tangent_end);
  offset = middle - prior_slope;
}

template <class Real>
double BasicChannelProblem<Real>::critical_frequency() const {
  // v = 0 means cot(h) = -rho/h with h = xi/2, that is h = pi/2 + atan(rho/h). Newton on the difference,
  // whose slope is at least 1, converges for every rho.
  constexpr int kMaxSteps = 50;
  constexpr double kQuarterTurn = 0.5 * std::numbers::pi;
  const double rho = gain / prior_precision.maxCoeff();
  double h = kQuarterTurn + std::atan(rho / kQuarterTurn);
  for (int step = 0; step < kMaxSteps; ++step) {
    const double correction = (h - kQuarterTurn - std::atan(rho / h)) / (1.0 + rho / (h * h + rho * rho));
    h -= correction;
    // Quadratic convergence: the next correction would be below rounding.
    if (std::abs(correction) < 1e-9 * h) {
      break;
    }
  }
  return 2.0 * h;
}

}  // namespace trammel::inline TRAMMEL_ABI::observer
