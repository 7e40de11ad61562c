// SPDX-License-Identifier: Apache-2.0
/// @file
/// A guaranteed problem whose ellipsoids confine disjoint blocks of parameters, scaled to unit balls.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// theta = scaling z, the set is {|z_l| <= 1 for every block l}, z_free unlimited.
///
/// | symbol | member             | shape | meaning                                                       |
/// |--------|--------------------|-------|---------------------------------------------------------------|
/// | -      | scaling            | p x p | back to the problem's coordinates                              |
/// | -      | inverse            | p x p | z = inverse theta                                             |
/// | J      | information        | p x p | information matrix of z                                       |
/// | C      | output             | c x p | a factor of the criterion of z, S = C'C, c <= p                |
/// | V      | prior              | p x p | least favourable second moments of z, tr V_ll <= 1             |
/// | -      | offset             | s + 1 | block l holds coordinates offset[l] .. offset[l + 1] - 1        |
///
/// Coordinates from offset[s] on are free: no ellipsoid confines them.
struct UnitBalls {
  Eigen::MatrixXd scaling;
  Eigen::MatrixXd inverse;
  Eigen::MatrixXd information;
  Eigen::MatrixXd output;
  Eigen::MatrixXd prior;
  std::vector<Eigen::Index> offset;

  [[nodiscard]] Eigen::Index size() const { return information.rows(); }
  [[nodiscard]] Eigen::Index blocks() const { return static_cast<Eigen::Index>(offset.size()) - 1; }
  [[nodiscard]] Eigen::Index block_size(Eigen::Index l) const {
    const auto index = static_cast<std::size_t>(l);
    return offset[index + 1] - offset[index];
  }
  [[nodiscard]] Eigen::Index begin(Eigen::Index l) const { return offset[static_cast<std::size_t>(l)]; }
};

/// Coordinates in which the ellipsoids are balls of disjoint blocks: the factors reduced to full rank and
/// stacked are these coordinates. They exist exactly if the stacked factors have full row rank; absent
/// otherwise (ellipsoids that confine the same combination of parameters).
/// prior_factor: p x k, V = L L' in the problem's coordinates.
[[nodiscard]] std::optional<UnitBalls> find_unit_balls(const GuaranteedProblem& problem,
                                                       const Eigen::MatrixXd& prior_factor);

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/block_structure_impl.hpp"
#endif
