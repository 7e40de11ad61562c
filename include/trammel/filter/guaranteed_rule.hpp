// SPDX-License-Identifier: Apache-2.0
/// @file
/// Gains that minimise the guaranteed (worst-case) mean-square error under a bound on the manoeuvre.
#pragma once

#include <limits>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/filter/worst_case.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

/// Class of manoeuvres the guarantee covers.
enum class Manoeuvre {
  kArbitrary,          ///< any measurable |x^(v)(t)| <= omega: the rigorous choice
  kPiecewiseConstant,  ///< constant between samples
  kConstant,           ///< constant for ever
};

/// Filters to choose from.
enum class GainFamily {
  kFree,              ///< all stable gains
  kCriticallyDamped,  ///< all poles equal
  kKalata,            ///< kalata's curve, order 2 or 3
  kBenedictBordner,   ///< beta = alpha^2/(2 - alpha), order 2
};

/// What to choose gains for.
struct GuaranteedGoal {
  int order = 2;        ///< v, 1 to 3
  double index = 1.0;   ///< Lambda = omega T^v / sigma: bound on |x^(v)|, measurement standard deviation
  FilterOutput output;  ///< whose error counts; units of T = 1 for rows above 0
  Manoeuvre manoeuvre = Manoeuvre::kArbitrary;
  GainFamily family = GainFamily::kFree;
};

/// The choice and what it guarantees, in units of sigma^2 (T = 1).
struct GuaranteedGains {
  Eigen::VectorXd gains;
  double mean_square_error = std::numeric_limits<double>::quiet_NaN();  ///< Lambda^2 B^2 + noise gain
  double bias = std::numeric_limits<double>::quiet_NaN();  ///< B: largest |error| per unit of omega T^v
  double noise_gain = std::numeric_limits<double>::quiet_NaN();
};

/// Minimises J = Lambda^2 B^2 + rho over the gains: the largest mean-square error, because the noise does
/// not depend on the manoeuvre, so the largest of the sum is the sum of largest squared bias and variance.
///
/// Method: closed forms where they exist (order 1; constant manoeuvre: the prediction of any order, the
/// estimate of order 2), a search in the logarithms of the gains otherwise, from the best members of the
/// critically damped and the least-noise family. Guarantee: J is what the returned gains really have; that no
/// other gains do better is checked from several starts, not proved. Accuracy: J to about 1e-12, gains to
/// about 1e-6 (J is flat there). Cost: some thousand kernels.
/// Throws Error for an order outside 1 to 3, an index that is not positive, a row beyond the order, a
/// family that has no member of this order.
[[nodiscard]] GuaranteedGains guaranteed_gains(const GuaranteedGoal& goal);

/// J, B and rho of given gains; J infinite if the filter is unstable.
[[nodiscard]] GuaranteedGains guaranteed_error(const GuaranteedGoal& goal, const Eigen::VectorXd& gains);

}  // namespace trammel::inline TRAMMEL_ABI::filter

#ifndef TRAMMEL_COMPILED
#include "trammel/filter/guaranteed_rule_impl.hpp"
#endif
