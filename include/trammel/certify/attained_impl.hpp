// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of attained.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "trammel/certify/attained.hpp"
#include "trammel/certify/block_structure.hpp"
#include "trammel/core/random.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/double_double.hpp"
#include "trammel/linalg/qr.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace attained_detail {

/// A start has converged when its error grows by less than this share in one step.
inline constexpr double kConverged = 1e-12;
inline constexpr int kMostSteps = 2000;
/// Overlapping ellipsoids: each step solves a small convex problem, so fewer starts and steps.
inline constexpr int kGeneralStarts = 6;
inline constexpr int kGeneralSteps = 60;
inline constexpr int kMultiplicativeSteps = 40;
/// Keeps H(tau) invertible where it leaves directions open, relative to its trace in the prior's basis.
inline constexpr double kRegularisation = 1e-13;

inline Eigen::VectorXd normal_vector(Eigen::Index size, std::uint64_t seed, std::uint64_t stream) {
  RandomStream random(seed, stream);
  Eigen::VectorXd result(size);
  for (double& entry : result) {
    entry = random.normal();
  }
  return result;
}

/// Largest |a_l theta|.
inline double largest_bound(const GuaranteedProblem& problem, const Eigen::VectorXd& theta) {
  double largest = 0.0;
  for (const Eigen::MatrixXd& factor : problem.ellipsoids) {
    largest = std::max(largest, (factor * theta).norm());
  }
  return largest;
}

/// Power ascent over unit balls: bias z is the output error of z. Returns the best z.
inline Eigen::VectorXd ascend_balls(const UnitBalls& balls, const Eigen::MatrixXd& bias, Eigen::MatrixXd z) {
  const Eigen::Index bounded = balls.offset.back();
  const Eigen::Index free = balls.size() - bounded;
  const auto normalise = [&](Eigen::MatrixXd& points) {
    points.bottomRows(free).setZero();
    for (Eigen::Index l = 0; l < balls.blocks(); ++l) {
      auto block = points.middleRows(balls.begin(l), balls.block_size(l));
      for (Eigen::Index j = 0; j < points.cols(); ++j) {
        const double size = block.col(j).norm();
        if (size > 0.0) {
          block.col(j) /= size;
        }
      }
    }
  };
  normalise(z);
  Eigen::MatrixXd output = bias * z;
  Eigen::VectorXd value = output.colwise().squaredNorm();
  for (int step = 0; step < kMostSteps; ++step) {
    Eigen::MatrixXd next = bias.transpose() * output;
    normalise(next);
    output = bias * next;
    const Eigen::VectorXd grown = output.colwise().squaredNorm();
    const bool converged = ((grown - value).array() <= kConverged * grown.array()).all();
    z = next;
    value = grown;
    if (converged) {
      break;
    }
  }
  Eigen::Index best = 0;
  (void)value.maxCoeff(&best);
  return z.col(best);
}

/// argmax of <g, x> over |a_l x| <= 1, a_l given in some basis, stacked with the first row of each.
inline Eigen::VectorXd maximise_linear(const std::vector<Eigen::MatrixXd>& ellipsoids,
                                       const Eigen::VectorXd& g) {
  const auto s = static_cast<Eigen::Index>(ellipsoids.size());
  Eigen::VectorXd tau = Eigen::VectorXd::Constant(s, 1.0 / static_cast<double>(s));
  Eigen::VectorXd best;
  double best_value = -1.0;
  for (int step = 0; step < kMultiplicativeSteps; ++step) {
    Eigen::MatrixXd h = Eigen::MatrixXd::Zero(g.size(), g.size());
    for (Eigen::Index l = 0; l < s; ++l) {
      const Eigen::MatrixXd& a = ellipsoids[static_cast<std::size_t>(l)];
      h.selfadjointView<Eigen::Lower>().rankUpdate(a.transpose(), tau(l));
    }
    h.diagonal().array() += kRegularisation * h.trace();
    const linalg::Cholesky cholesky(h);
    const Eigen::VectorXd x = cholesky.solve(g);
    Eigen::VectorXd sizes(s);
    for (Eigen::Index l = 0; l < s; ++l) {
      sizes(l) = (ellipsoids[static_cast<std::size_t>(l)] * x).norm();
    }
    const double value = g.dot(x) / sizes.maxCoeff();
    if (value > best_value) {
      best_value = value;
      best = x / sizes.maxCoeff();
    }
    tau = tau.cwiseProduct(sizes);
    tau /= tau.sum();
  }
  return best;
}

/// Power ascent over any intersection of ellipsoids, in the basis L of the prior.
inline Eigen::VectorXd ascend_general(const GuaranteedProblem& problem, const Eigen::MatrixXd& prior_factor,
                                      const Eigen::MatrixXd& bias, int starts, std::uint64_t seed) {
  std::vector<Eigen::MatrixXd> ellipsoids;
  for (const Eigen::MatrixXd& factor : problem.ellipsoids) {
    ellipsoids.push_back(factor * prior_factor);
  }
  const Eigen::MatrixXd output_of = bias * prior_factor;
  Eigen::VectorXd best = Eigen::VectorXd::Zero(prior_factor.cols());
  double best_value = -1.0;
  for (int start = 0; start < std::min(starts, kGeneralStarts); ++start) {
    Eigen::VectorXd x = normal_vector(prior_factor.cols(), seed, static_cast<std::uint64_t>(start));
    double value = -1.0;
    for (int step = 0; step < kGeneralSteps; ++step) {
      x = maximise_linear(ellipsoids, output_of.transpose() * (output_of * x));
      const double next = (output_of * x).squaredNorm();
      const bool converged = next - value <= kConverged * next;
      value = next;
      if (converged) {
        break;
      }
    }
    if (value > best_value) {
      best_value = value;
      best = x;
    }
  }
  return prior_factor * best;
}

}  // namespace attained_detail

TRAMMEL_INLINE AttainedError find_attained_error(const GuaranteedProblem& problem,
                                                 const Eigen::MatrixXd& gain,
                                                 const Eigen::MatrixXd& prior_factor, int starts,
                                                 std::uint64_t seed) {
  using linalg::EnclosedMatrix;
  const Eigen::Index p = problem.parameters();
  // K J is close to the identity where measurements are good: keep the digits of the difference.
  const EnclosedMatrix noise =
      linalg::product(EnclosedMatrix(gain), EnclosedMatrix(problem.information_factor.transpose()));
  const EnclosedMatrix criterion(problem.criterion_factor);
  const EnclosedMatrix error = linalg::product_minus(noise, EnclosedMatrix(problem.information_factor),
                                                     Eigen::MatrixXd::Identity(p, p));
  const Eigen::MatrixXd bias = linalg::product(criterion, error).hi;
  const Eigen::MatrixXd compact = linalg::compressed(bias);  // as long for every theta, in fewer rows
  AttainedError result;
  if (problem.ellipsoids.empty()) {
    result.parameters = Eigen::VectorXd::Zero(p);
  } else if (const std::optional<UnitBalls> balls = find_unit_balls(problem, prior_factor)) {
    Eigen::MatrixXd z(p, starts);
    const Eigen::MatrixXd factor = balls->inverse * prior_factor;
    for (int start = 0; start < starts; ++start) {
      z.col(start) =
          factor * attained_detail::normal_vector(factor.cols(), seed, static_cast<std::uint64_t>(start));
    }
    result.parameters = balls->scaling * attained_detail::ascend_balls(*balls, compact * balls->scaling, z);
  } else {
    result.parameters = attained_detail::ascend_general(problem, prior_factor, compact, starts, seed);
  }
  const double size = attained_detail::largest_bound(problem, result.parameters);
  if (size > 1.0) {
    result.parameters /= size;  // rounding errors: admissible exactly
  }
  result.squared_error =
      linalg::product(criterion, noise).hi.squaredNorm() + (bias * result.parameters).squaredNorm();
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
