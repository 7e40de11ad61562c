// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of self_normalised.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "trammel/core/error.hpp"
#include "trammel/region/lscr_impl.hpp"
#include "trammel/region/self_normalised.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

namespace detail {

inline constexpr std::array kCausalAssumptions{kSymmetricProbe, kCausalNoise, kAnyFeedback, kModelOrders};

/// Places beyond this are infinite for sections.
inline constexpr double kFar = 1e150;

/// Root of a continuous function with a change of sign between two points, to the last bit.
template <class Function>
double bisect(const Function& function, double low, double high) {
  const bool low_positive = function(low) > 0.0;
  for (;;) {
    // Between points of different order of magnitude the geometric mean halves the number of digits.
    double middle = low + (high - low) / 2.0;
    if (low > 0.0 && high > 4.0 * low) {
      middle = std::sqrt(low) * std::sqrt(high);
    }
    if (!(middle > low && middle < high)) {
      return middle;
    }
    ((function(middle) > 0.0) == low_positive ? low : high) = middle;
  }
}

/// Along a line: S = s0 + s1 t, w = V + rho2 = w0 + w1 t + w2 t^2, and the margin
/// f(t) = ln(w / (rho2 delta^2)) - S^2 / w, not negative where t belongs to the set.
struct SelfNormalisedLine {
  double s0 = 0.0, s1 = 0.0;
  double w0 = 0.0, w1 = 0.0, w2 = 0.0;
  double log_scale = 0.0;

  [[nodiscard]] double margin(double t) const {
    // For large t both S^2 and w overflow late: divide by t first.
    if (std::abs(t) > 1.0) {
      const double w = w0 / t / t + w1 / t + w2;
      const double s = s0 / t + s1;
      return std::log(w) + 2.0 * std::log(std::abs(t)) - log_scale - s * s / w;
    }
    const double w = w0 + t * (w1 + t * w2);
    const double s = s0 + s1 * t;
    return std::log(w) - log_scale - s * s / w;
  }
  /// f' w^2 = w w' - 2 S S' w + S^2 w', a polynomial of degree three; ascending coefficients.
  [[nodiscard]] std::array<double, 4> stationary() const {
    const std::array<double, 2> dw{w1, 2.0 * w2};
    std::array<double, 4> result{};
    const auto add = [&](double factor, int power) { result[static_cast<std::size_t>(power)] += factor; };
    const std::array<double, 3> w{w0, w1, w2};
    const std::array<double, 3> ss{s0 * s0, 2.0 * s0 * s1, s1 * s1};
    const std::array<double, 2> sds{2.0 * s0 * s1, 2.0 * s1 * s1};
    for (std::size_t i = 0; i < w.size(); ++i) {
      for (std::size_t j = 0; j < dw.size(); ++j) {
        add(w[i] * dw[j] - w[i] * sds[j] + ss[i] * dw[j], static_cast<int>(i + j));
      }
    }
    return result;
  }
};

/// Real roots of c0 + c1 t + c2 t^2 + c3 t^3, ascending, by bisection between the roots of the derivative.
inline std::vector<double> cubic_roots(const std::array<double, 4>& c) {
  const auto value = [&](double t) { return c[0] + t * (c[1] + t * (c[2] + t * c[3])); };
  std::vector<double> turns;
  const double disc = c[2] * c[2] - 3.0 * c[3] * c[1];
  if (c[3] != 0.0 && disc > 0.0) {
    const double far = -(c[2] + std::copysign(std::sqrt(disc), c[2]));
    turns = {far / (3.0 * c[3]), c[1] / far};
  } else if (c[3] == 0.0 && c[2] != 0.0) {
    turns = {-c[1] / (2.0 * c[2])};
  }
  std::sort(turns.begin(), turns.end());
  const double leading = c[3] != 0.0 ? c[3] : (c[2] != 0.0 ? c[2] : c[1]);
  if (leading == 0.0) {
    return {};
  }
  double bound = 1.0;  // Cauchy's bound of all roots
  for (const double coefficient : c) {
    bound = std::max(bound, 1.0 + std::abs(coefficient / leading));
  }
  turns.insert(turns.begin(), -bound);
  turns.push_back(bound);
  std::vector<double> roots;
  for (std::size_t k = 0; k + 1 < turns.size(); ++k) {
    if ((value(turns[k]) > 0.0) != (value(turns[k + 1]) > 0.0)) {
      roots.push_back(bisect(value, turns[k], turns[k + 1]));
    }
  }
  return roots;
}

}  // namespace detail

TRAMMEL_INLINE void SelfNormalisedRegion::assign(const ProbedResiduals& residuals, double delta,
                                                 double rho2) {
  require(delta > 0.0 && delta < 1.0, [&] {
    return ErrorDetail{"SelfNormalisedRegion::assign: delta", std::to_string(delta),
                       "a number between 0 and 1"};
  });
  require(rho2 > 0.0 && std::isfinite(rho2), [&] {
    return ErrorDetail{"SelfNormalisedRegion::assign: rho2", std::to_string(rho2), "a positive number"};
  });
  delta_ = delta;
  rho2_ = rho2;
  dimension_ = residuals.dimension;
  const Eigen::Index width = residuals.width();
  channel_.resize(static_cast<std::size_t>(residuals.channels));
  for (int i = 0; i < residuals.channels; ++i) {
    const auto columns = residuals.values.middleCols(i * width, width);
    Channel& channel = channel_[static_cast<std::size_t>(i)];
    channel.sum = columns.colwise().sum().transpose();
    channel.square.noalias() = columns.transpose() * columns;
  }
}

TRAMMEL_INLINE bool SelfNormalisedRegion::channel_contains(int channel,
                                                           const Eigen::Ref<const Eigen::VectorXd>& p) const {
  const Channel& data = channel_[static_cast<std::size_t>(channel)];
  double sum = data.sum(0);
  double square = data.square(0, 0);
  for (int k = 0; k < dimension_; ++k) {
    sum -= data.sum(k + 1) * p(k);
    double row = -2.0 * data.square(0, k + 1);
    for (int m = 0; m < dimension_; ++m) {
      row += data.square(k + 1, m + 1) * p(m);
    }
    square += row * p(k);
  }
  const double w = std::max(square, 0.0) + rho2_;
  return sum * sum <= w * std::log(w / (rho2_ * delta_ * delta_));
}

TRAMMEL_INLINE bool SelfNormalisedRegion::contains(const Eigen::Ref<const Eigen::VectorXd>& p) const {
  require(p.size() == dimension_, [&] {
    return ErrorDetail{"SelfNormalisedRegion::contains: p", std::to_string(p.size()) + " numbers",
                       std::to_string(dimension_)};
  });
  for (int channel = 0; channel < channels(); ++channel) {
    if (!channel_contains(channel, p)) {
      return false;
    }
  }
  return true;
}

TRAMMEL_INLINE void SelfNormalisedRegion::channel_section(int channel,
                                                          const Eigen::Ref<const Eigen::VectorXd>& p,
                                                          const Eigen::Ref<const Eigen::VectorXd>& direction,
                                                          IntervalList& out) const {
  const Channel& data = channel_[static_cast<std::size_t>(channel)];
  Eigen::VectorXd start(dimension_ + 1);
  Eigen::VectorXd step(dimension_ + 1);
  start << 1.0, -p;
  step << 0.0, -direction;
  detail::SelfNormalisedLine line;
  line.s0 = data.sum.dot(start);
  line.s1 = data.sum.dot(step);
  line.w0 = std::max(0.0, start.dot(data.square * start)) + rho2_;
  line.w1 = 2.0 * start.dot(data.square * step);
  line.w2 = std::max(0.0, step.dot(data.square * step));
  line.log_scale = std::log(rho2_) + 2.0 * std::log(delta_);
  const auto margin = [&](double t) { return line.margin(t); };
  out.clear();
  if (!(line.w2 > 0.0)) {  // the direction changes no residual
    if (margin(0.0) >= 0.0) {
      out.push_back({});
    }
    return;
  }
  // Between its stationary points the margin is monotone; far out on both sides it grows without bound.
  std::vector<double> marks = detail::cubic_roots(line.stationary());
  marks.insert(marks.begin(), -detail::kFar);
  marks.push_back(detail::kFar);
  double from = margin(-detail::kFar) >= 0.0 ? -detail::kInfinity : std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 0; k + 1 < marks.size(); ++k) {
    const bool before = margin(marks[k]) >= 0.0;
    const bool after = margin(marks[k + 1]) >= 0.0;
    if (before == after) {
      continue;
    }
    const double root = marks[k] < 0.0 && marks[k + 1] <= 0.0
                            ? -detail::bisect([&](double t) { return margin(-t); }, -marks[k + 1], -marks[k])
                            : detail::bisect(margin, marks[k], marks[k + 1]);
    if (before) {
      out.push_back({from, root});
    }
    from = root;
  }
  if (margin(detail::kFar) >= 0.0) {
    out.push_back({from, detail::kInfinity});
  }
}

TRAMMEL_INLINE void SelfNormalisedRegion::section(const Eigen::Ref<const Eigen::VectorXd>& p,
                                                  const Eigen::Ref<const Eigen::VectorXd>& direction,
                                                  IntervalList& out) const {
  require(p.size() == dimension_ && direction.size() == dimension_, [&] {
    return ErrorDetail{"SelfNormalisedRegion::section: p or direction",
                       std::to_string(p.size()) + " and " + std::to_string(direction.size()) + " numbers",
                       std::to_string(dimension_) + " each"};
  });
  IntervalList part;
  for (int channel = 0; channel < channels(); ++channel) {
    channel_section(channel, p, direction, part);
    out = channel == 0 ? part : intersect(out, part);
  }
}

TRAMMEL_INLINE bool SelfNormalisedRegion::excludes(
    const Eigen::Ref<const Eigen::VectorXd>& centre,
    const Eigen::Ref<const Eigen::MatrixXd>& generators) const {
  Eigen::VectorXd point(dimension_ + 1);
  point << 1.0, -centre;
  for (const Channel& data : channel_) {
    double reach = 0.0;
    double square_root = std::sqrt(std::max(0.0, point.dot(data.square * point)));
    for (Eigen::Index m = 0; m < generators.cols(); ++m) {
      reach += std::abs(data.sum.tail(dimension_).dot(generators.col(m)));
      square_root += std::sqrt(std::max(
          0.0,
          generators.col(m).dot(data.square.bottomRightCorner(dimension_, dimension_) * generators.col(m))));
    }
    const double least = std::abs(data.sum.dot(point)) * (1.0 - detail::kTieTolerance) - reach;
    const double w = square_root * square_root * (1.0 + detail::kTieTolerance) + rho2_;
    // The right side grows with w, since w is larger than rho2 delta^2 / e.
    if (least > 0.0 && least * least > w * std::log(w / (rho2_ * delta_ * delta_))) {
      return true;
    }
  }
  return false;
}

TRAMMEL_INLINE Guarantee SelfNormalisedRegion::guarantee() const {
  Guarantee result;
  result.method = "self_normalised";
  result.level = std::max(0.0, 1.0 - channels() * delta_);
  result.level_kind = LevelKind::kAtLeast;
  result.channel_level = 1.0 - delta_;
  result.channel_kind = LevelKind::kAtLeast;
  result.assumptions = detail::kCausalAssumptions;
  result.source = "method of mixtures, de la Pena, Klass and Lai (2004)";
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::region
