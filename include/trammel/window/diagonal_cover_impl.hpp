// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of diagonal_cover.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "trammel/window/diagonal_cover.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

namespace cover_detail {

using linalg::BandedMatrix;

/// Squared Frobenius norms of the 3 x 3 blocks of a symmetric matrix; the traces of its diagonal blocks.
inline std::pair<BandedMatrix, Eigen::VectorXd> block_squares(const BandedMatrix& A) {
  const Eigen::Index count = A.size() / 3;
  const Eigen::Index reach = A.lower() / 3;
  std::pair<BandedMatrix, Eigen::VectorXd> result{BandedMatrix(count, reach, 0), Eigen::VectorXd(count)};
  for (Eigen::Index l = 0; l < count; ++l) {
    for (Eigen::Index m = std::max<Eigen::Index>(0, l - reach); m <= l; ++m) {
      result.first.at(l, m) = A.block(3 * l, 3 * m, 3, 3).squaredNorm();
    }
    result.second(l) = A.at(3 * l, 3 * l) + A.at(3 * l + 1, 3 * l + 1) + A.at(3 * l + 2, 3 * l + 2);
  }
  return result;
}

}  // namespace cover_detail

TRAMMEL_INLINE bool cover_factor(const linalg::BandedMatrix& G, const Eigen::VectorXd& kappa,
                                 linalg::BandedMatrix& factor) {
  factor = linalg::BandedMatrix(G.size(), G.lower(), 0);
  for (Eigen::Index i = 0; i < G.size(); ++i) {
    factor.row(i) = -G.row(i).head(G.lower() + 1);
    factor.at(i, i) += kappa(i / 3);
  }
  return linalg::cholesky_in_place(factor);
}

TRAMMEL_INLINE Eigen::VectorXd cheapest_cover(const linalg::BandedMatrix& G, Eigen::VectorXd kappa,
                                              const Eigen::VectorXd& cost, double first_gap,
                                              double tolerance) {
  namespace detail = cover_detail;
  constexpr int kMostSteps = 40;
  constexpr double kFall = 0.1;    // of mu
  constexpr double kNear = 1.0;    // squared Newton decrement over mu below which mu falls
  constexpr double kDamped = 0.8;  // of the longest admissible step among powers of 1/2
  constexpr int kMostHalvings = 30;
  linalg::BandedMatrix factor;
  if (!cover_factor(G, kappa, factor)) {
    return kappa;
  }
  const auto size = static_cast<double>(G.size());
  double mu = first_gap / size;
  for (int step = 0; step < kMostSteps; ++step) {
    auto [hessian, gradient] = detail::block_squares(linalg::inverse_within_band(factor.transpose()));
    gradient = cost / mu - gradient;
    if (!linalg::cholesky_in_place(hessian)) {
      break;
    }
    Eigen::MatrixXd direction = -gradient;
    linalg::solve_normal_in_place(hessian.transpose(), direction);
    const double decrement = -gradient.dot(direction.col(0));
    double length = 1.0;
    bool moved = false;
    for (int i = 0; i < kMostHalvings && !moved; ++i) {
      const Eigen::VectorXd trial = kappa + length * direction.col(0);
      moved = cover_factor(G, trial, factor);
      if (moved) {
        kappa = trial;
      }
      length *= i == 0 ? kDamped / 2.0 : 0.5;
    }
    if (!moved || !(decrement > 0.0)) {
      break;
    }
    if (decrement < kNear) {
      if (mu * size < tolerance) {
        break;
      }
      mu *= kFall;
    }
  }
  return kappa;
}

}  // namespace trammel::inline TRAMMEL_ABI::window
