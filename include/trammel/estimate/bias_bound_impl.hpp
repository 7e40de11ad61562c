// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of bias_bound.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/estimate/bias_bound.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/small_cholesky.hpp"
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
  const Eigen::MatrixXd square = scaled * scaled.transpose();
  return linalg::SymmetricEigen(square, Eigen::EigenvaluesOnly).eigenvalues().tail<1>()(0);
}

/// Symmetric 3 x 3 matrices as six numbers with the same inner product.
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

inline Vector6 six(const Eigen::Matrix3d& m) {
  constexpr double kOff = std::numbers::sqrt2;
  return (Vector6() << m(0, 0), m(1, 1), m(2, 2), kOff * m(0, 1), kOff * m(0, 2), kOff * m(1, 2)).finished();
}

inline Eigen::Matrix3d symmetric(const Vector6& v) {
  constexpr double kOff = 1.0 / std::numbers::sqrt2;
  Eigen::Matrix3d m;
  m << v(0), kOff * v(3), kOff * v(4),  //
      kOff * v(3), v(1), kOff * v(5),   //
      kOff * v(4), kOff * v(5), v(2);
  return m;
}

/// The form in rho for three outputs, without its constraint on the trace: with rho scaled by its best factor
///   max over rho of 2 sum_l <rho, M_l>^(1/2) - tr rho + mu log det rho,     M_l = G_l G_l',
/// has the same value at mu = 0, and 3 mu less than a proved bound at its maximum otherwise.
class ThreeOutputs {
 public:
  ThreeOutputs(const Eigen::MatrixXd& map, const std::vector<Eigen::Index>& block_sizes, double total)
      : squares_(6, static_cast<Eigen::Index>(block_sizes.size())) {
    Eigen::Index at = 0;
    for (std::size_t l = 0; l < block_sizes.size(); ++l) {
      const Eigen::Matrix3Xd block = map.middleCols(at, block_sizes[l]) / total;
      squares_.col(static_cast<Eigen::Index>(l)) = six(block * block.transpose());
      at += block_sizes[l];
    }
  }

  /// <rho, M_l>^(1/2) per block, of the map over its norm.
  [[nodiscard]] Eigen::VectorXd lengths() const {
    return (squares_.transpose() * six(rho_)).cwiseMax(0.0).cwiseSqrt();
  }
  [[nodiscard]] double trace() const { return rho_.trace(); }
  /// lambda_max(sum_l M_l / share_l).
  [[nodiscard]] double largest_eigenvalue(const Eigen::VectorXd& share) const {
    const Eigen::Matrix3d sum = symmetric(squares_ * share.cwiseInverse());
    return linalg::SymmetricEigen3(sum, Eigen::EigenvaluesOnly).eigenvalues()(2);
  }

  /// One damped Newton step towards the maximum at `mu`; returns the squared decrement.
  double step(double mu, double floor) {
    const Eigen::VectorXd share = lengths().cwiseMax(floor);
    const Eigen::Matrix3d inverse = linalg::Cholesky3(rho_).solve(Eigen::Matrix3d::Identity());
    const Vector6 gradient =
        squares_ * share.cwiseInverse() - six(Eigen::Matrix3d::Identity()) + mu * six(inverse);
    const Eigen::VectorXd cubes = (2.0 * share.array().cube()).inverse();
    Matrix6 curvature = squares_ * cubes.asDiagonal() * squares_.transpose();
    for (int j = 0; j < 6; ++j) {
      curvature.col(j) += mu * six(inverse * symmetric(Vector6::Unit(j)) * inverse);
    }
    const Eigen::MatrixXd matrix = curvature;
    const Vector6 direction = linalg::Cholesky(matrix).solve(Eigen::VectorXd(gradient));
    const double decrement = gradient.dot(direction);
    const double before = objective(rho_, mu);
    constexpr double kArmijo = 0.1;
    constexpr int kHalvings = 40;
    double length = 1.0;
    for (int i = 0; i < kHalvings; ++i, length /= 2) {
      const Eigen::Matrix3d trial = rho_ + length * symmetric(direction);
      if (linalg::Cholesky3(trial).info() == Eigen::Success &&
          objective(trial, mu) >= before + kArmijo * length * decrement) {
        rho_ = trial;
        break;
      }
    }
    return decrement;
  }

 private:
  [[nodiscard]] double objective(const Eigen::Matrix3d& rho, double mu) const {
    const Eigen::Matrix3d lower = linalg::Cholesky3(rho).matrixL();
    return 2.0 * (squares_.transpose() * six(rho)).cwiseMax(0.0).cwiseSqrt().sum() - rho.trace() +
           2.0 * mu * lower.diagonal().array().log().sum();
  }

  Eigen::Matrix<double, 6, Eigen::Dynamic> squares_;
  Eigen::Matrix3d rho_ = Eigen::Matrix3d::Identity();
};

/// Shares and bound of what has been reached, kept if better.
inline void improve(BiasBound& result, const Eigen::VectorXd& share, double factor, double lower) {
  result.lower = std::max(result.lower, lower);
  if (share.sum() * factor < result.upper) {
    result.upper = share.sum() * factor;
    result.multipliers = share * factor;
  }
  result.lower = std::min(result.lower, result.upper);  // they meet up to rounding
}

inline bool close_enough(const BiasBound& result, const BiasBoundSettings& settings) {
  return !(result.upper - result.lower > settings.relative_gap * result.upper);
}

/// Barrier method for three outputs.
inline void bound_three(const Eigen::MatrixXd& map, const std::vector<Eigen::Index>& block_sizes,
                        double total, const BiasBoundSettings& settings, BiasBound& result) {
  constexpr double kDecrease = 0.1;      // of mu, once centred
  constexpr double kCentred = 0.1;       // squared decrement over mu that counts as centred
  constexpr double kSmallestMu = 1e-13;  // beyond, rounding moves the iterate
  const double floor = std::numeric_limits<double>::epsilon();
  ThreeOutputs outputs(map, block_sizes, total);
  for (double mu = 0.1; mu > kSmallestMu && result.iterations < settings.max_iterations;) {
    const bool centred = outputs.step(mu, floor) <= kCentred * mu;
    ++result.iterations;
    if (centred) {
      const Eigen::VectorXd lengths = outputs.lengths();
      const Eigen::VectorXd share = lengths.cwiseMax(floor);
      const double unit = total * total;
      improve(result, unit * share, outputs.largest_eigenvalue(share),
              unit * lengths.sum() * lengths.sum() / outputs.trace());
      if (close_enough(result, settings)) {
        return;
      }
      mu *= kDecrease;
    }
  }
}

/// Generalised power method for any number of outputs.
inline void bound_by_powers(const Eigen::MatrixXd& map, const std::vector<Eigen::Index>& block_sizes,
                            double total, const BiasBoundSettings& settings, BiasBound& result) {
  // A share no smaller than rounding, so that no block with a bias is left without one.
  const double floor = std::numeric_limits<double>::epsilon() * total;
  // Steps between two evaluations of the largest eigenvalue, which is dear for many outputs.
  constexpr int kSparseChecks = 10;
  Eigen::MatrixXd weights = first_weights(map, block_sizes.size());
  Eigen::MatrixXd image(map.cols(), weights.cols());
  Eigen::VectorXd share(static_cast<Eigen::Index>(block_sizes.size()));
  Eigen::VectorXd column_share(map.cols());
  while (result.iterations < settings.max_iterations) {
    image.noalias() = map.transpose() * weights;
    double value = 0.0;
    Eigen::Index at = 0;
    for (std::size_t l = 0; l < block_sizes.size(); ++l) {
      const Eigen::Index size = block_sizes[l];
      const double length = image.middleRows(at, size).norm();
      const double bounded = std::max(length, floor);
      value += length;
      share(static_cast<Eigen::Index>(l)) = bounded;
      column_share.segment(at, size).setConstant(bounded);
      image.middleRows(at, size) /= bounded;
      at += size;
    }
    if (result.iterations++ % kSparseChecks == 0) {
      improve(result, share, largest_eigenvalue(map, column_share), value * value);
      if (close_enough(result, settings)) {
        return;
      }
    }
    weights.noalias() = map * image;
    weights /= weights.norm();
  }
}

}  // namespace detail

TRAMMEL_INLINE BiasBound bound_bias(const Eigen::MatrixXd& map, const std::vector<Eigen::Index>& block_sizes,
                                    const BiasBoundSettings& settings) {
  const Eigen::Index p = std::accumulate(block_sizes.begin(), block_sizes.end(), Eigen::Index{0});
  if (p != map.cols()) {
    throw Error(
        {"block_sizes", "a sum of " + std::to_string(p), std::to_string(map.cols()) + ", the columns"});
  }
  BiasBound result;
  result.multipliers = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(block_sizes.size()));
  const double total = map.norm();
  if (!(total > 0.0)) {
    result.upper = result.lower = total;  // 0, or NaN when there was one
    return result;
  }
  result.upper = std::numeric_limits<double>::infinity();
  result.lower = 0.0;
  if (map.rows() == 3) {
    detail::bound_three(map, block_sizes, total, settings, result);
  } else {
    detail::bound_by_powers(map, block_sizes, total, settings, result);
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::estimate
