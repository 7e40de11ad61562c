// SPDX-License-Identifier: Apache-2.0
/// @file
/// Best weighted van Trees constants of the interval and of the ball.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// Information that the best prior on [-width, width] adds to a coordinate measured with information a:
/// D = mu^2 - a, where m = mu/sqrt(a) > 1 solves
///
///   sqrt(a) width = 2 m/sqrt(m^2 - 1) arctan sqrt((m + 1)/(m - 1)) - pi/2
///
/// (the minimum of int sqrt(a h^2 + h'^2) over densities h on the interval: weighted van Trees inequality of
/// Borovkov and Sakhanenko, 1980). Between 1/width^2 (a = 0) and pi^2/width^2 (a infinite); rounded up.
[[nodiscard]] double interval_information(double information, double width);

/// One prior on the unit ball of dimension d: with a scalar information a per axis the bound is that of
/// D = (tau - 1) J + k I.
struct BallPrior {
  double tau = 1.0;
  double k = 0.0;
};

/// Priors for informations from 0.01 to 1000 and infinite (tau = 1, Bessel ground state, k = 4 j^2/d with j
/// the first zero of the Bessel function of order d/2 - 1). For the others s(r), r in [0, 1], solves
///
///   s' = sqrt(d) (mu - sqrt(a (1 - s^2))) - (d - 1) s/r,   s(0) = 0, s(1) = 1,
///
/// and tau = mu/sqrt(a) int h cos / int h, k = mu^2 - a tau, with h'/h = -sqrt(d a) s/sqrt(1 - s^2),
/// cos = sqrt(1 - s^2); k is rounded up by 3e-4 mu^2, more than the error of the quadrature.
[[nodiscard]] std::vector<BallPrior> ball_priors(Eigen::Index dimension);

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/scalar_priors_impl.hpp"
#endif
