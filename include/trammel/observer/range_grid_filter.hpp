// SPDX-License-Identifier: Apache-2.0
/// @file
/// Exact Bayes estimate of an observer's position: linear in y, z once x is given, so a grid over x suffices.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/observer/closed_form.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

/// Posterior of (x, y, z) given tangents zeta = (y, z)/x + sigma0 eta and known displacements.
///
/// Given x the model is linear and Gaussian in (y, z), and diagonal in the channels of the conditional prior
/// covariance. Every grid node holds an x, two scalar Kalman filters and a log weight,
///
///   S_i = sigma0^2 + 1/(lambda_i x^2),  log w -= 1/2 sum_i (innovation_i^2/S_i + log S_i),
///   lambda_i += 1/(x sigma0)^2,  mu_i += innovation_i/(x sigma0^2 lambda_i).
///
/// | symbol   | meaning                                               | unit  |
/// |----------|-------------------------------------------------------|-------|
/// | lambda_i | precision of channel i given x                         | 1/m^2 |
/// | mu_i     | mean of channel i given x                              | m     |
///
/// Exact up to the grid: the rule over x is trapezoidal, which for a smooth density wider than the spacing is
/// exact to rounding. When the posterior gets narrower than 1.5 spacings the grid is laid anew around it and
/// the history of measurements replayed. Nodes behind the beacon's plane have no weight (x < 0 is known).
/// Cost: nodes times measurements, a few nanoseconds each.
class RangeGridFilter {
 public:
  /// Default number of nodes.
  static constexpr int kNodes = 401;

  RangeGridFilter(const Eigen::Vector3d& position, const Eigen::Matrix3d& covariance, double sigma0,
                  int nodes = kNodes);

  void move(const Eigen::Vector3d& displacement);
  /// False if no node was in front of the beacon: the measurement was not used.
  bool update(const Eigen::Vector2d& measured);

  /// Posterior mean.
  [[nodiscard]] const Eigen::Vector3d& position() const { return position_; }
  /// Posterior covariance.
  [[nodiscard]] const Eigen::Matrix3d& covariance() const { return covariance_; }
  [[nodiscard]] double variance_x() const { return covariance_(0, 0); }
  /// The covariance as a prior for the next plan.
  [[nodiscard]] ConditionalPrior<double> prior() const { return conditional_prior(covariance_); }
  /// Largest x at the start that the posterior may hold (e.g. known from how the flight was ordered); call
  /// before the first update.
  void restrict_start(double largest_x_m);

 private:
  struct Record {
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();  ///< displacement since the start, channel coordinates
    Eigen::Vector2d measured = Eigen::Vector2d::Zero();
  };

  void lay_grid(double low, double high);
  bool absorb(const Record& record);
  void summarise();

  Eigen::Vector3d prior_position_;
  double prior_variance_x_;
  ChannelRotation rotation_;
  Eigen::Vector2d prior_precision_;
  Eigen::Vector2d prior_slope_;
  double variance_;
  int nodes_;
  double largest_start_ = 0.0;
  double low_ = 0.0;
  double spacing_ = 0.0;
  Eigen::Vector3d shift_ = Eigen::Vector3d::Zero();
  Eigen::ArrayXd start_;       ///< x of the nodes at the start
  Eigen::ArrayXXd mean_;       ///< nodes x 2: y, z at the start, channel coordinates
  Eigen::ArrayXXd precision_;  ///< nodes x 2
  Eigen::ArrayXd log_weight_;
  std::vector<Record> history_;
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Zero();
};

}  // namespace trammel::inline TRAMMEL_ABI::observer

#ifndef TRAMMEL_COMPILED
#include "trammel/observer/range_grid_filter_impl.hpp"
#endif
