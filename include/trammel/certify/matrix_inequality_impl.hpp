// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of matrix_inequality.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "trammel/certify/matrix_inequality.hpp"
#include "trammel/certify/verified_cholesky.hpp"
#include "trammel/linalg/error_norms.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace inequality_detail {

/// Inflations tried first are these powers of two, the largest last: a point that needs more is no
/// approximate solution of the problem. Small ones are the most likely.
inline constexpr std::array<int, 8> kExponents{-40, -38, -36, -34, -30, -22, -6, 24};
/// From this exponent on an inflation is worth halving its interval this many times more.
inline constexpr int kCoarseInflation = -36;
inline constexpr int kRefinements = 4;

}  // namespace inequality_detail

TRAMMEL_INLINE UncertainForm weighted_gram(const Eigen::MatrixXd& bounded, const Eigen::VectorXd& error,
                                           const Eigen::VectorXd& rows, Eigen::Index terms) {
  using linalg::kUnitRoundoff;
  const Eigen::VectorXd roots = rows.cwiseSqrt();
  const Eigen::MatrixXd weighted = bounded * roots.asDiagonal();
  UncertainForm form;
  form.middle = Eigen::MatrixXd::Zero(bounded.rows(), bounded.rows());
  form.middle.selfadjointView<Eigen::Lower>().rankUpdate(weighted);
  // Rows of `weighted`: one rounding each of the root, the product and the trailing part of `bounded`, and
  // `error`; sums of products by Cauchy and Schwarz.
  const double largest = roots.size() > 0 ? roots.maxCoeff() : 0.0;
  const double slack = linalg::room(rows.size());
  const Eigen::VectorXd errors =
      4.0 * kUnitRoundoff * linalg::row_norms(weighted) + (slack * largest) * error;
  form.left = slack * (linalg::row_norms(weighted) + errors);
  form.right = (static_cast<double>(terms + 8) * kUnitRoundoff) * form.left + slack * errors;
  return form;
}

TRAMMEL_INLINE MatrixInequality::Growth::Growth(const MatrixInequality& inequality, double step,
                                                Eigen::Index growing)
    : of_(inequality) {
  Eigen::VectorXd rows = inequality.rows_;
  rows.head(growing).array() += step;
  growth_ = weighted_gram(inequality.bounded_, inequality.error_, rows, rows.size());
  // The sums rows + step, t growth and its sum with the form, none larger than the sizes on the left.
  growth_.right += 0x1p-51 * growth_.left;
}

TRAMMEL_INLINE bool MatrixInequality::Growth::holds_at(double t) const {
  const Eigen::Index columns = of_.form_.left.cols();
  UncertainForm total;
  total.middle = of_.form_.middle + t * growth_.middle;
  total.radius = of_.form_.radius;
  total.left.resize(total.middle.rows(), columns + 1);
  total.right.resize(total.middle.rows(), columns + 1);
  total.left << of_.form_.left, t * growth_.left;
  total.right << of_.form_.right, growth_.right;
  return positive_definite(total);
}

TRAMMEL_INLINE bool MatrixInequality::Growth::may_hold_at(double t) const {
  return positive_definite(
      UncertainForm{.middle = of_.form_.middle + t * growth_.middle, .radius = {}, .left = {}, .right = {}});
}

TRAMMEL_INLINE double MatrixInequality::Growth::find_inflation() const {
  using inequality_detail::kExponents;
  const auto* const found = std::find_if(kExponents.begin(), kExponents.end(), [this](int exponent) {
    return holds_at(std::ldexp(1.0, exponent));
  });
  if (found == kExponents.end()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  int holds = *found;
  int fails = found == kExponents.begin() ? holds - 1 : *(found - 1);
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
