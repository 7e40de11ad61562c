// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of bias_bound.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/core/settings.hpp"
#include "trammel/estimate/bias_bound.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

namespace detail {

/// R of the first step: a fixed set of random combinations of the outputs, so that no direction is left out.
inline Eigen::MatrixXd first_weights(const Eigen::MatrixXd& map, std::size_t blocks) {
  const auto enough =
      static_cast<Eigen::Index>(std::ceil(std::sqrt(2.0 * static_cast<double>(blocks + 1)))) + 1;
  if (map.rows() <= enough) {
    return Eigen::MatrixXd::Identity(map.rows(), map.rows()) / std::sqrt(static_cast<double>(map.rows()));
  }
  RandomStream stream(0);
  Eigen::MatrixXd mixed(map.cols(), enough);
  for (double& entry : mixed.reshaped()) {
    entry = stream.normal();
  }
  Eigen::MatrixXd weights = map * mixed;
  weights /= weights.norm();
  return weights;
}

/// lambda_max(sum_l G_l G_l' / share_l).
inline double largest_eigenvalue(const Eigen::MatrixXd& map, const Eigen::VectorXd& column_share) {
  const Eigen::MatrixXd scaled = map * column_share.cwiseSqrt().cwiseInverse().asDiagonal();
  if (map.rows() == 3) {
    const Eigen::Matrix3d square = scaled * scaled.transpose();
    return linalg::SymmetricEigen3(square, Eigen::EigenvaluesOnly).eigenvalues()(2);
  }
  const Eigen::MatrixXd square = scaled * scaled.transpose();
  return linalg::SymmetricEigen(square, Eigen::EigenvaluesOnly).eigenvalues().tail<1>()(0);
}

}  // namespace detail

TRAMMEL_INLINE BiasBound bound_bias(const Eigen::MatrixXd& map, const std::vector<Eigen::Index>& block_sizes,
                                    const BiasBoundSettings& settings) {
  const Eigen::Index p = std::accumulate(block_sizes.begin(), block_sizes.end(), Eigen::Index{0});
  if (p != map.cols()) {
    throw Error(
        {"block_sizes", "a sum of " + std::to_string(p), std::to_string(map.cols()) + ", the columns"});
  }
  const auto count = static_cast<Eigen::Index>(block_sizes.size());
  BiasBound result;
  result.multipliers = Eigen::VectorXd::Zero(count);
  const double total = map.norm();
  if (!(total > 0.0)) {
    result.upper = result.lower = total;  // 0, or NaN when there was one
    return result;
  }
  // A share no smaller than rounding, so that no block with a bias is left without one.
  const double floor = std::numeric_limits<double>::epsilon() * total;
  // Steps between two evaluations of the largest eigenvalue, which is dear for many outputs.
  constexpr int kSparseChecks = 10;
  const int stride = map.rows() <= 3 ? 1 : kSparseChecks;
  Eigen::MatrixXd weights = detail::first_weights(map, block_sizes.size());
  Eigen::MatrixXd image(p, weights.cols());
  Eigen::VectorXd share(count);
  Eigen::VectorXd column_share(p);
  result.upper = std::numeric_limits<double>::infinity();
  result.lower = 0.0;
  while (result.iterations < settings.max_iterations) {
    image.noalias() = map.transpose() * weights;
    double value = 0.0;
    Eigen::Index at = 0;
    for (Eigen::Index l = 0; l < count; ++l) {
      const Eigen::Index size = block_sizes[static_cast<std::size_t>(l)];
      const double length = image.middleRows(at, size).norm();
      value += length;
      share(l) = std::max(length, floor);
      column_share.segment(at, size).setConstant(share(l));
      image.middleRows(at, size) /= share(l);
      at += size;
    }
    result.lower = std::max(result.lower, value * value);
    if (result.iterations++ % stride == 0) {
      const double factor = detail::largest_eigenvalue(map, column_share);
      if (share.sum() * factor < result.upper) {
        result.upper = share.sum() * factor;
        result.multipliers = share * factor;
      }
      result.lower = std::min(result.lower, result.upper);  // they meet up to rounding
      if (!(result.upper - result.lower > settings.relative_gap * result.upper)) {
        break;
      }
    }
    weights.noalias() = map * image;
    weights /= weights.norm();
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::estimate
