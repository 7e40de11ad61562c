// SPDX-License-Identifier: Apache-2.0
/// @file
/// Rules that choose the gains of an invariant filter with k = v rows.
///
/// All functions return dimensionless gains kappa_i, i = 0..v-1 (kappa_0 = alpha, kappa_1 = beta,
/// kappa_2 = gamma): the correction of row i is kappa_i / (i! T^i) times the innovation. Other conventions:
/// the g-h-k filter (Brookner 1998) has acceleration gain 2 k / T^2, so k = gamma / 4; authors who write
/// gamma / T^2 have half of this gamma. Wrong arguments throw Error.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/filter/polynomial.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

/// Gains that put the poles of the filter at given places: real ones and conjugate pairs, in z.
[[nodiscard]] Eigen::VectorXd pole_placement(const Eigen::VectorXcd& poles);

/// Critically damped filter, all poles at theta in [0, 1): the steady state of least squares with weight
/// theta^m for the sample m steps back (fading memory; Morrison 1969). v = 2: 1 - theta^2, (1 - theta)^2.
[[nodiscard]] Eigen::VectorXd fading_memory(int order, double theta);

/// Gains of the n-th sample (n = 1, 2, ...) of least squares over all samples so far with equal weights, for
/// starting a filter up: from n = v on the estimate does not depend on the initial state, and before that
/// the formula goes on. v = 2: kappa = 2(2n-1)/(n(n+1)), 6/(n(n+1)). Sums of the discrete Legendre
/// polynomials at their end point, all terms positive from n = v on.
[[nodiscard]] Eigen::VectorXd expanding_memory(int order, int samples);

/// The same with weight theta^m for the sample m steps back, 0 < theta <= 1: grows into fading_memory. For
/// n < v the gains of order n, zeros above.
[[nodiscard]] Eigen::VectorXd finite_fading_memory(int order, int samples, double theta);

/// Steady-state filter for random manoeuvres, closed forms (Kalata 1984). tracking_index is
/// Lambda = sigma_w T^2 / sigma, sigma_w a standard deviation of acceleration, sigma that of the measurement:
/// order 1: position noise w T^2/2; order 2: acceleration constant within each interval and independent;
/// order 3: independent increments of acceleration, s^3 + (Lambda/2 - 3) s^2 + (Lambda/2 + 3) s = 1.
[[nodiscard]] Eigen::VectorXd kalata(int order, double tracking_index);

/// Random manoeuvre of the steady-state Kalman filter of any order, for T = 1 and unit measurement variance.
enum class ProcessNoise {
  kDiscrete,    ///< x^(v) constant within each interval, independent: gain vector [1/v!, ..., 1/2, 1]
  kContinuous,  ///< x^(v) continuous white noise
  kIncrements,  ///< x^(v-1) jumps once per interval: gain vector [1/(v-1)!, ..., 1, 1]
};

/// Steady-state Kalman gains through the Riccati equation (structured doubling; Chu, Fan, Lin, Wang 2004).
/// tracking_index, dimensionless: kDiscrete sigma_w T^v / sigma, kContinuous sqrt(q_c T^(2v-1)) / sigma,
/// kIncrements sigma_w T^(v-1) / sigma; sigma_w (q_c) standard deviation (spectral density) of the noise.
[[nodiscard]] Eigen::VectorXd kalman(int order, ProcessNoise noise, double tracking_index);

/// The same for any covariance of the process noise per interval: state (x, T x', T^2 x'', ...), units of
/// the measurement variance. `process_noise` v x v, symmetric, positive semidefinite, not zero.
[[nodiscard]] Eigen::VectorXd kalman(const Eigen::MatrixXd& process_noise);

/// Covariance of kalman's process noise for state (x, T x', ...), T = 1, tracking index 1.
[[nodiscard]] Eigen::MatrixXd process_noise_covariance(int order, ProcessNoise noise);

/// beta = alpha^2 / (2 - alpha) (Benedict and Bordner 1962): least noise of the prediction for a given sum of
/// squares of the transient after a step of velocity. 0 < alpha <= 1.
[[nodiscard]] Eigen::VectorXd benedict_bordner(double alpha);

/// The same chosen by the index Lambda_v = sigma_dv T / sigma = beta / sqrt(1 - alpha), sigma_dv the standard
/// deviation of independent steps of velocity, for which it is the Kalman filter.
[[nodiscard]] Eigen::VectorXd benedict_bordner_from_index(double index);

/// Least noise of the prediction for a given steady prediction error (T/b)^v per unit x^(v), 0 < b < 2:
/// P_0 = 1, P_(v+1) = (1 - q) P_v + (b/2) q (P_v + q^v P_v(1/q)); the noise gain is (1 - b/2)^-v - 1.
[[nodiscard]] Eigen::VectorXd minimum_noise_prediction(int order, double b);

/// Least noise of the estimate for a given steady error `lag` T^v per unit x^(v), lag > 0 (order 1 also 0:
/// alpha = 1). With t = 1/(1 + 2 lag^(1/v)):
/// P_0 = 1, P_(v+1) = (1 - q) P_v + t (q P_v + q^v P_v(1/q)), scaled to P(0) = 1; the noise gain is
/// 1 - (1 - t)^v. Order 1: alpha = 1/(1 + lag). Order 2: alpha = 2t/(1 + t^2), beta = 4t^2/(1 + t^2).
/// Found like the recursion for the prediction; lag and noise gain agree with it to rounding for all orders
/// tried (1 to 7), and a search over the gains found no less noise for orders 3 and 4.
[[nodiscard]] Eigen::VectorXd minimum_noise_estimate(int order, double lag);

}  // namespace trammel::inline TRAMMEL_ABI::filter

#ifndef TRAMMEL_COMPILED
#include "trammel/filter/rules_impl.hpp"
#endif
