// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of range_grid_filter.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/observer/range_grid_filter.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

namespace detail {

/// Half width of the first grid in standard deviations of the prior, and of later ones in those of the
/// posterior.
inline constexpr double kGridReach = 8.0;
/// A posterior narrower than this many spacings gets a finer grid.
inline constexpr double kGridResolution = 1.5;

}  // namespace detail

TRAMMEL_INLINE RangeGridFilter::RangeGridFilter(const Eigen::Vector3d& position,
                                                const Eigen::Matrix3d& covariance, double sigma0, int nodes)
    : prior_position_(position),
      prior_variance_x_(covariance(0, 0)),
      variance_(sigma0 * sigma0),
      nodes_(nodes) {
  require_covariance(covariance, "covariance_m2");
  if (nodes < 3) {
    throw Error({"nodes", std::to_string(nodes), "at least 3"});
  }
  const Eigen::Vector2d slope = covariance.block<2, 1>(1, 0) / covariance(0, 0);
  const Eigen::Matrix2d conditional = covariance.block<2, 2>(1, 1) - slope * covariance.block<1, 2>(0, 1);
  const ChannelDiagonal diagonal(conditional(0, 0), conditional(1, 0), conditional(1, 1));
  rotation_ = diagonal.rotation;
  prior_precision_ = diagonal.precision;
  prior_slope_ = rotation_.to_channels(slope);
  const double reach = detail::kGridReach * std::sqrt(prior_variance_x_);
  lay_grid(position.x() - reach, position.x() + reach);
  summarise();
}

TRAMMEL_INLINE void RangeGridFilter::restrict_start(double largest_x_m) {
  largest_start_ = std::min(0.0, largest_x_m);
  const double reach = detail::kGridReach * std::sqrt(prior_variance_x_);
  lay_grid(prior_position_.x() - reach, prior_position_.x() + reach);
  summarise();
}

TRAMMEL_INLINE void RangeGridFilter::lay_grid(double low, double high) {
  high = std::min(high, largest_start_);
  low = std::min(low, high - detail::kGridReach * std::sqrt(prior_variance_x_) * 1e-6);
  low_ = low;
  // Nodes in the middle of their cells: none on x = 0.
  spacing_ = (high - low) / nodes_;
  start_.resize(nodes_);
  mean_.resize(nodes_, 2);
  precision_.resize(nodes_, 2);
  log_weight_.resize(nodes_);
  const Eigen::Vector2d prior_mean = rotation_.to_channels(prior_position_.tail<2>());
  for (int j = 0; j < nodes_; ++j) {
    start_[j] = low + (j + 0.5) * spacing_;
    const double deviation = start_[j] - prior_position_.x();
    mean_.row(j) = (prior_mean + deviation * prior_slope_).transpose().array();
    precision_.row(j) = prior_precision_.transpose().array();
    log_weight_[j] = -0.5 * deviation * deviation / prior_variance_x_;
  }
  for (const Record& record : history_) {
    absorb(record);
  }
}

TRAMMEL_INLINE bool RangeGridFilter::absorb(const Record& record) {
  bool used = false;
  for (int j = 0; j < nodes_; ++j) {
    const double x = start_[j] + record.shift.x();
    if (!(x < 0.0)) {
      log_weight_[j] = -std::numeric_limits<double>::infinity();
      continue;
    }
    used = true;
    double determinant = 1.0;
    double square = 0.0;
    for (int i = 0; i < 2; ++i) {
      const double innovation = record.measured[i] - (mean_(j, i) + record.shift[i + 1]) / x;
      const double spread = variance_ + 1.0 / (precision_(j, i) * x * x);
      determinant *= spread / variance_;
      square += innovation * innovation / spread;
      precision_(j, i) += 1.0 / (x * x * variance_);
      mean_(j, i) += innovation / (x * variance_ * precision_(j, i));
    }
    log_weight_[j] -= 0.5 * (square + std::log(determinant));
  }
  return used;
}

TRAMMEL_INLINE void RangeGridFilter::move(const Eigen::Vector3d& displacement) {
  shift_.x() += displacement.x();
  shift_.tail<2>() += rotation_.to_channels(displacement.tail<2>());
  position_ += displacement;
}

TRAMMEL_INLINE bool RangeGridFilter::update(const Eigen::Vector2d& measured) {
  const Record record{shift_, rotation_.to_channels(measured)};
  history_.push_back(record);
  if (!absorb(record)) {
    history_.pop_back();
    return false;
  }
  summarise();
  // A few refinements at most: each narrows the grid to the posterior it has just resolved better.
  constexpr int kMaxRefinements = 8;
  for (int pass = 0; pass < kMaxRefinements; ++pass) {
    const double sigma = std::sqrt(covariance_(0, 0));
    if (sigma > detail::kGridResolution * spacing_ || !(sigma >= 0.0)) {
      break;
    }
    const double centre = position_.x() - shift_.x();
    const double reach = detail::kGridReach * std::max(sigma, spacing_);
    lay_grid(centre - reach, centre + reach);
    summarise();
  }
  return true;
}

TRAMMEL_INLINE void RangeGridFilter::summarise() {
  const double largest = log_weight_.maxCoeff();
  if (!std::isfinite(largest)) {
    return;  // no node in front of the beacon: the last estimate stays
  }
  const Eigen::ArrayXd weight = (log_weight_ - largest).exp();
  const double total = weight.sum();
  const double x_mean = (weight * start_).sum() / total;
  const Eigen::Vector2d lateral((weight * mean_.col(0)).sum() / total, (weight * mean_.col(1)).sum() / total);
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (int j = 0; j < nodes_; ++j) {
    const Eigen::Vector3d deviation(start_[j] - x_mean, mean_(j, 0) - lateral.x(), mean_(j, 1) - lateral.y());
    moments.noalias() += weight[j] / total * deviation * deviation.transpose();
    moments(1, 1) += weight[j] / total / precision_(j, 0);
    moments(2, 2) += weight[j] / total / precision_(j, 1);
  }
  position_.x() = x_mean + shift_.x();
  position_.tail<2>() = rotation_.to_axes(lateral + shift_.tail<2>());
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.block<2, 2>(1, 1) << rotation_.cosine, -rotation_.sine, rotation_.sine, rotation_.cosine;
  covariance_ = turn * moments * turn.transpose();
}

}  // namespace trammel::inline TRAMMEL_ABI::observer
