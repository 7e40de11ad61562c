// SPDX-License-Identifier: Apache-2.0
/// @file
/// Mean squares of a motion over time, as exact factors in the spline coefficients.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "trammel/linalg/banded_triangle.hpp"
#include "trammel/trajectory/spline_basis.hpp"

namespace trammel::inline TRAMMEL_ABI::trajectory {

/// Three-point Gauss-Legendre rule on [0, 1]: exact up to degree five, and squares of the motion have four.
struct GaussRule {
  std::array<double, 3> node;
  std::array<double, 3> weight;
};
[[nodiscard]] inline GaussRule gauss_rule() {
  const double offset = std::sqrt(3.0 / 5.0) / 2;
  return {{0.5 - offset, 0.5, 0.5 + offset}, {5.0 / 18, 8.0 / 18, 5.0 / 18}};
}

/// Rows whose squares sum to the integral mean of x(t)^2 over [begin, end], for x(t) = sum_j c_j B_j(t), one
/// axis. Exact. Throws Error unless begin < end are within the knots.
[[nodiscard]] inline linalg::BandedRows<3, 1> integral_rows(const SplineBasis& basis, double begin_s,
                                                            double end_s) {
  basis.require_covers(begin_s, "criterion window begin");
  basis.require_covers(end_s, "criterion window end");
  if (!(begin_s < end_s)) {
    throw Error(
        {"criterion window", shortest(begin_s) + " to " + shortest(end_s) + " s", "a begin before the end"});
  }
  const GaussRule rule = gauss_rule();
  linalg::BandedRows<3, 1> rows(basis.segments());
  for (Eigen::Index i = basis.segment_at(begin_s); i <= basis.segment_at(end_s); ++i) {
    const double from = std::max(begin_s, basis.knot(i));
    const double length = std::min(end_s, basis.knot(i + 1)) - from;
    if (!(length > 0)) {
      continue;
    }
    for (std::size_t q = 0; q < rule.node.size(); ++q) {
      const double weight = std::sqrt(rule.weight[q] * length / (end_s - begin_s));
      rows.add(i, weight * basis.on_segment(i, from + rule.node[q] * length).value, 0.0);
    }
  }
  return rows;
}

/// Factor C of one axis, at most (r + 2) x (r + 2), with |C c|^2 = 1/(end - begin) int x(t)^2 dt over
/// [begin, end]: the triangle of integral_rows.
[[nodiscard]] inline Eigen::MatrixXd integral_factor(const SplineBasis& basis, double begin_s, double end_s) {
  return integral_rows(basis, begin_s, end_s).reduce().factor;
}

/// The same for the mean over given times. Throws Error for no times or times outside the knots.
[[nodiscard]] inline Eigen::MatrixXd mean_factor(const SplineBasis& basis,
                                                 const std::vector<double>& times_s) {
  require(!times_s.empty(), "criterion times_s", "no times", "at least one time");
  const double weight = 1.0 / std::sqrt(static_cast<double>(times_s.size()));
  linalg::BandedRows<3, 1> rows(basis.segments());
  for (std::size_t k = 0; k < times_s.size(); ++k) {
    if (!basis.covers(times_s[k])) {
      basis.require_covers(times_s[k], "criterion times_s[" + std::to_string(k) + "]");
    }
    const LocalBasis<double> local = basis.at(times_s[k]);
    rows.add(local.first, weight * local.value, 0.0);
  }
  return rows.reduce().factor;
}

/// factor (x) I_3: the same rows for each of the three axes.
[[nodiscard]] inline Eigen::MatrixXd for_three_axes(const Eigen::MatrixXd& factor) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(3 * factor.rows(), 3 * factor.cols());
  for (Eigen::Index i = 0; i < factor.rows(); ++i) {
    for (Eigen::Index j = 0; j < factor.cols(); ++j) {
      result.block<3, 3>(3 * i, 3 * j).diagonal().setConstant(factor(i, j));
    }
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::trajectory
