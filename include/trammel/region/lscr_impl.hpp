// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of lscr.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "trammel/region/estimate_impl.hpp"
#include "trammel/region/lscr.hpp"
#include "trammel/region/strings_impl.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

namespace detail {

/// Sums smaller than this times the size of their terms are rounding errors of zero.
inline constexpr double kTieTolerance = 1e-12;

inline constexpr std::array kPlantAssumptions{kSymmetricProbe, kIndependentNoise, kAnyFeedback, kModelOrders};
inline constexpr std::array kPredictionAssumptions{kSymmetricProbe, kIndependentNoise, kSmallMemory,
                                                   kModelOrders};

}  // namespace detail

TRAMMEL_INLINE int excluded_for_level(double level, int members, int channels) {
  require(level > 0.0 && level < 1.0, [&] {
    return ErrorDetail{"level", std::to_string(level), "a number between 0 and 1"};
  });
  // 1 - 2 c q / M >= level; a relative 1e-9 forgives the rounding of decimal levels.
  const double most = (1.0 - level) * members / (2.0 * channels);
  return std::min(static_cast<int>(most * (1.0 + 1e-9)), members / 2);
}

TRAMMEL_INLINE void LscrRegion::assign(const ProbedResiduals& residuals, const BinaryStrings& strings,
                                       std::span<const char> after_reference, int excluded,
                                       ResidualForm form) {
  require(excluded >= 1 && 2 * excluded <= strings.count() + 1, [&] {
    return ErrorDetail{"LscrRegion::assign: excluded (q)", std::to_string(excluded),
                       "1 to M/2, M = " + std::to_string(strings.count() + 1)};
  });
  require(static_cast<int>(after_reference.size()) == strings.count(), [&] {
    return ErrorDetail{"LscrRegion::assign: after_reference", std::to_string(after_reference.size()),
                       "one flag per string, " + std::to_string(strings.count())};
  });
  strings_ = strings.count();
  channels_ = residuals.channels;
  dimension_ = residuals.dimension;
  excluded_ = excluded;
  form_ = form;
  after_reference_.assign(after_reference.begin(), after_reference.end());
  subset_sums(strings, residuals.values, work_, sums_);
}

TRAMMEL_INLINE bool LscrRegion::is_positive(int j, double value, double scale) const {
  if (std::abs(value) <= detail::kTieTolerance * scale) {
    return after_reference_[static_cast<std::size_t>(j)] != 0;
  }
  return value > 0.0;
}

TRAMMEL_INLINE SignCounts LscrRegion::counts(int channel, const Eigen::Ref<const Eigen::VectorXd>& p) const {
  SignCounts result;
  for (int j = 0; j < strings_; ++j) {
    double value = constant(j, channel);
    double scale = std::abs(value);
    for (int k = 0; k < dimension_; ++k) {
      const double term = slope(j, channel, k) * p(k);
      value -= term;
      scale += std::abs(term);
    }
    result.positive += is_positive(j, value, scale) ? 1 : 0;
  }
  result.negative = strings_ - result.positive;
  return result;
}

TRAMMEL_INLINE bool LscrRegion::channel_contains(int channel,
                                                 const Eigen::Ref<const Eigen::VectorXd>& p) const {
  const SignCounts found = counts(channel, p);
  return found.positive >= excluded_ && found.negative >= excluded_;
}

TRAMMEL_INLINE bool LscrRegion::contains(const Eigen::Ref<const Eigen::VectorXd>& p) const {
  require(p.size() == dimension_, [&] {
    return ErrorDetail{"LscrRegion::contains: p", std::to_string(p.size()) + " numbers",
                       std::to_string(dimension_)};
  });
  for (int channel = 0; channel < channels_; ++channel) {
    if (!channel_contains(channel, p)) {
      return false;
    }
  }
  return true;
}

TRAMMEL_INLINE void LscrRegion::channel_section(int channel, const Eigen::Ref<const Eigen::VectorXd>& p,
                                                const Eigen::Ref<const Eigen::VectorXd>& direction,
                                                CountSweep& sweep, IntervalList& out) const {
  sweep.clear();
  int at_start = 0;  // positive sums at t = -infinity
  for (int j = 0; j < strings_; ++j) {
    double value = constant(j, channel);
    double scale = std::abs(value);
    double fall = 0.0;
    for (int k = 0; k < dimension_; ++k) {
      const double term = slope(j, channel, k) * p(k);
      value -= term;
      scale += std::abs(term);
      fall += slope(j, channel, k) * direction(k);
    }
    if (fall > 0.0) {
      ++at_start;
      sweep.add(value / fall, -1);
    } else if (fall < 0.0) {
      sweep.add(value / fall, 1);
    } else {
      at_start += is_positive(j, value, scale) ? 1 : 0;
    }
  }
  sweep.set_initial(at_start);
  out.clear();
  sweep.collect(excluded_, strings_ - excluded_, out);
}

TRAMMEL_INLINE void LscrRegion::section(const Eigen::Ref<const Eigen::VectorXd>& p,
                                        const Eigen::Ref<const Eigen::VectorXd>& direction,
                                        IntervalList& out) const {
  require(p.size() == dimension_ && direction.size() == dimension_, [&] {
    return ErrorDetail{"LscrRegion::section: p or direction",
                       std::to_string(p.size()) + " and " + std::to_string(direction.size()) + " numbers",
                       std::to_string(dimension_) + " each"};
  });
  IntervalList channel_part;
  CountSweep sweep;
  for (int channel = 0; channel < channels_; ++channel) {
    channel_section(channel, p, direction, sweep, channel_part);
    out = channel == 0 ? channel_part : intersect(out, channel_part);
  }
}

TRAMMEL_INLINE bool LscrRegion::excludes(const Eigen::Ref<const Eigen::VectorXd>& centre,
                                         const Eigen::Ref<const Eigen::MatrixXd>& generators) const {
  for (int channel = 0; channel < channels_; ++channel) {
    int surely_positive = 0;
    int surely_negative = 0;
    for (int j = 0; j < strings_; ++j) {
      double value = constant(j, channel);
      double scale = std::abs(value);
      for (int k = 0; k < dimension_; ++k) {
        const double term = slope(j, channel, k) * centre(k);
        value -= term;
        scale += std::abs(term);
      }
      double reach = detail::kTieTolerance * scale;
      for (Eigen::Index m = 0; m < generators.cols(); ++m) {
        double change = 0.0;
        for (int k = 0; k < dimension_; ++k) {
          change += slope(j, channel, k) * generators(k, m);
        }
        reach += std::abs(change);
      }
      surely_positive += value > reach ? 1 : 0;
      surely_negative += value < -reach ? 1 : 0;
    }
    if (strings_ - surely_positive < excluded_ || strings_ - surely_negative < excluded_) {
      return true;
    }
  }
  return false;
}

TRAMMEL_INLINE Guarantee LscrRegion::guarantee() const {
  const double share = 2.0 * excluded_ / members();
  const bool exact = form_ == ResidualForm::kPlant;
  Guarantee result;
  result.method = exact ? "full_residual_lscr" : "paper_lscr";
  result.channel_level = 1.0 - share;
  result.channel_kind = exact ? LevelKind::kExact : LevelKind::kApproximate;
  result.level = std::max(0.0, 1.0 - channels_ * share);
  result.level_kind = LevelKind::kApproximate;
  if (exact) {
    result.level_kind = channels_ == 1 ? LevelKind::kExact : LevelKind::kAtLeast;
  }
  result.assumptions = exact ? std::span<const Assumption>(detail::kPlantAssumptions)
                             : std::span<const Assumption>(detail::kPredictionAssumptions);
  result.source = exact ? "Campi and Weyer (2010), with the probe as instrument"
                        : "Amelin (2013), section 2, steps 1 to 6; theorem 1 corrected";
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::region
