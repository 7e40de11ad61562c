// SPDX-License-Identifier: Apache-2.0
/// @file
/// A track as users need it: start-up, missing samples, outliers, uniform or irregular sampling.
#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <string_view>
#include <type_traits>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"
#include "trammel/core/settings.hpp"
#include "trammel/filter/fading_memory_filter.hpp"
#include "trammel/filter/fixed_gain_filter.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

/// What a track needs to know beside its gains.
struct TrackerSettings {
  double sampling_s = 1.0;
  double memory_s = 0.0;  ///< above 0: fading memory at any times instead of constant gains
  double measurement_std = 1.0;
  double gate = 0.0;
  double manoeuvre_margin = 0.0;
  int max_rejections = 3;
};

template <class Settings, class Visitor>
requires std::same_as<std::remove_const_t<Settings>, TrackerSettings>
void visit_fields(Settings& settings, Visitor&& visit) {
  constexpr double kLargest = 1e100;
  visit(FieldDoc{.name = "sampling_s",
                 .unit = "s",
                 .meaning = "interval between samples (irregular sampling: a typical one)",
                 .minimum = 1e-100,
                 .maximum = kLargest},
        settings.sampling_s);
  visit(FieldDoc{.name = "memory_s",
                 .unit = "s",
                 .meaning = "above 0: weight exp(-age/memory_s) and samples at any times; 0: constant gains",
                 .minimum = 0.0},
        settings.memory_s);
  visit(FieldDoc{.name = "measurement_std",
                 .unit = "of the coordinate",
                 .meaning = "standard deviation of a measurement, for the gate",
                 .minimum = 0.0,
                 .maximum = kLargest},
        settings.measurement_std);
  visit(FieldDoc{.name = "gate",
                 .unit = "",
                 .meaning = "measurements further than this many standard deviations of the innovation (plus "
                            "manoeuvre_margin) are outliers; 0: no gate. Usual: 3 to 5",
                 .minimum = 0.0,
                 .maximum = kLargest},
        settings.gate);
  visit(
      FieldDoc{.name = "manoeuvre_margin",
               .unit = "of the coordinate",
               .meaning = "largest prediction error that the bounded manoeuvre can cause (bound times "
                          "worst-case bias of the prediction), so that manoeuvres are not taken for outliers",
               .minimum = 0.0,
               .maximum = kLargest},
      settings.manoeuvre_margin);
  visit(FieldDoc{.name = "max_rejections",
                 .unit = "",
                 .meaning = "after this many outliers in a row the track starts anew from the next sample",
                 .minimum = 0.0,
                 .maximum = 1e9},
        settings.max_rejections);
}

/// What became of one sample.
enum class SampleUse { kStartUp, kUsed, kMissing, kRejected, kRestarted };

[[nodiscard]] constexpr std::string_view to_string(SampleUse use) noexcept {
  switch (use) {
    case SampleUse::kStartUp:
      return "start_up";
    case SampleUse::kUsed:
      return "used";
    case SampleUse::kMissing:
      return "missing";
    case SampleUse::kRejected:
      return "rejected";
    case SampleUse::kRestarted:
      break;
  }
  return "restarted";
}

/// A track of `Axes` coordinates with order of astatism `Order`.
///
/// - Start-up: least squares over all samples so far (expanding memory) until its noise is at most that of
///   the filter with constant gains, which then takes over. No prior is needed; missing samples are allowed.
/// - Constant gains: predict, gate, correct. With TrackerSettings::memory_s > 0 the fading memory goes on
///   for ever instead, and samples may come at any times.
/// - Missing samples and outliers: prediction only. Gate: |u| <= gate sigma sqrt(1 + rho_e) + margin on every
///   axis, rho_e the noise gain of the prediction.
/// A value type that takes no memory from the heap: copy to branch, assign to reset.
template <class Scalar, int Order, int Axes = 1>
class Tracker {
 public:
  using State = Eigen::Matrix<Scalar, Order, Axes>;
  using Measurement = Eigen::Matrix<Scalar, Axes, 1>;
  using Gains = Eigen::Matrix<Scalar, Order, 1>;

  /// `noise_gain`, `prediction_noise_gain`: of the filter with these gains (analyse); the first decides when
  /// start-up ends, the second is used by the gate. Throws Error for settings outside their range.
  Tracker(const Gains& gains, Scalar noise_gain, Scalar prediction_noise_gain,
          const TrackerSettings& settings)
      : settings_(settings),
        noise_gain_(noise_gain),
        prediction_noise_gain_(prediction_noise_gain),
        steady_(gains, checked_sampling(settings)),
        start_(start_memory(settings), static_cast<Scalar>(settings.sampling_s)) {
    require(noise_gain > Scalar(0) && prediction_noise_gain >= Scalar(0), "noise_gain",
            "a number that is not positive (an unstable filter?)", "the noise gains of a stable filter");
  }

  /// Irregular sampling with fading memory; needs settings.memory_s > 0.
  explicit Tracker(const TrackerSettings& settings) : Tracker(Gains::Zero(), Scalar(1), Scalar(1), settings) {
    require(settings.memory_s > 0.0, "memory_s", "0", "a positive memory where no gains are given");
  }

  /// One interval forward with a measurement or without.
  SampleUse step(const std::optional<Measurement>& measurement) {
    return step(static_cast<Scalar>(settings_.sampling_s), measurement);
  }

  /// dt_s >= 0 forward. With constant gains dt_s must be the sampling interval.
  SampleUse step(Scalar dt_s, const std::optional<Measurement>& measurement) {
    if (starting_) {
      start_.predict(dt_s);
    } else {
      require(dt_s == static_cast<Scalar>(settings_.sampling_s), "dt_s", "another interval than sampling_s",
              "uniform sampling, or settings.memory_s > 0 for fading memory");
      steady_.predict();
    }
    if (!measurement || !measurement->allFinite()) {
      return SampleUse::kMissing;
    }
    const Measurement innovation = *measurement - state().row(0).transpose();
    if (!inside_gate(innovation)) {
      ++rejections_;
      if (rejections_ <= settings_.max_rejections) {
        return SampleUse::kRejected;
      }
      restart();
      start_.correct(*measurement);
      return SampleUse::kRestarted;
    }
    rejections_ = 0;
    if (!starting_) {
      steady_.correct(*measurement);
      return SampleUse::kUsed;
    }
    start_.correct(*measurement);
    if (settings_.memory_s > 0.0) {
      return start_.complete() ? SampleUse::kUsed : SampleUse::kStartUp;
    }
    if (start_.complete() && start_.noise_gain() <= noise_gain_) {
      steady_.set_state(start_.state());
      starting_ = false;
    }
    return SampleUse::kStartUp;
  }

  /// Coordinate and derivatives at the latest time, one column per axis.
  [[nodiscard]] const State& state() const { return starting_ ? start_.state() : steady_.state(); }
  /// True while the start-up (or the fading memory) is at work.
  [[nodiscard]] bool starting() const { return starting_; }

  /// Forgets everything.
  void restart() {
    start_ = FadingMemoryFilter<Scalar, Order, Axes>(start_memory(settings_),
                                                     static_cast<Scalar>(settings_.sampling_s));
    starting_ = true;
    rejections_ = 0;
  }

 private:
  static Scalar checked_sampling(const TrackerSettings& settings) {
    validate(settings, "tracker");
    return static_cast<Scalar>(settings.sampling_s);
  }

  static Scalar start_memory(const TrackerSettings& settings) {
    return settings.memory_s > 0.0 ? static_cast<Scalar>(settings.memory_s)
                                   : std::numeric_limits<Scalar>::infinity();
  }

  [[nodiscard]] bool inside_gate(const Measurement& innovation) const {
    if (!(settings_.gate > 0.0)) {
      return true;
    }
    const Scalar rho = starting_ ? start_.prediction_noise_gain() : prediction_noise_gain_;
    const Scalar limit =
        static_cast<Scalar>(settings_.gate * settings_.measurement_std) * std::sqrt(Scalar(1) + rho) +
        static_cast<Scalar>(settings_.manoeuvre_margin);
    return innovation.cwiseAbs().maxCoeff() <= limit;
  }

  TrackerSettings settings_;
  Scalar noise_gain_;
  Scalar prediction_noise_gain_;
  FixedGainFilter<Scalar, Order, Axes> steady_;
  FadingMemoryFilter<Scalar, Order, Axes> start_;
  bool starting_ = true;
  int rejections_ = 0;
};

}  // namespace trammel::inline TRAMMEL_ABI::filter
