// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of matrix_inequality.hpp.
#pragma once

#include <cmath>
#include <limits>

#include "trammel/certify/matrix_inequality.hpp"
#include "trammel/certify/verified_cholesky.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace inequality_detail {

/// Inflations tried are powers of two from this exponent ...
inline constexpr int kSmallestInflation = -50;
/// ... to this one; a point that needs more is no approximate solution of the problem.
inline constexpr int kLargestInflation = 24;
/// From this exponent on an inflation is worth halving its interval this many times more.
inline constexpr int kCoarseInflation = -36;
inline constexpr int kRefinements = 4;

}  // namespace inequality_detail

TRAMMEL_INLINE MatrixInequality::MatrixInequality(const linalg::EnclosedMatrix& bounded,
                                                  const Eigen::VectorXd& rows,
                                                  const linalg::EnclosedMatrix& bias,
                                                  const linalg::EnclosedMatrix& bias_image,
                                                  const EnclosedCriterion& criterion)
    : bounded_(bounded),
      bound_form_(criterion.multiply(bounded, linalg::scale_rows(bounded.transpose(), rows),
                                     linalg::ProductPart::kLower)) {
  const linalg::EnclosedMatrix base = linalg::difference(bound_form_, criterion.gram(bias, bias_image));
  base_ = base.hi;
  base_radius_ = (1.0 + 0x1p-50) * (base.lo.cwiseAbs() + base.radius);
}

TRAMMEL_INLINE bool MatrixInequality::holds() const { return positive_definite(base_, base_radius_); }

TRAMMEL_INLINE MatrixInequality::Growth::Growth(const MatrixInequality& inequality, double step,
                                                Eigen::Index growing)
    : of_(inequality), growth_(inequality.bound_form_.hi) {
  // W'(H(lambda) + step sum H_l)W may be known to double precision only: it is multiplied by t. Its error is
  // the usual gamma_n |X|'|X|, here with a comfortable constant and by norms of the columns, plus what
  // `bounded` leaves open.
  const auto points = inequality.bounded_.hi.leftCols(growing);
  growth_.noalias() += step * (points * points.transpose());
  const double gamma = 4.0 * (static_cast<double>(growing) + 4.0) * 0x1p-53;
  const Eigen::VectorXd sizes = points.rowwise().norm();
  Eigen::VectorXd errors = (gamma + 0x1p-50) * sizes;
  if (inequality.bounded_.radius.size() != 0) {
    errors += 4.0 * inequality.bounded_.radius.leftCols(growing).rowwise().norm();
  }
  radius_ = step * (sizes * errors.transpose() + errors * sizes.transpose()) + inequality.bound_form_.radius +
            0x1p-50 * (growth_.cwiseAbs() + inequality.bound_form_.hi.cwiseAbs());
}

TRAMMEL_INLINE bool MatrixInequality::Growth::holds_at(double t) const {
  const Eigen::MatrixXd total = of_.base_ + t * growth_;
  const Eigen::MatrixXd radius =
      (1.0 + 0x1p-50) * (of_.base_radius_ + t * radius_) + 0x1p-52 * total.cwiseAbs();
  return positive_definite(total, radius);
}

TRAMMEL_INLINE bool MatrixInequality::Growth::may_hold_at(double t) const {
  return positive_definite(of_.base_ + t * growth_, Eigen::MatrixXd::Zero(growth_.rows(), growth_.cols()));
}

TRAMMEL_INLINE double MatrixInequality::Growth::find_inflation() const {
  int fails = inequality_detail::kSmallestInflation - 1;
  int holds = inequality_detail::kLargestInflation;
  if (!holds_at(std::ldexp(1.0, holds))) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  while (holds - fails > 1) {
    const int middle = fails + (holds - fails) / 2;
    (holds_at(std::ldexp(1.0, middle)) ? holds : fails) = middle;
  }
  double inflation = std::ldexp(1.0, holds);
  if (holds >= inequality_detail::kCoarseInflation) {
    double too_small = inflation / 2.0;
    for (int round = 0; round < inequality_detail::kRefinements; ++round) {
      const double middle = (too_small + inflation) / 2.0;
      (holds_at(middle) ? inflation : too_small) = middle;
    }
  }
  return inflation;
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
