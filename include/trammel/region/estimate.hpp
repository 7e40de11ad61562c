// SPDX-License-Identifier: Apache-2.0
/// @file
/// Point estimate from the correlation of residuals with probes.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/region/residuals.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// Solution of the instrumental equations sum_n x_n^(i)(p) = 0, i = 1 ... channels.
struct InstrumentalEstimate {
  Eigen::VectorXd parameters;  ///< d; NaN where the equations are singular
  Eigen::MatrixXd matrix;      ///< M_0, channels x d: sum_n x_n(p) = right - M_0 p
  Eigen::VectorXd right;       ///< c_0, channels
  double condition = 0.0;      ///< of M_0, infinite where singular or where channels < d
};

/// Solves the equations (least squares with more channels than parameters).
/// `total` holds sum_n values.row(n) of ProbedResiduals, at least channels (dimension + 1) numbers.
[[nodiscard]] InstrumentalEstimate instrumental_estimate(const Eigen::RowVectorXd& total, int channels,
                                                         int dimension);

}  // namespace trammel::inline TRAMMEL_ABI::region

#ifndef TRAMMEL_COMPILED
#include "trammel/region/estimate_impl.hpp"
#endif
