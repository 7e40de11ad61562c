// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of banded_certificate.hpp.
#pragma once

#include <algorithm>
#include <cmath>

#include "trammel/certify/environment.hpp"
#include "trammel/linalg/double_double.hpp"
#include "trammel/window/banded_certificate.hpp"
#include "trammel/window/diagonal_cover.hpp"
#include "trammel/window/enclosed_band.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

namespace certificate_detail {

using linalg::BandedMatrix;
using linalg::round_up;

/// Factors of the problem, exact as stored.
struct Factors {
  EnclosedBand F, F_transposed, C, D;
  explicit Factors(const BandedProblem& problem)
      : F(problem.information_factor),
        F_transposed(problem.information_factor.transpose()),
        C(problem.criterion_factor),
        D(problem.bounds) {}
};

/// j with F'F > j I; 0 if none is proved.
inline double least_information(const Factors& factors) {
  const EnclosedBand J = multiply(factors.F_transposed, factors.F);
  double smallest = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < J.value.size(); ++i) {
    smallest = std::min(smallest, J.value.at(i, i));
  }
  return least_eigenvalue(J.value, J.error(), smallest / 2.0);
}

/// Squared error of the noise; infinite where nothing is proved.
inline double noise(const Factors& factors, const BandedEstimator& estimator) {
  const double information = least_information(factors);
  if (!(information > 0.0)) {
    return std::numeric_limits<double>::infinity();
  }
  const EnclosedBand A = [&] {
    EnclosedBand error = multiply(EnclosedBand(estimator.bias), scale_rows(estimator.root, factors.D));
    for (Eigen::Index i = 0; i < error.value.size(); ++i) {
      double& entry = error.value.at(i, i);
      entry += 1.0;
      error.radius(i) = kRoom * (error.radius(i) + kUnitRoundoff * std::abs(entry));
    }
    return multiply(factors.C, error);
  }();
  const EnclosedBand B =
      multiply(A, EnclosedBand(linalg::inverse_within_band(factors.F.value, kInverseReach)));
  const EnclosedBand seen = multiply(B, factors.F_transposed);
  const EnclosedBand R = add_signed(1.0, A, -1.0, multiply(seen, factors.F));
  return round_up(round_up(seen.squared_norm().upper() + 2.0 * inner_product(B, R).upper()) +
                  kRoom * R.squared_norm().upper() / information);
}

/// Frobenius norms of the 3 x 3 blocks (l, m) of A - I times root_m / root_l, summed over m: by how much the
/// diagonal of block row l has to grow to dominate. With these weights the growth costs least: lambda_l times
/// the sum is that of the blocks of Sigma (A - I) Sigma.
inline Eigen::VectorXd block_sums(const BandedMatrix& A, const Eigen::VectorXd& root) {
  const Eigen::Index count = A.size() / 3;
  const Eigen::Index reach = A.lower() / 3;
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(count);
  for (Eigen::Index l = 0; l < count; ++l) {
    for (Eigen::Index m = std::max<Eigen::Index>(0, l - reach); m <= l; ++m) {
      double square = 0.0;
      for (Eigen::Index i = 3 * l; i < 3 * l + 3; ++i) {
        for (Eigen::Index j = 3 * m; j < 3 * m + 3; ++j) {
          const double entry = A(i, j) - (i == j ? 1.0 : 0.0);
          square += entry * entry;
        }
      }
      const double norm = std::sqrt(square);
      const double ratio = root(3 * m) / root(3 * l);
      sums(l) += norm * ratio;
      if (m < l) {
        sums(m) += norm / ratio;
      }
    }
  }
  return sums;
}

/// The cover is as cheap as possible up to this share of the squared error.
inline constexpr double kCoverTolerance = 1e-6;

/// Multipliers kappa lambda (rounded up) for which the inequality is proved; empty if none is found.
inline Eigen::VectorXd prove_inequality(const Factors& factors, const BandedEstimator& estimator,
                                        double scale, double& inflation) {
  const EnclosedBand T = multiply(factors.C, EnclosedBand(estimator.bias));
  const BandedMatrix square = T.value.transpose() * T.value;
  const double norm = T.norm_bound();
  const double error =
      kRoom * (2.0 * norm * T.error() + T.error() * T.error() + gamma(T.value.width() + 1) * norm * norm);
  Eigen::VectorXd lambda(square.size() / 3);
  for (Eigen::Index l = 0; l < lambda.size(); ++l) {
    lambda(l) = round_up(estimator.root(3 * l) * estimator.root(3 * l));
  }
  // Gershgorin's sums cover the whole matrix; a small share of them mostly does, and the cheapest cover lies
  // below that.
  const Eigen::VectorXd sums = block_sums(square, estimator.root);
  double share = 1.0;
  constexpr double kLeastShare = 1e-6;
  const auto covers = [&](double part) {
    linalg::BandedMatrix factor;
    return cover_factor(square, 1.0 + part * sums.array(), factor);
  };
  while (share > kLeastShare && covers(share / 2.0)) {
    share /= 2.0;
  }
  Eigen::VectorXd kappa = cheapest_cover(square, 1.0 + share * sums.array(), lambda, share * lambda.dot(sums),
                                         kCoverTolerance * scale);
  const auto proved = [&] {
    linalg::BandedMatrix slack(square.size(), square.lower(), 0);
    for (Eigen::Index i = 0; i < square.size(); ++i) {
      slack.row(i) = -square.row(i).head(square.lower() + 1);
      slack.at(i, i) += kappa(i / 3);
    }
    // The sum on the diagonal rounds once.
    const double rounding = 2.0 * kUnitRoundoff * (kappa.maxCoeff() + norm * norm);
    return positive_definite(std::move(slack), kRoom * (error + rounding));
  };
  double growth = error;
  while (!proved()) {
    kappa.array() += growth;
    growth *= 4.0;
    if (!(growth < 1.0)) {
      return {};
    }
  }
  inflation = kappa.maxCoeff() - 1.0;
  for (Eigen::Index l = 0; l < lambda.size(); ++l) {
    lambda(l) = round_up(lambda(l) * kappa(l));
  }
  return lambda;
}

/// Lower bound of the value for the prior; 0 where nothing is proved.
inline double prior_value(const Factors& factors, const BandedPrior& prior) {
  constexpr double kStart = 0.25;  // block traces are 1: no eigenvalue can exceed a third everywhere
  const double s = least_eigenvalue(prior.moments, 0.0, kStart);
  if (!(s > 0.0)) {
    return 0.0;
  }
  const EnclosedBand V(prior.moments);
  const EnclosedBand X = multiply(factors.C, EnclosedBand(prior.posterior));
  const EnclosedBand G = multiply(factors.C, EnclosedBand(prior.image));
  const EnclosedNumber gain = inner_product(X, factors.C);
  const EnclosedNumber measured = multiply(X, factors.F_transposed).squared_norm();
  const EnclosedNumber cross = inner_product(multiply(G, factors.D), X);
  const EnclosedBand moved = multiply(G, V);
  const EnclosedNumber spread = inner_product(moved, G);
  const EnclosedNumber left =
      add_signed(1.0, multiply(X, EnclosedBand(factors.D.value.transpose())), -1.0, moved).squared_norm();
  const double value = 2.0 * gain.value - measured.value - 2.0 * cross.value + spread.value;
  const double sizes = 2.0 * std::abs(gain.value) + std::abs(measured.value) + 2.0 * std::abs(cross.value) +
                       std::abs(spread.value);
  const double uncertain = kRoom * (2.0 * gain.radius + measured.radius + 2.0 * cross.radius + spread.radius +
                                    8.0 * kUnitRoundoff * sizes + left.upper() / s);
  double largest_trace = 1.0;
  for (Eigen::Index l = 0; l < prior.moments.size() / 3; ++l) {
    double trace = 0.0;
    for (Eigen::Index i = 3 * l; i < 3 * l + 3; ++i) {
      if (!factors.D.value.row(i).isZero(0.0)) {  // an axis without a bound has no moment to limit
        trace = round_up(trace + prior.moments.at(i, i));
      }
    }
    largest_trace = std::max(largest_trace, trace);
  }
  return std::max(0.0, linalg::round_down(linalg::round_down(value - uncertain) / largest_trace));
}

}  // namespace certificate_detail

TRAMMEL_INLINE BandedCertificate certify_bands(const BandedProblem& problem, const BandedEstimator& estimator,
                                               const BandedPrior& prior) {
  namespace detail = certificate_detail;
  BandedCertificate certificate;
  const detail::Factors factors(problem);
  certificate.lower = detail::prior_value(factors, prior);
  certificate.multipliers =
      detail::prove_inequality(factors, estimator, certificate.lower, certificate.inflation);
  if (certificate.multipliers.size() > 0) {
    certificate.upper =
        linalg::round_up(detail::noise(factors, estimator) + linalg::sum_rounded_up(certificate.multipliers));
  }
  certificate.remark = certify::arithmetic_defect();
  if (!std::isfinite(certificate.upper)) {
    certificate.remark = "the matrix inequality of the upper bound could not be proved";
  } else if (certificate.lower > certificate.upper) {
    certificate.remark = "the two proved bounds contradict each other";
  } else {
    certificate.claim = certificate.remark.empty() ? Claim::kVerified : Claim::kApproximate;
  }
  return certificate;
}

}  // namespace trammel::inline TRAMMEL_ABI::window
