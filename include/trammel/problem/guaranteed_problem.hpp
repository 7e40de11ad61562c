// SPDX-License-Identifier: Apache-2.0
/// @file
/// The guaranteed (minimax) linear estimation problem as plain data.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// Estimate w = C theta from y = F theta + e, E e = 0, cov e = I, where theta is unknown but
/// |a_l theta| <= 1 for l = 1..s: find the linear estimator whose worst mean-square error is smallest,
///
///   min over K, lambda >= 0 of  |C K F'|_F^2 + sum lambda
///   subject to  sum_l lambda_l a_l' a_l  >=  (K F'F - I)' C'C (K F'F - I)        (semidefinite order).
///
/// | symbol | field              | shape      | meaning                                                   |
/// |--------|--------------------|------------|-----------------------------------------------------------|
/// | F      | information_factor | any x p    | whitened design rows, or any factor of J = F'F            |
/// | C      | criterion_factor   | any x p    | any factor of S = C'C; the units of the error             |
/// | a_l    | ellipsoids[l]      | any x p    | bound l; H_l = a_l'a_l may leave directions unbounded     |
///
/// Factors, not products: squaring would lose what is small beside something large. F may have no rows (no
/// measurement) or less than full rank.
/// Source: the guaranteed estimation of a manoeuvring trajectory as a semidefinite programme (README,
/// Sources).
struct GuaranteedProblem {
  Eigen::MatrixXd information_factor;
  Eigen::MatrixXd criterion_factor;
  std::vector<Eigen::MatrixXd> ellipsoids;

  /// Number of parameters p.
  [[nodiscard]] Eigen::Index parameters() const { return criterion_factor.cols(); }
};

}  // namespace trammel::inline TRAMMEL_ABI
