// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of estimate.hpp.
#pragma once

#include <limits>

#include "trammel/core/error.hpp"
#include "trammel/linalg/svd.hpp"
#include "trammel/region/estimate.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

TRAMMEL_INLINE InstrumentalEstimate instrumental_estimate(const Eigen::RowVectorXd& total, int channels,
                                                          int dimension) {
  const int width = dimension + 1;
  require(total.size() >= channels * width, [&] {
    return ErrorDetail{"instrumental_estimate: total", std::to_string(total.size()),
                       "channels (dimension + 1) numbers, " + std::to_string(channels * width)};
  });
  InstrumentalEstimate result;
  result.matrix.resize(channels, dimension);
  result.right.resize(channels);
  for (int i = 0; i < channels; ++i) {
    result.right(i) = total(i * width);
    result.matrix.row(i) = total.segment(i * width + 1, dimension);
  }
  result.condition = std::numeric_limits<double>::infinity();
  result.parameters.setConstant(dimension, std::numeric_limits<double>::quiet_NaN());
  if (channels < dimension || !result.matrix.allFinite()) {
    return result;
  }
  const linalg::Svd svd(result.matrix, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const double largest = svd.singularValues()(0);
  const double smallest = svd.singularValues()(dimension - 1);
  if (smallest > static_cast<double>(channels) * std::numeric_limits<double>::epsilon() * largest) {
    result.condition = largest / smallest;
    result.parameters = svd.solve(result.right);
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::region
