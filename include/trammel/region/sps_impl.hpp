// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of sps.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include "trammel/linalg/lu.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/region/lscr_impl.hpp"
#include "trammel/region/sps.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

TRAMMEL_INLINE int excluded_for_joint_level(double level, int members) {
  return std::min(excluded_for_level(level, 2 * members, 1), members - 1);
}

TRAMMEL_INLINE void SpsRegion::assign(const ProbedResiduals& residuals, const BinaryStrings& signs,
                                      std::span<const char> after_reference, int excluded) {
  require(excluded >= 1 && excluded <= signs.count(), [&] {
    return ErrorDetail{"SpsRegion::assign: excluded (q)", std::to_string(excluded),
                       "1 to m - 1 = " + std::to_string(signs.count())};
  });
  require(static_cast<int>(after_reference.size()) == signs.count(), [&] {
    return ErrorDetail{"SpsRegion::assign: after_reference", std::to_string(after_reference.size()),
                       "one flag per string, " + std::to_string(signs.count())};
  });
  strings_ = signs.count();
  channels_ = residuals.channels;
  dimension_ = residuals.dimension;
  excluded_ = excluded;
  after_reference_.assign(after_reference.begin(), after_reference.end());
  subset_sums(signs, residuals.values, work_, sums_);
}

TRAMMEL_INLINE SpsRegion::Pair SpsRegion::pair_at(int j, int channel,
                                                  const Eigen::Ref<const Eigen::VectorXd>& p) const {
  Pair pair{plus(j, channel, 0), minus(j, channel, 0), 0.0, 0.0};
  pair.plus_scale = std::abs(pair.plus);
  pair.minus_scale = std::abs(pair.minus);
  for (int k = 0; k < dimension_; ++k) {
    const double plus_term = plus(j, channel, k + 1) * p(k);
    const double minus_term = minus(j, channel, k + 1) * p(k);
    pair.plus -= plus_term;
    pair.minus -= minus_term;
    pair.plus_scale += std::abs(plus_term);
    pair.minus_scale += std::abs(minus_term);
  }
  return pair;
}

TRAMMEL_INLINE bool SpsRegion::is_greater(int j, double product, double scale) const {
  if (std::abs(product) <= detail::kTieTolerance * scale) {
    return after_reference_[static_cast<std::size_t>(j)] != 0;
  }
  return product < 0.0;
}

TRAMMEL_INLINE int SpsRegion::count_greater(const Eigen::Ref<const Eigen::VectorXd>& p) const {
  int count = 0;
  for (int j = 0; j < strings_; ++j) {
    double product = 0.0;
    double scale = 0.0;
    for (int channel = 0; channel < channels_; ++channel) {
      const Pair pair = pair_at(j, channel, p);
      product += pair.plus * pair.minus;
      scale += std::abs(pair.plus) * pair.minus_scale + std::abs(pair.minus) * pair.plus_scale;
    }
    count += is_greater(j, product, scale) ? 1 : 0;
  }
  return count;
}

TRAMMEL_INLINE bool SpsRegion::contains(const Eigen::Ref<const Eigen::VectorXd>& p) const {
  require(p.size() == dimension_, [&] {
    return ErrorDetail{"SpsRegion::contains: p", std::to_string(p.size()) + " numbers",
                       std::to_string(dimension_)};
  });
  return count_greater(p) >= excluded_;
}

TRAMMEL_INLINE void SpsRegion::section(const Eigen::Ref<const Eigen::VectorXd>& p,
                                       const Eigen::Ref<const Eigen::VectorXd>& direction,
                                       IntervalList& out) const {
  require(p.size() == dimension_ && direction.size() == dimension_, [&] {
    return ErrorDetail{"SpsRegion::section: p or direction",
                       std::to_string(p.size()) + " and " + std::to_string(direction.size()) + " numbers",
                       std::to_string(dimension_) + " each"};
  });
  CountSweep sweep;
  int at_start = 0;
  for (int j = 0; j < strings_; ++j) {
    // sum plus minus = c - 2 h t + a t^2; member j is greater where this is negative.
    double a = 0.0;
    double h = 0.0;
    double c = 0.0;
    double scale = 0.0;
    for (int channel = 0; channel < channels_; ++channel) {
      const Pair pair = pair_at(j, channel, p);
      double plus_fall = 0.0;
      double minus_fall = 0.0;
      for (int k = 0; k < dimension_; ++k) {
        plus_fall += plus(j, channel, k + 1) * direction(k);
        minus_fall += minus(j, channel, k + 1) * direction(k);
      }
      a += plus_fall * minus_fall;
      h += (pair.plus * minus_fall + pair.minus * plus_fall) / 2.0;
      c += pair.plus * pair.minus;
      scale += std::abs(pair.plus) * pair.minus_scale + std::abs(pair.minus) * pair.plus_scale;
    }
    const double discriminant = h * h - a * c;
    if (a == 0.0 && h == 0.0) {
      at_start += is_greater(j, c, scale) ? 1 : 0;
    } else if (a == 0.0) {
      at_start += h < 0.0 ? 1 : 0;
      sweep.add(c / (2.0 * h), h < 0.0 ? -1 : 1);
    } else if (!(discriminant > 0.0)) {
      at_start += a < 0.0 ? 1 : 0;
    } else {
      const double far = h + std::copysign(std::sqrt(discriminant), h);
      const double first = std::min(far / a, c / far);
      const double second = std::max(far / a, c / far);
      at_start += a < 0.0 ? 1 : 0;
      sweep.add(first, a < 0.0 ? -1 : 1);
      sweep.add(second, a < 0.0 ? 1 : -1);
    }
  }
  sweep.set_initial(at_start);
  out.clear();
  sweep.collect(excluded_, strings_, out);
}

TRAMMEL_INLINE bool SpsRegion::excludes(const Eigen::Ref<const Eigen::VectorXd>& centre,
                                        const Eigen::Ref<const Eigen::MatrixXd>& generators) const {
  const Eigen::Index generator_count = generators.cols();
  Eigen::MatrixXd plus_fall(channels_, generator_count);
  Eigen::MatrixXd minus_fall(channels_, generator_count);
  int possible = 0;
  for (int j = 0; j < strings_; ++j) {
    double least = 0.0;  // of sum plus minus over the parallelepiped
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(generator_count);
    for (int channel = 0; channel < channels_; ++channel) {
      const Pair pair = pair_at(j, channel, centre);
      for (Eigen::Index m = 0; m < generator_count; ++m) {
        plus_fall(channel, m) = 0.0;
        minus_fall(channel, m) = 0.0;
        for (int k = 0; k < dimension_; ++k) {
          plus_fall(channel, m) += plus(j, channel, k + 1) * generators(k, m);
          minus_fall(channel, m) += minus(j, channel, k + 1) * generators(k, m);
        }
        gradient(m) += pair.plus * minus_fall(channel, m) + pair.minus * plus_fall(channel, m);
      }
      least += pair.plus * pair.minus - detail::kTieTolerance * (std::abs(pair.plus) * pair.minus_scale +
                                                                 std::abs(pair.minus) * pair.plus_scale);
    }
    least -= gradient.cwiseAbs().sum();
    for (Eigen::Index m = 0; m < generator_count; ++m) {
      least += std::min(0.0, plus_fall.col(m).dot(minus_fall.col(m)));
      for (Eigen::Index k = 0; k < m; ++k) {
        least -= std::abs(plus_fall.col(m).dot(minus_fall.col(k)) + plus_fall.col(k).dot(minus_fall.col(m)));
      }
    }
    possible += least <= 0.0 ? 1 : 0;
  }
  return possible < excluded_;
}

TRAMMEL_INLINE Guarantee SpsRegion::guarantee() const {
  Guarantee result;
  result.method = "sps";
  result.level = 1.0 - static_cast<double>(excluded_) / members();
  result.level_kind = LevelKind::kExact;
  result.channel_level = std::numeric_limits<double>::quiet_NaN();
  result.assumptions = detail::kPlantAssumptions;
  result.source = "Csaji, Campi and Weyer (2015), with the probe as instrument";
  return result;
}

TRAMMEL_INLINE void SpsRegion::affine_sum(int j, Eigen::VectorXd& constant, Eigen::MatrixXd& matrix) const {
  constant.resize(channels_);
  matrix.resize(channels_, dimension_);
  for (int channel = 0; channel < channels_; ++channel) {
    for (int k = 0; k <= dimension_; ++k) {
      const double value = j == 0 ? sums_(strings_, channel * (dimension_ + 1) + k)
                                  : plus(j - 1, channel, k) - minus(j - 1, channel, k);
      (k == 0 ? constant(channel) : matrix(channel, k - 1)) = value;
    }
  }
}

TRAMMEL_INLINE EllipsoidRegion::EllipsoidRegion(Eigen::VectorXd centre, Eigen::MatrixXd matrix, double gamma,
                                                double level)
    : centre_(std::move(centre)), matrix_(std::move(matrix)), gamma_(gamma), level_(level) {
  require(matrix_.rows() == centre_.size() && matrix_.cols() == centre_.size(), [&] {
    return ErrorDetail{"EllipsoidRegion: matrix",
                       std::to_string(matrix_.rows()) + " x " + std::to_string(matrix_.cols()),
                       "square, of the size of the centre"};
  });
}

TRAMMEL_INLINE Eigen::VectorXd EllipsoidRegion::half_widths() const {
  if (!std::isfinite(gamma_)) {
    return Eigen::VectorXd::Constant(dimension(), std::numeric_limits<double>::infinity());
  }
  const Eigen::MatrixXd inverse =
      linalg::Lu(matrix_).solve(Eigen::MatrixXd::Identity(dimension(), dimension()));
  return std::sqrt(gamma_) * inverse.rowwise().norm();
}

TRAMMEL_INLINE double EllipsoidRegion::volume() const {
  if (!std::isfinite(gamma_)) {
    return std::numeric_limits<double>::infinity();
  }
  const double half = static_cast<double>(dimension()) / 2.0;
  return std::pow(std::numbers::pi * gamma_, half) / std::tgamma(half + 1.0) /
         std::abs(linalg::Lu(matrix_).determinant());
}

TRAMMEL_INLINE bool EllipsoidRegion::contains(const Eigen::Ref<const Eigen::VectorXd>& p) const {
  require(p.size() == dimension(), [&] {
    return ErrorDetail{"EllipsoidRegion::contains: p", std::to_string(p.size()) + " numbers",
                       std::to_string(dimension())};
  });
  return std::isinf(gamma_) || (matrix_ * (p - centre_)).squaredNorm() <= gamma_;
}

TRAMMEL_INLINE void EllipsoidRegion::section(const Eigen::Ref<const Eigen::VectorXd>& p,
                                             const Eigen::Ref<const Eigen::VectorXd>& direction,
                                             IntervalList& out) const {
  require(p.size() == dimension() && direction.size() == dimension(), [&] {
    return ErrorDetail{"EllipsoidRegion::section: p or direction",
                       std::to_string(p.size()) + " and " + std::to_string(direction.size()) + " numbers",
                       std::to_string(dimension()) + " each"};
  });
  out.clear();
  if (std::isinf(gamma_)) {
    out.push_back({});
    return;
  }
  const Eigen::VectorXd start = matrix_ * (p - centre_);
  const Eigen::VectorXd step = matrix_ * direction;
  const double square = step.squaredNorm();
  if (!(square > 0.0)) {
    if (start.squaredNorm() <= gamma_) {
      out.push_back({});
    }
    return;
  }
  const double nearest = -start.dot(step) / square;
  const double room = gamma_ - (start + nearest * step).squaredNorm();
  if (room > 0.0) {
    const double half = std::sqrt(room / square);
    out.push_back({nearest - half, nearest + half});
  }
}

TRAMMEL_INLINE bool EllipsoidRegion::excludes(const Eigen::Ref<const Eigen::VectorXd>& centre,
                                              const Eigen::Ref<const Eigen::MatrixXd>& generators) const {
  if (std::isinf(gamma_)) {
    return false;
  }
  const double distance = (matrix_ * (centre - centre_)).norm();
  const double reach = (matrix_ * generators).colwise().norm().sum();
  return distance > (std::sqrt(gamma_) + reach) * (1.0 + detail::kTieTolerance);
}

TRAMMEL_INLINE Guarantee EllipsoidRegion::guarantee() const {
  Guarantee result;
  result.method = "ellipsoid";
  result.level = level_;
  result.level_kind = LevelKind::kAtLeast;
  result.channel_level = std::numeric_limits<double>::quiet_NaN();
  result.assumptions = detail::kPlantAssumptions;
  result.source = "outer ellipsoid of the sign-perturbed sums, Csaji, Campi and Weyer (2015)";
  return result;
}

namespace detail {

/// max { |z|^2 : z' A z + 2 b' z <= c } by its dual, min over lambda > 1 / w_min of
/// phi = lambda c + lambda^2 sum_k beta_k / (lambda w_k - 1); w eigenvalues of A, beta_k = (u_k' b)^2.
/// phi is convex: its derivative is bisected in the logarithm of the distance from the pole.
TRAMMEL_INLINE double largest_square(const Eigen::MatrixXd& quadratic, const Eigen::VectorXd& linear,
                                     double constant) {
  const linalg::SymmetricEigen eigen(quadratic);
  const Eigen::ArrayXd w = eigen.eigenvalues().array();
  if (!(w(0) > 0.0)) {
    return kInfinity;
  }
  const Eigen::ArrayXd beta = (eigen.eigenvectors().transpose() * linear).array().square();
  const auto lambda_of = [&](double position) { return (1.0 + std::exp(position)) / w(0); };
  const auto derivative = [&](double position) {
    const double lambda = lambda_of(position);
    // lambda w_k - 1 without cancellation for the smallest eigenvalue
    const Eigen::ArrayXd excess = (w / w(0) - 1.0) + std::exp(position) * (w / w(0));
    return constant + (beta * lambda * (excess - 1.0) / excess.square()).sum();
  };
  const auto value = [&](double position) {
    const double lambda = lambda_of(position);
    const Eigen::ArrayXd excess = (w / w(0) - 1.0) + std::exp(position) * (w / w(0));
    return lambda * constant + lambda * lambda * (beta / excess).sum();
  };
  double low = -34.0;  // distances from the pole of 1e-15 to 1e26 times lambda
  double high = 60.0;
  constexpr int kHalvings = 64;
  for (int step = 0; step < kHalvings; ++step) {
    const double middle = (low + high) / 2.0;
    (derivative(middle) > 0.0 ? high : low) = middle;
  }
  return value(high);
}

}  // namespace detail

TRAMMEL_INLINE EllipsoidRegion outer_ellipsoid(const SpsRegion& region) {
  const auto d = region.dimension();
  require(region.channels() == d, [&] {
    return ErrorDetail{"outer_ellipsoid: region", std::to_string(region.channels()) + " channels",
                       "as many as parameters, " + std::to_string(d)};
  });
  const InstrumentalEstimate estimate = region.estimate();
  const double level = region.guarantee().level;
  if (!std::isfinite(estimate.condition)) {
    return {estimate.parameters, estimate.matrix, detail::kInfinity, level};
  }
  const linalg::Lu solver(estimate.matrix.transpose());
  std::vector<double> gamma(static_cast<std::size_t>(region.members() - 1));
  Eigen::VectorXd constant;
  Eigen::MatrixXd matrix;
  for (int j = 1; j < region.members(); ++j) {
    region.affine_sum(j, constant, matrix);
    const Eigen::VectorXd offset = constant - matrix * estimate.parameters;
    const Eigen::MatrixXd b = solver.solve(matrix.transpose()).transpose();  // M_j M_0^-1
    gamma[static_cast<std::size_t>(j - 1)] = detail::largest_square(
        Eigen::MatrixXd::Identity(d, d) - b.transpose() * b, b.transpose() * offset, offset.squaredNorm());
  }
  const auto place = gamma.begin() + (region.excluded() - 1);
  std::nth_element(gamma.begin(), place, gamma.end(), std::greater<>());
  return {estimate.parameters, estimate.matrix, *place, level};
}

}  // namespace trammel::inline TRAMMEL_ABI::region
