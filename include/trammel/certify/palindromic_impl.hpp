// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of palindromic.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "trammel/certify/block_structure.hpp"
#include "trammel/certify/palindromic.hpp"
#include "trammel/core/random.hpp"
#include "trammel/linalg/qr.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace palindromic_detail {

/// k of the Gaussian priors tried.
inline constexpr std::array<double, 5> kPriorScales{0.15, 0.3, 0.6, 1.0, 2.0};
/// A prior of which fewer draws lie within the bounds is too expensive.
inline constexpr double kSmallestAcceptance = 5e-3;
inline constexpr int kAcceptanceDraws = 2000;
/// Kernels of half a chain, per parameter.
inline constexpr int kSweeps = 4;
/// Step sizes of the Crank-Nicolson proposals, one after the other.
inline constexpr std::array<double, 5> kProposals{0.03, 0.1, 0.3, 0.6, 1.0};

// Streams of random numbers; samples of a run count from their base.
inline constexpr std::uint64_t kDirectionStream = 1;
inline constexpr std::uint64_t kAcceptanceStream = 2;
inline constexpr std::uint64_t kPilotStream = 1ULL << 32U;
inline constexpr std::uint64_t kFinalStream = 1ULL << 40U;

inline void fill_normal(RandomStream& random, Eigen::VectorXd& values) {
  for (double& value : values) {
    value = random.normal();
  }
}

/// Standard normal conditioned to [low, high] by rejection (Robert 1995).
inline double truncated_normal(double low, double high, RandomStream& random) {
  if (high < 0.0) {
    return -truncated_normal(-high, -low, random);
  }
  const double width = high - low;
  if (!(width > 0.0)) {
    return low;
  }
  constexpr double kWide = 2.5066282746310002;  // sqrt(2 pi): a uniform proposal is accepted as often
  if (low <= 0.0) {
    for (;;) {
      const double x = width > kWide ? random.normal() : low + width * random.uniform();
      if (width > kWide ? (x >= low && x <= high) : random.uniform() < std::exp(-x * x / 2.0)) {
        return x;
      }
    }
  }
  const double rate = (low + std::sqrt(low * low + 4.0)) / 2.0;
  for (;;) {
    if (width * rate > 1.0) {
      const double x = low - std::log1p(-random.uniform()) / rate;
      if (x <= high && random.uniform() < std::exp(-(x - rate) * (x - rate) / 2.0)) {
        return x;
      }
    } else {
      const double x = low + width * random.uniform();
      if (random.uniform() < std::exp((low * low - x * x) / 2.0)) {
        return x;
      }
    }
  }
}

/// One draw of |C theta_0 - C theta_2n|^2 / 2.
class Sampler {
 public:
  Sampler() = default;
  virtual ~Sampler() = default;
  Sampler(const Sampler&) = delete;
  Sampler& operator=(const Sampler&) = delete;
  [[nodiscard]] virtual double draw(RandomStream& random) const = 0;
};

/// Prior N(0, k L L') cut to the bounds; theta = sqrt(k) L g, g = T z, T'(I + k L'JL)T = I.
class TruncatedGaussian final : public Sampler {
 public:
  TruncatedGaussian(const GuaranteedProblem& problem, const Eigen::MatrixXd& prior_factor, double k,
                    std::uint64_t seed)
      : seen_(std::sqrt(k) * problem.information_factor * prior_factor) {
    const Eigen::Index n = prior_factor.cols();
    const linalg::SymmetricEigen eigen(seen_.transpose() * seen_);
    RandomStream random(seed, kDirectionStream);
    Eigen::MatrixXd mixing(n, n);
    for (double& entry : mixing.reshaped()) {
      entry = random.normal();
    }
    const linalg::Qr qr(mixing);
    const Eigen::MatrixXd turn = qr.householderQ();
    const Eigen::VectorXd spread = (eigen.eigenvalues().cwiseMax(0.0).array() + 1.0).sqrt().matrix();
    whitening_ = eigen.eigenvectors() * spread.cwiseInverse().asDiagonal() * turn;
    inverse_ = turn.transpose() * spread.asDiagonal() * eigen.eigenvectors().transpose();
    output_ = linalg::compressed(std::sqrt(k) * problem.criterion_factor * prior_factor * whitening_);
    offset_.push_back(0);
    for (const Eigen::MatrixXd& factor : problem.ellipsoids) {
      offset_.push_back(offset_.back() + factor.rows());
    }
    bounds_.resize(offset_.back(), n);
    for (std::size_t l = 0; l < problem.ellipsoids.size(); ++l) {
      bounds_.middleRows(offset_[l], problem.ellipsoids[l].rows()) =
          std::sqrt(k) * problem.ellipsoids[l] * prior_factor;
    }
    directions_ = bounds_ * whitening_;
    squares_.resize(static_cast<Eigen::Index>(problem.ellipsoids.size()), n);
    for (std::size_t l = 0; l + 1 < offset_.size(); ++l) {
      squares_.row(static_cast<Eigen::Index>(l)) =
          directions_.middleRows(offset_[l], offset_[l + 1] - offset_[l]).colwise().squaredNorm();
    }
  }

  /// A Gaussian draw; true if it is within the bounds.
  bool propose(RandomStream& random, Eigen::VectorXd& g) const {
    fill_normal(random, g);
    for (std::size_t l = 0; l + 1 < offset_.size(); ++l) {
      if ((bounds_.middleRows(offset_[l], offset_[l + 1] - offset_[l]) * g).squaredNorm() > 1.0) {
        return false;
      }
    }
    return true;
  }

  [[nodiscard]] double acceptance(std::uint64_t seed) const {
    RandomStream random(seed, kAcceptanceStream);
    Eigen::VectorXd g(whitening_.rows());
    int accepted = 0;
    for (int i = 0; i < kAcceptanceDraws; ++i) {
      accepted += propose(random, g) ? 1 : 0;
    }
    return static_cast<double>(accepted) / kAcceptanceDraws;
  }

  [[nodiscard]] double draw(RandomStream& random) const override {
    const Eigen::Index n = whitening_.rows();
    Eigen::VectorXd g(n);
    while (!propose(random, g)) {
    }
    Eigen::VectorXd noise(seen_.rows());
    fill_normal(random, noise);
    const Eigen::VectorXd mean = whitening_.transpose() * (seen_.transpose() * (seen_ * g + noise));
    const Eigen::VectorXd start = inverse_ * g;
    Eigen::VectorXd z = start;
    Eigen::VectorXd bounded = bounds_ * g;
    const Eigen::Index half = kSweeps * n;
    for (Eigen::Index step = 0; step < 2 * half; ++step) {
      const Eigen::Index kernel = step < half ? step : 2 * half - 1 - step;
      move(kernel % n, mean, z, bounded, random);
    }
    return (output_ * (z - start)).squaredNorm() / 2.0;
  }

 private:
  /// Exact conditional draw of z_j within the chord of the bounds.
  void move(Eigen::Index j, const Eigen::VectorXd& mean, Eigen::VectorXd& z, Eigen::VectorXd& bounded,
            RandomStream& random) const {
    constexpr double kUnlimited = 40.0;  // standard deviations: a chord that never ends
    double low = -kUnlimited;
    double high = kUnlimited;
    low += mean(j) - z(j);
    high += mean(j) - z(j);
    for (std::size_t l = 0; l + 1 < offset_.size(); ++l) {
      const Eigen::Index rows = offset_[l + 1] - offset_[l];
      const double square = squares_(static_cast<Eigen::Index>(l), j);
      if (square <= 0.0) {
        continue;
      }
      const auto position = bounded.segment(offset_[l], rows);
      const double slope = position.dot(directions_.col(j).segment(offset_[l], rows));
      const double root = std::sqrt(std::max(0.0, slope * slope + square * (1.0 - position.squaredNorm())));
      low = std::max(low, (-slope - root) / square);
      high = std::min(high, (-slope + root) / square);
    }
    const double from = z(j) - mean(j);
    const double change = high > low ? truncated_normal(from + low, from + high, random) - from : 0.0;
    z(j) += change;
    bounded += change * directions_.col(j);
  }

  Eigen::MatrixXd seen_;        ///< sqrt(k) F L
  Eigen::MatrixXd whitening_;   ///< T
  Eigen::MatrixXd inverse_;     ///< T^-1
  Eigen::MatrixXd output_;      ///< sqrt(k) C L T or its triangular factor
  Eigen::MatrixXd bounds_;      ///< sqrt(k) a L, stacked
  Eigen::MatrixXd directions_;  ///< bounds_ T
  Eigen::MatrixXd squares_;     ///< s x n, squared lengths of the blocks of directions_
  std::vector<Eigen::Index> offset_;
};

/// Every block on its sphere: theta_l = g_l/|g_l|, g = M x, x ~ N(0, I).
class Spheres final : public Sampler {
 public:
  Spheres(const UnitBalls& balls, const Eigen::MatrixXd& prior_factor)
      : balls_(balls), factor_(balls.inverse * prior_factor) {
    const linalg::SymmetricEigen information(balls.information);
    noise_factor_ =
        information.eigenvectors() * information.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  }

  [[nodiscard]] double draw(RandomStream& random) const override {
    Eigen::VectorXd x(factor_.cols());
    fill_normal(random, x);
    const Eigen::VectorXd start = point(x);
    Eigen::VectorXd noise(noise_factor_.cols());
    fill_normal(random, noise);
    const Eigen::VectorXd score = balls_.information * start + noise_factor_ * noise;
    Eigen::VectorXd theta = start;
    double likelihood = log_likelihood(theta, score);
    Eigen::VectorXd step_noise(x.size());
    const Eigen::Index half = kSweeps * balls_.size();
    for (Eigen::Index step = 0; step < 2 * half; ++step) {
      const Eigen::Index kernel = step < half ? step : 2 * half - 1 - step;
      const double beta = kProposals[static_cast<std::size_t>(kernel) % kProposals.size()];
      fill_normal(random, step_noise);
      const Eigen::VectorXd proposal = std::sqrt(1.0 - beta * beta) * x + beta * step_noise;
      const Eigen::VectorXd candidate = point(proposal);
      const double candidate_likelihood = log_likelihood(candidate, score);
      if (std::log1p(-random.uniform()) <= candidate_likelihood - likelihood) {
        x = proposal;
        theta = candidate;
        likelihood = candidate_likelihood;
      }
    }
    const Eigen::VectorXd moved = theta - start;
    return (balls_.output * moved).squaredNorm() / 2.0;
  }

 private:
  [[nodiscard]] Eigen::VectorXd point(const Eigen::VectorXd& x) const {
    Eigen::VectorXd g = factor_ * x;
    for (Eigen::Index l = 0; l < balls_.blocks(); ++l) {
      auto block = g.segment(balls_.begin(l), balls_.block_size(l));
      const double size = block.norm();
      if (size > 0.0) {
        block /= size;
      }
    }
    return g;
  }
  [[nodiscard]] double log_likelihood(const Eigen::VectorXd& theta, const Eigen::VectorXd& score) const {
    return theta.dot(score) - theta.dot(balls_.information * theta) / 2.0;
  }

  const UnitBalls& balls_;
  Eigen::MatrixXd factor_;
  Eigen::MatrixXd noise_factor_;
};

struct Limit {
  double bound = 0.0;
  double mean = 0.0;
  double standard_error = 0.0;
};

/// Lower confidence limit of the mean of min(X, level), samples taken to stand for `count` independent ones.
inline Limit bernstein_limit(const std::vector<double>& samples, double level, double confidence,
                             double count) {
  double mean = 0.0;
  for (const double x : samples) {
    mean += std::min(x, level);
  }
  const auto n = static_cast<double>(samples.size());
  mean /= n;
  double variance = 0.0;
  for (const double x : samples) {
    variance += (std::min(x, level) - mean) * (std::min(x, level) - mean);
  }
  variance /= n - 1.0;
  const double logarithm = std::log(2.0 / (1.0 - confidence));
  return {
      mean - std::sqrt(2.0 * variance * logarithm / count) - 7.0 * level * logarithm / (3.0 * (count - 1.0)),
      mean, std::sqrt(variance / count)};
}

inline std::vector<double> run(const Sampler& sampler, int count, std::uint64_t seed, std::uint64_t stream,
                               const ProgressObserver& observe) {
  constexpr int kReports = 100;
  std::vector<double> samples;
  samples.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    RandomStream random(seed, stream + static_cast<std::uint64_t>(i));
    samples.push_back(sampler.draw(random));
    if (observe && i % std::max(1, count / kReports) == 0) {
      observe({.phase = "Monte Carlo bound", .fraction = static_cast<double>(i) / count});
    }
  }
  return samples;
}

/// Truncation level with the best limit, judged by the pilot.
inline double best_level(std::vector<double> pilot, double confidence, int count) {
  std::sort(pilot.begin(), pilot.end());
  double best = pilot.back();
  double best_bound = -1.0;
  for (std::size_t i = pilot.size() / 2; i < pilot.size(); i += std::max<std::size_t>(1, pilot.size() / 60)) {
    const double bound = bernstein_limit(pilot, pilot[i], confidence, count).bound;
    if (bound > best_bound) {
      best_bound = bound;
      best = pilot[i];
    }
  }
  return best;
}

}  // namespace palindromic_detail

TRAMMEL_INLINE std::optional<PalindromicBound> palindromic_bound(const GuaranteedProblem& problem,
                                                                 const Eigen::MatrixXd& prior_factor,
                                                                 const PalindromicSettings& settings,
                                                                 const ProgressObserver& observe) {
  using namespace palindromic_detail;
  std::unique_ptr<Sampler> best;
  std::vector<double> best_pilot;
  PalindromicBound result;
  const auto consider = [&](std::unique_ptr<Sampler> sampler, SampledPrior prior, double scale,
                            double acceptance, std::uint64_t number) {
    std::vector<double> pilot =
        run(*sampler, settings.pilot_samples, settings.seed, kPilotStream * (number + 1), {});
    double mean = 0.0;
    for (const double x : pilot) {
      mean += x / static_cast<double>(pilot.size());
    }
    if (best == nullptr || mean > result.mean) {
      best = std::move(sampler);
      best_pilot = std::move(pilot);
      result.mean = mean;
      result.prior = prior;
      result.prior_scale = scale;
      result.acceptance = acceptance;
    }
  };
  std::uint64_t number = 0;
  for (const double scale : kPriorScales) {
    auto sampler = std::make_unique<TruncatedGaussian>(problem, prior_factor, scale, settings.seed);
    const double acceptance = sampler->acceptance(settings.seed);
    if (acceptance < kSmallestAcceptance) {
      break;
    }
    consider(std::move(sampler), SampledPrior::kTruncatedGaussian, scale, acceptance, number++);
  }
  const std::optional<UnitBalls> balls = find_unit_balls(problem, prior_factor);
  if (balls && balls->offset.back() == balls->size()) {
    consider(std::make_unique<Spheres>(*balls, prior_factor), SampledPrior::kSpheres, 1.0, 1.0, number++);
  }
  if (best == nullptr) {
    return std::nullopt;
  }
  const double level = best_level(best_pilot, settings.confidence, settings.samples);
  const std::vector<double> samples = run(*best, settings.samples, settings.seed, kFinalStream, observe);
  const Limit limit = bernstein_limit(samples, level, settings.confidence, settings.samples);
  result.bound = std::max(0.0, limit.bound);
  result.mean = limit.mean;
  result.standard_error = limit.standard_error;
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
