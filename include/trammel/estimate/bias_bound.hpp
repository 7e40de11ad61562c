// SPDX-License-Identifier: Apache-2.0
/// @file
/// Largest bias of a linear estimate in three dimensions, within bounds on disjoint blocks.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

/// Proved bound of a squared bias, m^2.
struct BiasBound {
  double upper = std::numeric_limits<double>::quiet_NaN();  ///< proved
  double lower = std::numeric_limits<double>::quiet_NaN();  ///< of the best possible `upper`
  Eigen::VectorXd multipliers;  ///< sum is `upper`; sum_l lambda_l |u_l|^2 >= |sum_l G_l u_l|^2 for all u
  int iterations = 0;
};

/// Bounds max |sum_l G_l u_l|^2 over |u_l| <= 1, G_l of three rows:
///
///   min { sum lambda : sum_l lambda_l |u_l|^2 >= |sum_l G_l u_l|^2 for all u }
///     = min over the simplex tau of  lambda_max( sum_l G_l G_l' / tau_l )          (Schur complement)
///     = max over rho >= 0, tr rho = 1 of  ( sum_l <rho, G_l G_l'>^(1/2) )^2        (minimax theorem)
///
/// | symbol | meaning                                            | shape |
/// |--------|----------------------------------------------------|-------|
/// | G_l    | bias per unit of block l, over its semi-axes       | 3 x k |
/// | tau    | share of each bound, lambda = tau upper            | s     |
/// | rho    | weight of the directions in space                  | 3 x 3 |
///
/// Method: with rho = R R' the second form is a convex function of R on a sphere, which R <- gradient
/// increases at each step (generalised power method: Journee, Nesterov, Richtarik, Sepulchre 2010, algorithm
/// 1); tau_l proportional to <rho, G_l G_l'>^(1/2). Guarantee: `upper` holds for whatever tau was reached, up
/// to rounding. It is the largest mean square over random u with E |u_l|^2 <= 1, the class the guaranteed
/// estimate is made for; over fixed u it is attained in one dimension and may be above the maximum in three.
/// Cost: O(s) per step.
[[nodiscard]] inline BiasBound bound_bias(const std::vector<Eigen::Matrix3Xd>& blocks) {
  constexpr double kRelativeGap = 1e-9;
  constexpr int kMaxIterations = 1000;  // the value is proved wherever the iteration stops
  const auto count = static_cast<Eigen::Index>(blocks.size());
  BiasBound result;
  result.multipliers = Eigen::VectorXd::Zero(count);
  std::vector<Eigen::Matrix3d> square;
  double total = 0.0;
  for (const Eigen::Matrix3Xd& block : blocks) {
    square.emplace_back(block * block.transpose());
    total += square.back().trace();
  }
  if (!(total > 0.0)) {
    result.upper = result.lower = total;  // 0, or NaN when there was one
    return result;
  }
  // A share of the bound no smaller than rounding, so that no block with a bias is left without one.
  const double floor = std::numeric_limits<double>::epsilon() * std::sqrt(total);
  Eigen::Matrix3d rho = Eigen::Matrix3d::Identity() / 3.0;
  result.upper = std::numeric_limits<double>::infinity();
  result.lower = 0.0;
  for (; result.iterations < kMaxIterations; ++result.iterations) {
    Eigen::VectorXd share = Eigen::VectorXd::Zero(count);
    Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();
    double value = 0.0;
    for (Eigen::Index l = 0; l < count; ++l) {
      const Eigen::Matrix3d& m = square[static_cast<std::size_t>(l)];
      if (m.trace() > 0.0) {
        const double size = std::sqrt(std::max(rho.cwiseProduct(m).sum(), 0.0));
        value += size;
        share(l) = std::max(size, floor);
        gradient += m / share(l);
      }
    }
    const linalg::SymmetricEigen3 eigen(gradient, Eigen::EigenvaluesOnly);
    const double upper = share.sum() * eigen.eigenvalues()(2);
    result.lower = std::max(result.lower, value * value);
    if (upper < result.upper) {
      result.upper = upper;
      result.multipliers = share * eigen.eigenvalues()(2);
    }
    if (result.upper - result.lower <= kRelativeGap * result.upper) {
      break;
    }
    rho = gradient * rho * gradient;
    rho = 0.5 * (rho + rho.transpose()).eval() / rho.trace();
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::estimate
