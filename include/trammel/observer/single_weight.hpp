// SPDX-License-Identifier: Apache-2.0
/// @file
/// The optimum when only the variance of x is weighted: one scalar equation with one root.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>

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
template <class Real>
struct SecularValue {
  Real value;
  Real slope;
};

template <class Real>
[[nodiscard, gnu::always_inline]] inline SecularValue<Real> secular(const BasicChannelProblem<Real>& p,
                                                                    const BasicFrequency<Real>& f) {
  const Real m = f.sinc_half;
  const Real n = f.half_power();
  const Real m_slope = f.sinc_half_slope();
  const Real n_slope = f.half_power_slope();
  const Vector2<Real> v = p.stiffness(f);
  Real sum = 0.0;
  Real sum_slope = 0.0;
  for (int i = 0; i < 2; ++i) {
    const Real delta = p.prior_precision[i];
    // A channel without offset adds nothing, not even where v vanishes.
    const MaskOf<Real> still = p.offset[i] == 0.0;
    const Real inverse = 1.0 / select(still, Real(1.0), v[i]);
    const Real scaled = p.offset[i] * inverse;
    const Real weight = scaled * scaled * delta;
    const Real top = p.gain * m * m + delta * n;
    const Real v_slope = -0.5 * delta * f.sin_half + p.gain * m_slope;
    sum += weight * top;
    sum_slope += weight * (2.0 * p.gain * m * m_slope + delta * n_slope - 2.0 * top * v_slope * inverse);
  }
  const Real change = p.half_change.squaredNorm();
  const Real factor =
      p.prior_information + p.gain * (sum + 2.0 * change * f.cubic_remainder * f.inverse_square);
  return {f.xi * factor,
          p.prior_information + p.gain * (sum + f.xi * sum_slope + change * f.tangent_slope())};
}

/// F2 of any wave amplitude at a given frequency, as coefficients of the square of t in w = fixed + t
/// direction.
template <class Real>
struct AmplitudeQuadratic {
  Real constant = 0.0;
  Real linear = 0.0;
  Real square = 0.0;
};

template <class Real>
[[nodiscard]] AmplitudeQuadratic<Real> amplitude_quadratic(const BasicChannelProblem<Real>& p,
                                                           const BasicFrequency<Real>& f,
                                                           const Vector2<Real>& fixed,
                                                           const Vector2<Real>& direction) {
  const Real n = f.half_power();
  AmplitudeQuadratic<Real> quadratic;
  quadratic.constant =
      p.prior_information + 2.0 * p.gain * p.half_change.squaredNorm() * f.cubic_remainder * f.inverse_square;
  for (int i = 0; i < 2; ++i) {
    const Real delta = p.prior_precision[i];
    const Real rest = p.offset[i] - f.cos_half * fixed[i];
    const Real turn = f.cos_half * direction[i];
    quadratic.constant += delta * rest * rest + p.gain * n * fixed[i] * fixed[i];
    quadratic.linear += 2.0 * (p.gain * n * fixed[i] * direction[i] - delta * rest * turn);
    quadratic.square += delta * turn * turn + p.gain * n * direction[i] * direction[i];
  }
  return quadratic;
}

/// Larger root of quadratic(t) = level; 0 when the quadratic stays above it.
template <class Real>
[[nodiscard]] Real larger_root(const AmplitudeQuadratic<Real>& quadratic, const Real& level) {
  using std::sqrt;
  const Real constant = quadratic.constant - level;
  const Real half = 0.5 * quadratic.linear;
  const Real discriminant = half * half - quadratic.square * constant;
  const MaskOf<Real> crossed = discriminant > 0.0;
  const Real root = sqrt(select(crossed, discriminant, Real(1.0)));
  return select(crossed, select(half <= 0.0, (root - half) / quadratic.square, -constant / (half + root)),
                Real(0.0));
}

/// Below this part of delta + L, v has lost the digits that delta e/v would need: it cancels, and near 2 pi
/// the rounding of xi alone moves L sinc(xi/2).
inline constexpr double kSingularStiffness = 1e-7;

/// Wave amplitude at the root; where v vanishes, from the quadratic F2(xi, w) = rhs/xi.
template <class Real>
[[nodiscard]] Vector2<Real> wave_at_root(const BasicChannelProblem<Real>& p, const BasicFrequency<Real>& f,
                                         const Real& right_hand_side) {
  using std::sqrt;
  const Vector2<Real> v = p.stiffness(f);
  Vector2<Real> fixed;
  Vector2<Real> direction;
  MaskOf<Real> singular = f.xi < 0.0;  // none
  for (int i = 0; i < 2; ++i) {
    const Real force = p.prior_precision[i] * p.offset[i];
    const Real scale = p.prior_precision[i] + p.gain;
    const MaskOf<Real> stiff = v[i] >= kSingularStiffness * scale;
    // Channels of equal delta share v: the direction is that of e. The floor keeps rounding from deciding.
    const Real floor = std::numeric_limits<double>::epsilon() * scale;
    const Real share = force / select(stiff, v[i], select(v[i] > floor, v[i], floor));
    fixed[i] = select(stiff, share, Real(0.0));
    direction[i] = select(stiff, Real(0.0), share);
    singular = singular || !stiff;
  }
  if (!any(singular)) {
    return fixed;
  }
  const Real length = sqrt(direction.squaredNorm());
  const MaskOf<Real> pulled = length > 0.0;
  const MaskOf<Real> first = p.first_is_weak();
  direction << select(pulled, direction.x() / length, select(first, Real(1.0), Real(0.0))),
      select(pulled, direction.y() / length, select(first, Real(0.0), Real(1.0)));
  const Real amplitude = larger_root(amplitude_quadratic(p, f, fixed, direction), right_hand_side / f.xi);
  for (int i = 0; i < 2; ++i) {
    fixed[i] += select(singular, amplitude * direction[i], Real(0.0));
  }
  return fixed;
}

/// Root of the secular equation.
template <class Real>
struct SecularRoot {
  Real xi;
  int evaluations;
};

/// Newton's method from `start` inside the bracket from 0 to `limit` >= xi_1, on 1/sqrt(q), which the double
/// pole at xi_1 makes nearly linear, or on q where it rises slowly; the step from where |q/rhs - 1| <
/// `settled` is the last. Every problem converges (at most about 60 evaluations, typically 4 to 6).
template <class Real>
[[nodiscard]] SecularRoot<Real> secular_root(const BasicChannelProblem<Real>& problem,
                                             const Real& right_hand_side, const Real& start,
                                             const Real& limit, double settled) {
  using std::abs;
  using std::sqrt;
  constexpr int kMaxEvaluations = 200;
  constexpr double kSteep = 2.0;  // slope in logarithms; 1 for small xi
  MaskOf<Real> moving = right_hand_side > 0.0;
  const Real level = select(moving, right_hand_side, Real(1.0));
  const Real inverse_level = 1.0 / level;
  const Real none = 0.0;
  SecularRoot<Real> root{select(moving, start, none), 0};
  Real low = 0.0;
  Real high = limit;
  while (any(moving) && root.evaluations < kMaxEvaluations) {
    ++root.evaluations;
    const BasicFrequency<Real> f(root.xi);
    const SecularValue<Real> q = secular(problem, f);
    const Vector2<Real> v = problem.stiffness(f);
    const Real ratio = q.value * inverse_level;
    const MaskOf<Real> inside = v.x() > 0.0 && v.y() > 0.0;  // else beyond xi_1
    const MaskOf<Real> below = inside && ratio < 1.0;
    low = select(below, root.xi, low);
    high = select(below, high, root.xi);
    const MaskOf<Real> steep = root.xi * q.slope > kSteep * q.value;
    const Real change =
        select(steep, 2.0 * q.value * (1.0 - sqrt(ratio)), right_hand_side - q.value) / q.slope;
    const Real newton = root.xi + change;
    const MaskOf<Real> near = inside && abs(ratio - 1.0) < settled;
    // Where rounding leads the last step out of the bracket, x is the root.
    const Real middle = select(near, root.xi, low + 0.5 * (high - low));
    const Real next = select(inside && newton > low && newton < high, newton, middle);
    const MaskOf<Real> between = next > low && next < high;
    root.xi = select(moving && between, next, root.xi);
    moving = moving && between && !near;
  }
  return root;
}

}  // namespace detail

/// Finds the root for `beta` >= 0 to rounding.
inline SingleWeightRoot solve_single_weight(const ChannelProblem& problem, double beta) {
  // Residual below which the next step would be rounding.
  constexpr double kResidual = 4e-15;
  SingleWeightRoot root;
  root.critical = problem.critical_frequency();
  const double right_hand_side = problem.sigma * problem.gain * std::sqrt(beta);
  const double slope_at_zero = detail::secular(problem, Frequency(0.0)).slope;
  const double start = std::fmin(right_hand_side / slope_at_zero, 0.5 * root.critical);
  const detail::SecularRoot<double> found =
      detail::secular_root(problem, right_hand_side, start, root.critical, kResidual);
  root.evaluations = found.evaluations;
  root.shape.xi = found.xi;
  root.shape.wave = detail::wave_at_root(problem, Frequency(found.xi), right_hand_side);
  return root;
}

/// The shape for `beta` >= 0 from the frequency of a similar problem, like that of the plan before in a
/// flight: positive if beta is.
template <class Real>
[[nodiscard]] BasicPathShape<Real> follow_single_weight(const BasicChannelProblem<Real>& problem, double beta,
                                                        const Real& similar_xi) {
  // Newton's last step squares it and leaves less than 1e-7 of xi, next to which no flight differs visibly.
  constexpr double kSettled = 3e-4;
  const Real right_hand_side = problem.sigma * std::sqrt(beta) * problem.gain;
  BasicPathShape<Real> shape;
  shape.xi =
      detail::secular_root(problem, right_hand_side, similar_xi, Real(2.0 * std::numbers::pi), kSettled).xi;
  shape.wave = detail::wave_at_root(problem, BasicFrequency<Real>(shape.xi), right_hand_side);
  return shape;
}

}  // namespace trammel::inline TRAMMEL_ABI::observer
