// SPDX-License-Identifier: Apache-2.0
/// @file
/// Closed form of path, information and control energy of the bearing-observation problem, regular for every
/// spatial frequency from 0 to 2 pi.
#pragma once

#include <cmath>
#include <numbers>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/observer/plan_problem.hpp"
#include "trammel/observer/regular_functions.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

/// Plane rotation from the y, z axes to the two channels in which the problem is diagonal.
struct ChannelRotation {
  double cosine = 1.0;
  double sine = 0.0;

  [[nodiscard]] Eigen::Vector2d to_channels(const Eigen::Vector2d& yz) const {
    return {cosine * yz.x() + sine * yz.y(), cosine * yz.y() - sine * yz.x()};
  }
  [[nodiscard]] Eigen::Vector2d to_axes(const Eigen::Vector2d& channels) const {
    return {cosine * channels.x() - sine * channels.y(), sine * channels.x() + cosine * channels.y()};
  }
  /// Q diag(d) Q'
  [[nodiscard]] Eigen::Matrix2d to_axes_matrix(const Eigen::Vector2d& d) const {
    const double off = cosine * sine * (d.x() - d.y());
    Eigen::Matrix2d matrix;
    matrix << cosine * cosine * d.x() + sine * sine * d.y(), off, off,
        sine * sine * d.x() + cosine * cosine * d.y();
    return matrix;
  }
};

/// One Jacobi rotation diagonalises a symmetric positive definite 2 x 2 matrix: its inverse is
/// Q diag(precision) Q'.
struct ChannelDiagonal {
  ChannelRotation rotation;
  Eigen::Vector2d precision;

  ChannelDiagonal(double s11, double s12, double s22) {
    double tangent = 0.0;
    if (s12 != 0.0) {
      const double ratio = (s22 - s11) / (2.0 * s12);
      tangent = 1.0 / (ratio + std::copysign(std::sqrt(1.0 + ratio * ratio), ratio));
      rotation.cosine = 1.0 / std::sqrt(1.0 + tangent * tangent);
      rotation.sine = -tangent * rotation.cosine;
    }
    const double first = s11 - tangent * s12;
    const double second = s22 + tangent * s12;
    const double determinant = s11 * s22 - s12 * s12;
    // The smaller eigenvalue from the determinant: the difference above cancels.
    precision = first >= second ? Eigen::Vector2d(1.0 / first, first / determinant)
                                : Eigen::Vector2d(second / determinant, 1.0 / second);
  }
};

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
struct ChannelProblem {
  double speed = 0.0;
  double sigma = 0.0;
  double x_start = 0.0;
  double x_end = 0.0;
  double span = 0.0;
  double gain = 0.0;
  double prior_information = 0.0;  ///< 1/gamma_11
  ChannelRotation rotation;
  Eigen::Vector2d tangent_start = Eigen::Vector2d::Zero();
  Eigen::Vector2d tangent_end = Eigen::Vector2d::Zero();
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  Eigen::Vector2d half_change = Eigen::Vector2d::Zero();
  Eigen::Vector2d prior_precision = Eigen::Vector2d::Zero();
  Eigen::Vector2d prior_slope = Eigen::Vector2d::Zero();
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();

  /// `problem` must be valid (require_valid); nothing is checked here.
  explicit ChannelProblem(const PlanProblem& problem);

  /// Channel with the larger prior precision: its v reaches zero first.
  [[nodiscard]] int weak_channel() const { return prior_precision.x() >= prior_precision.y() ? 0 : 1; }

  /// v_i = delta_i cos(xi/2) + L sinc(xi/2): positive and decreasing up to xi_1.
  [[nodiscard]] Eigen::Vector2d stiffness(const Frequency& f) const {
    return {prior_precision.x() * f.cos_half + gain * f.sinc_half,
            prior_precision.y() * f.cos_half + gain * f.sinc_half};
  }

  /// xi_1, the first zero of v of the weak channel, between pi and 2 pi. `hint`: a value near it, or 0.
  [[nodiscard]] double critical_frequency(double hint = 0.0) const;
};

/// A member of the family of extremal paths, phi = fm + fd sin(eta)/sin(xi/2) + w (wave of frequency xi).
struct PathShape {
  double xi = 0.0;
  Eigen::Vector2d wave = Eigen::Vector2d::Zero();  ///< w, channel coordinates
};

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
  const double inverse_m2 = 1.0 / (f.sinc_half * f.sinc_half);
  const double variance =
      wave_square * f.wave_variance() + 2.0 * change_square * f.cubic_remainder * inverse_m2;
  PathValue value;
  value.range_information = p.prior_information + p.gain * variance;
  for (int i = 0; i < 2; ++i) {
    const double mean_offset = p.offset[i] + wave[i] * f.wave_mean();
    const double share = p.gain / (p.gain + p.prior_precision[i]);
    value.slope[i] = p.prior_slope[i] + share * mean_offset;
    value.range_information += share * p.prior_precision[i] * mean_offset * mean_offset;
  }
  const double xi2 = f.xi * f.xi;
  const double bending =
      0.5 * wave_square * xi2 * xi2 * f.cubic_remainder + 4.0 * change_square * f.half_power() * inverse_m2;
  value.control_energy = p.speed * (bending / p.span - p.x_start * p.tangent_start.squaredNorm() +
                                    p.x_end * p.tangent_end.squaredNorm());
  return value;
}

inline ChannelProblem::ChannelProblem(const PlanProblem& problem)
    : speed(problem.closing_speed_mps()),
      sigma(problem.sigma0 * std::sqrt(problem.measurement_interval_s)),
      x_start(problem.position_m.x()),
      x_end(problem.final_x_m()),
      span(speed * problem.time_to_go_s / (x_start * x_end)) {
  // A grid point that rounding puts just behind the end of the flight still belongs to it.
  constexpr double kTimeTolerance = 1e-9;
  const bool measured = problem.measurement_interval_s <= problem.time_to_go_s * (1.0 + kTimeTolerance);
  gain = measured ? span / (speed * sigma * sigma) : 0.0;
  const Eigen::Matrix3d& gamma = problem.covariance_m2;
  prior_information = 1.0 / gamma(0, 0);
  const Eigen::Vector2d slope = Eigen::Vector2d(gamma(1, 0), gamma(2, 0)) * prior_information;
  const double s11 = gamma(1, 1) - gamma(1, 0) * slope.x();
  const double s12 = gamma(2, 1) - gamma(1, 0) * slope.y();
  const double s22 = gamma(2, 2) - gamma(2, 0) * slope.y();
  const ChannelDiagonal diagonal(s11, s12, s22);
  rotation = diagonal.rotation;
  prior_precision = diagonal.precision;
  prior_slope = rotation.to_channels(slope);
  tangent_start = rotation.to_channels(problem.position_m.tail<2>() / x_start);
  tangent_end = rotation.to_channels(problem.terminal_m / x_end);
  middle = 0.5 * (tangent_start + tangent_end);
  half_change = 0.5 * (tangent_start - tangent_end);
  offset = middle - prior_slope;
}

inline double ChannelProblem::critical_frequency(double hint) const {
  // v = 0 means cot(h) = -rho/h with h = xi/2, that is h = pi/2 + atan(rho/h). Newton on the difference,
  // whose slope is at least 1, converges for every rho.
  constexpr int kMaxSteps = 50;
  constexpr double kQuarterTurn = 0.5 * std::numbers::pi;
  const double rho = gain / prior_precision.maxCoeff();
  double h = hint > 0.0 ? 0.5 * hint : kQuarterTurn + std::atan(rho / kQuarterTurn);
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
