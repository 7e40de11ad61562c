// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of prior_state.hpp.
#pragma once

#include "trammel/minimax/prior_state.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

TRAMMEL_INLINE void per_row(const Eigen::VectorXd& per_ellipsoid, const std::vector<Eigen::Index>& first_row,
                            Eigen::VectorXd& out) {
  for (Eigen::Index l = 0; l < per_ellipsoid.size(); ++l) {
    const auto i = static_cast<std::size_t>(l);
    out.segment(first_row[i], first_row[i + 1] - first_row[i]).setConstant(per_ellipsoid[l]);
  }
}

TRAMMEL_INLINE void squared_norms(const Eigen::MatrixXd& rows, const std::vector<Eigen::Index>& first_row,
                                  Eigen::VectorXd& out) {
  for (Eigen::Index l = 0; l < out.size(); ++l) {
    const auto i = static_cast<std::size_t>(l);
    out[l] = rows.middleRows(first_row[i], first_row[i + 1] - first_row[i]).squaredNorm();
  }
}

TRAMMEL_INLINE PriorState::PriorState(const ReducedProblem& problem)
    : factor(problem.size(), problem.size()),
      gradient(problem.size(), problem.size()),
      curvature(problem.size(), problem.size()),
      bounds(problem.bounds.rows(), problem.size()),
      use(static_cast<Eigen::Index>(problem.ellipsoids())),
      design_(problem.information.rows(), problem.size()),
      inverse_(problem.size(), problem.size()),
      criterion_(problem.criterion.rows(), problem.size()),
      damped_(problem.criterion.rows(), problem.size()),
      estimate_(problem.criterion.rows(), problem.information.rows()),
      stacked_(problem.information.rows(), problem.size()) {}

TRAMMEL_INLINE void PriorState::update(const ReducedProblem& problem) {
  design_.noalias() = problem.information * factor;
  stacked_.compute(design_);
  inverse_.setIdentity();
  stacked_.triangle().solveInPlace(inverse_);

  criterion_.noalias() = problem.criterion * factor;
  damped_.noalias() = criterion_ * inverse_.triangularView<Eigen::Upper>();
  criterion_.swap(damped_);
  damped_.noalias() = criterion_ * inverse_.triangularView<Eigen::Upper>().transpose();

  gradient.setZero();
  gradient.selfadjointView<Eigen::Lower>().rankUpdate(damped_.transpose());
  gradient.triangularView<Eigen::StrictlyUpper>() = gradient.transpose();
  curvature.setIdentity();
  curvature.selfadjointView<Eigen::Lower>().rankUpdate(inverse_, -1.0);
  curvature.triangularView<Eigen::StrictlyUpper>() = curvature.transpose();

  bounds.noalias() = problem.bounds * factor;
  squared_norms(bounds, problem.first_row, use);
  value = criterion_.squaredNorm();
  estimate_.noalias() = damped_ * design_.transpose();
  noise = estimate_.squaredNorm();
}

TRAMMEL_INLINE Eigen::MatrixXd PriorState::gain() const {
  const Eigen::MatrixXd half = factor * inverse_.triangularView<Eigen::Upper>();
  return half * half.transpose();
}

}  // namespace trammel::inline TRAMMEL_ABI::minimax
