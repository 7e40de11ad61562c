// SPDX-License-Identifier: Apache-2.0
/// @file
/// The optimum when only the variance of x is weighted: one scalar equation with one root.
#pragma once

#include <cmath>
#include <limits>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/observer/closed_form.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

/// With beta = (beta_1, 0, 0) the spatial frequency of the optimum solves
///
///   q(xi) = xi F2(xi) = sigma L sqrt(beta_1) =: rhs,   0 <= xi < xi_1,
///   F2 = 1/g11 + L sum_i e_i^2 delta_i (L m^2 + delta_i n)/v_i^2 + 2 L |fd|^2 X(xi)/m^2,
///   m = sinc(xi/2),  n = (1 + sinc xi)/2,  v_i = delta_i cos(xi/2) + L m,  X = (xi - sin xi)/xi^3,
///
/// which equals (3.17) of Emelyanov and Rubinovich (2020) and is regular at 0 and pi.
///
/// Uniqueness: 1/Gamma_11 is the minimum over b of a convex quadratic q(phi), and
/// beta_1/q = max over p of 2 sqrt(beta_1) p - p^2 q. For fixed p = xi/(sigma L) the cost is strictly convex
/// in the path while xi < xi_1, so its minimum over paths is strictly concave in p, its derivative 2
/// sqrt(beta_1) - 2 p F2 strictly decreases, and its zero is a saddle point: the global optimum.
///
/// Symmetric start: if the weak channel has e_k = 0, F2 stays finite at xi_1 and may stay below the
/// right-hand side. Then xi = xi_1, the amplitude w_k is free and follows from F2(xi_1, w) = rhs/xi_1, a
/// quadratic; the two signs are mirror optima. Close to that case the same quadratic replaces the
/// ill-conditioned delta e/v.
struct SingleWeightRoot {
  PathShape shape;
  double critical = 0.0;
  int evaluations = 0;
};

namespace detail {

/// q(xi) and q'(xi).
struct SecularValue {
  double value = 0.0;
  double slope = 0.0;
};

inline SecularValue secular(const ChannelProblem& p, const Frequency& f) {
  const double m = f.sinc_half;
  const double n = f.half_power();
  const double m_slope = f.sinc_half_slope();
  const double n_slope = f.half_power_slope();
  const Eigen::Vector2d v = p.stiffness(f);
  double sum = 0.0;
  double sum_slope = 0.0;
  for (int i = 0; i < 2; ++i) {
    if (p.offset[i] == 0.0) {
      continue;
    }
    const double delta = p.prior_precision[i];
    const double inverse = 1.0 / v[i];
    const double scaled = p.offset[i] * inverse;
    const double weight = scaled * scaled * delta;
    const double top = p.gain * m * m + delta * n;
    const double v_slope = -0.5 * delta * f.sin_half + p.gain * m_slope;
    sum += weight * top;
    sum_slope += weight * (2.0 * p.gain * m * m_slope + delta * n_slope - 2.0 * top * v_slope * inverse);
  }
  const double change = p.half_change.squaredNorm();
  const double factor = p.prior_information + p.gain * (sum + 2.0 * change * f.cubic_remainder / (m * m));
  return {f.xi * factor,
          p.prior_information + p.gain * (sum + f.xi * sum_slope + change * f.tangent_slope())};
}

/// F2 of any wave amplitude at a given frequency, as coefficients of the square of t in w = fixed + t
/// direction.
struct AmplitudeQuadratic {
  double constant = 0.0;
  double linear = 0.0;
  double square = 0.0;
};

inline AmplitudeQuadratic amplitude_quadratic(const ChannelProblem& p, const Frequency& f,
                                              const Eigen::Vector2d& fixed,
                                              const Eigen::Vector2d& direction) {
  const double n = f.half_power();
  AmplitudeQuadratic quadratic;
  quadratic.constant = p.prior_information + 2.0 * p.gain * p.half_change.squaredNorm() * f.cubic_remainder /
                                                 (f.sinc_half * f.sinc_half);
  for (int i = 0; i < 2; ++i) {
    const double delta = p.prior_precision[i];
    const double rest = p.offset[i] - f.cos_half * fixed[i];
    const double turn = f.cos_half * direction[i];
    quadratic.constant += delta * rest * rest + p.gain * n * fixed[i] * fixed[i];
    quadratic.linear += 2.0 * (p.gain * n * fixed[i] * direction[i] - delta * rest * turn);
    quadratic.square += delta * turn * turn + p.gain * n * direction[i] * direction[i];
  }
  return quadratic;
}

/// Larger root of quadratic(t) = level; 0 when the quadratic stays above it.
inline double larger_root(const AmplitudeQuadratic& quadratic, double level) {
  const double constant = quadratic.constant - level;
  const double half = 0.5 * quadratic.linear;
  const double discriminant = half * half - quadratic.square * constant;
  if (!(discriminant > 0.0)) {
    return 0.0;
  }
  const double root = std::sqrt(discriminant);
  return half <= 0.0 ? (root - half) / quadratic.square : -constant / (half + root);
}

/// Below this part of delta + L, v has lost the digits that delta e/v would need: it cancels, and near 2 pi
/// the rounding of xi alone moves L sinc(xi/2).
inline constexpr double kSingularStiffness = 1e-7;

/// Wave amplitude at the root; where v vanishes, from the quadratic F2(xi, w) = rhs/xi.
inline Eigen::Vector2d wave_at_root(const ChannelProblem& p, const Frequency& f, double right_hand_side) {
  const Eigen::Vector2d v = p.stiffness(f);
  Eigen::Vector2d fixed = Eigen::Vector2d::Zero();
  Eigen::Vector2d direction = Eigen::Vector2d::Zero();
  bool singular = false;
  for (int i = 0; i < 2; ++i) {
    const double force = p.prior_precision[i] * p.offset[i];
    const double scale = p.prior_precision[i] + p.gain;
    if (v[i] >= kSingularStiffness * scale) {
      fixed[i] = force / v[i];
    } else {
      singular = true;
      // Channels of equal delta share v: the direction is that of e. The floor keeps rounding from deciding.
      direction[i] = force / std::fmax(v[i], std::numeric_limits<double>::epsilon() * scale);
    }
  }
  if (!singular) {
    return fixed;
  }
  const double length = direction.norm();
  if (length > 0.0) {
    direction /= length;
  } else {
    direction[p.weak_channel()] = 1.0;
  }
  const double amplitude = larger_root(amplitude_quadratic(p, f, fixed, direction), right_hand_side / f.xi);
  return fixed + amplitude * direction;
}

}  // namespace detail

/// Finds the root for `beta` >= 0. Newton's method on 1/sqrt(q), which the double pole at xi_1 makes nearly
/// linear, inside a bracket; every problem converges (at most about 60 evaluations, typically 4 to 6).
/// `hint`: the solution of a similar problem (the previous plan of a flight), which saves some of them.
inline SingleWeightRoot solve_single_weight(const ChannelProblem& problem, double beta,
                                            const SingleWeightRoot& hint = {}) {
  // Residual below which the next step would be rounding.
  constexpr double kResidual = 4e-15;
  constexpr int kMaxEvaluations = 200;
  SingleWeightRoot root;
  root.critical = problem.critical_frequency(hint.critical);
  const double right_hand_side = problem.sigma * problem.gain * std::sqrt(beta);
  if (right_hand_side > 0.0) {
    double low = 0.0;
    double high = root.critical;
    double x = hint.shape.xi;
    if (!(x > 0.0 && x < high)) {
      const double slope_at_zero = detail::secular(problem, Frequency(0.0)).slope;
      x = std::fmin(right_hand_side / slope_at_zero, 0.5 * root.critical);
    }
    for (root.evaluations = 1; root.evaluations <= kMaxEvaluations; ++root.evaluations) {
      const detail::SecularValue q = detail::secular(problem, Frequency(x));
      const double ratio = q.value / right_hand_side;
      if (std::abs(ratio - 1.0) < kResidual) {
        break;
      }
      if (ratio < 1.0) {
        low = x;
      } else {
        high = x;
      }
      double next = x + 2.0 * q.value * (1.0 - std::sqrt(ratio)) / q.slope;
      if (!(next > low && next < high)) {
        next = low + 0.5 * (high - low);
        if (!(next > low && next < high)) {
          break;
        }
      }
      x = next;
    }
    root.shape.xi = x;
  }
  root.shape.wave = detail::wave_at_root(problem, Frequency(root.shape.xi), right_hand_side);
  return root;
}

}  // namespace trammel::inline TRAMMEL_ABI::observer
