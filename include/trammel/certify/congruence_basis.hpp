// SPDX-License-Identifier: Apache-2.0
/// @file
/// Bases in which the matrix inequality of a certificate is well scaled. Nothing here needs to be exact.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// Directions that no ellipsoid bounds, up to rounding errors.
struct UnboundedDirections {
  Eigen::MatrixXd directions;  ///< p x k
  std::vector<Eigen::Index>
      coordinates;  ///< k parameters; direction j is 1 in coordinates[j], 0 in the others
};

/// Numerical null space of the stacked factors (q x p), independent of the scaling of rows and columns.
[[nodiscard]] UnboundedDirections find_unbounded_directions(const Eigen::MatrixXd& stacked);

/// Number of bases that congruence_basis offers.
inline constexpr int kCongruenceBases = 3;

/// Square p x p bases to be tried one after the other: number 0 is L itself where it is square and nothing is
/// unbounded, the next are L regularised by a prior that the bounds allow, scaled by 1e-6 and by 1e-3.
/// prior_factor: p x k; bounds: q x p of rank p, the stacked factors with the envelope; unbounded: p x n,
/// scaled as they shall enter. Empty where the basis does not exist.
[[nodiscard]] Eigen::MatrixXd congruence_basis(int number, const Eigen::MatrixXd& prior_factor,
                                               const Eigen::MatrixXd& bounds,
                                               const Eigen::MatrixXd& unbounded);

/// [L', N']: the prior with the unbounded directions as wide as the rounding errors of a_l N and of the lower
/// bound allow. The columns of N' span those of N, F N' orthogonal; L' is L without the columns that no bound
/// sees, and its measurements F L' are orthogonal to F N' (what L has beside is within N). prior_factor: p x
/// k; stacked: the a_l below one another; information_factor: m x p; unbounded: N, p x n.
[[nodiscard]] Eigen::MatrixXd extend_prior(const Eigen::MatrixXd& prior_factor,
                                           const Eigen::MatrixXd& stacked,
                                           const Eigen::MatrixXd& information_factor,
                                           const Eigen::MatrixXd& unbounded);

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/congruence_basis_impl.hpp"
#endif
