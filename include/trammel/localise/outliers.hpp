// SPDX-License-Identifier: Apache-2.0
/// @file
/// Measurements that no motion within the bounds explains.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/localise/levenberg_marquardt.hpp"
#include "trammel/localise/stated_value.hpp"
#include "trammel/problem/scenario.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

/// Settings of find_outliers.
struct OutlierSettings {
  /// Probability, over normal noise, that a sound measurement is rejected, for all of them together; between
  /// 0 and 1.
  double false_alarm = 1e-3;
  std::optional<double> minimum_height_m = {};  ///< the path stays above it
  ModelError model_error = {};
  FitSettings fit = {};
  Minimiser minimise = fit_levenberg_marquardt;  ///< makes all fits
  int max_rounds = 20;                           ///< of prediction and decision
};

/// A measurement that was rejected, and why.
struct RejectedMeasurement {
  std::size_t observation = 0;  ///< index into Scenario::observations
  std::size_t station = 0;
  double t_s = 0.0;
  Eigen::VectorXd residual;  ///< observed minus predicted from the others, per component, in its unit
  Eigen::VectorXd allowed;   ///< what a motion within the bounds and sound noise can make of it
};

/// Result of find_outliers.
struct OutlierSearch {
  std::vector<RejectedMeasurement> rejected;  ///< by observation
  double false_alarm = 0.0;                   ///< as asked for
  std::size_t tested = 0;                     ///< measurements with a worst case to compare with
  /// Noise allowed, in standard deviations of each component's prediction residual. Sound noise of any
  /// distribution exceeds it with a probability of at most 1/quantile^2 for each component (Chebyshev).
  double quantile = std::numeric_limits<double>::quiet_NaN();
  int rounds = 0;
  bool settled = false;  ///< no decision changed in the last round
};

/// Rejects the observations that no motion within the bounds makes likely, given the others.
///
/// Each component c of measurement k is compared with its prediction from the accepted measurements without
/// k. With everything linearised about a fit z_r to the accepted ones, J the sum of their A_j'A_j (without
/// k),
///
///   G = sum_l a_l'a_l,  H = 3 G + J,  Y = A_k H^-1,
///   residual = y_k - prediction = L_k (v_k + noise),   v_k = 3 Y G z* ,   noise covariance I + Y J Y',
///   allowed  = 3 sum_l |(L_k Y a_l')_c| + q ((L_k (I + Y J Y') L_k')_cc)^(1/2)
///              + Delta_kc + ((L_k Y J Y' L_k')_cc)^(1/2) |Delta|.
///
/// | symbol | meaning                                                                            |
/// |--------|------------------------------------------------------------------------------------|
/// | A, a_l | as in FitProblem; L_k the lower Cholesky factor of the measurement's covariance    |
/// | z*     | the true deviation, |a_l z*| <= 1: the first term is its worst case, attained      |
/// | q      | 2 Q(q) = false_alarm / (number of components): Gaussian tail, union bound          |
/// | Delta  | remainders (bound_remainder at 3^(1/4) times the tube of this estimator) and model |
/// |        | error of measurement k, and of the accepted ones together, whitened                |
///
/// So the bounds decide, not a model that was fitted: a rejected measurement is at odds with every motion
/// within the bounds that the accepted ones allow. Measurements whose remainder is not bounded are accepted.
///
/// Several outliers at once would hide one another: the first accepted set comes from a fit with truncated
/// squares, approached through a sequence of smoother costs (graduated non-convexity: Yang, Antonante,
/// Tzoumas, Carlone 2020, eq. (14) and remark 5). Then rounds of prediction and decision follow, in which
/// measurements also come back, until nothing changes.
///
/// Proved: for the linearised measurements, Gaussian noise, and a set of accepted measurements that does not
/// depend on the noise of the one tested. Not proved: that the first set is free of outliers; where more than
/// about half of the measurements of a stretch are wrong the wrong ones may win.
/// Cost: some dozens of constrained fits; O(n p^2) per round.
/// Throws Error as FitProblem does, and for settings out of range.
[[nodiscard]] OutlierSearch find_outliers(const Scenario& scenario, const OutlierSettings& settings = {});

/// The scenario without what was rejected.
[[nodiscard]] Scenario without(Scenario scenario, const OutlierSearch& outliers);

}  // namespace trammel::inline TRAMMEL_ABI::localise

#ifndef TRAMMEL_COMPILED
#include "trammel/localise/outliers_impl.hpp"
#endif
