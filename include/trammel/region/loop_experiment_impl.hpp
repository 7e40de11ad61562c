// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of loop_experiment.hpp.
#pragma once

#include <algorithm>
#include <string>
#include <utility>

#include "trammel/region/loop_experiment.hpp"
#include "trammel/region/plant_impl.hpp"
#include "trammel/region/residuals_impl.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

namespace detail {

inline constexpr double kHalfNoise = 0.5;      // of kHalf and kReacting
inline constexpr double kStopAt = 2.3;         // |S| / sqrt(V) at which the adversary stops
inline constexpr double kHeldOutput = 50.0;    // output that makes the adversary's residuals large
inline constexpr double kFirstGuess = 0.8;     // initial estimates of kSelfTuning relative to the truth
inline constexpr double kFirstVariance = 1.0;  // and their variance

TRAMMEL_INLINE double sign_of(double x) { return (x > 0.0 ? 1.0 : 0.0) - (x < 0.0 ? 1.0 : 0.0); }

}  // namespace detail

TRAMMEL_INLINE void validate(const LoopExperiment& experiment) {
  validate(experiment.plant);
  validate(experiment.model);
  (void)unknown_of(experiment.model, experiment.plant);  // same orders
  require(experiment.period >= 1, [&] {
    return ErrorDetail{"experiment.period", std::to_string(experiment.period), "at least 1"};
  });
  require(experiment.probes >= 1, [&] {
    return ErrorDetail{"experiment.probes", std::to_string(experiment.probes), "at least 1"};
  });
  require(experiment.gain > 0.0 && std::isfinite(experiment.gain), [&] {
    return ErrorDetail{"experiment.gain", std::to_string(experiment.gain), "a positive number"};
  });
  require(std::abs(experiment.pole) < 1.0, [&] {
    return ErrorDetail{"experiment.pole", std::to_string(experiment.pole), "between -1 and 1"};
  });
  if (experiment.feedback == LoopFeedback::kAdversarial) {
    const Plant& plant = experiment.plant;
    require(plant.a.size() == 2 && plant.b.size() == 2 && plant.delay == 1 && experiment.period == 2,
            "experiment.feedback", "adversarial", "a plant with a1, a2, b1, b2, delay 1 and period 2");
    require(plant.b(0) != 0.0 && plant.b(1) != plant.a(0) * plant.b(0) && plant.a(0) != 0.0,
            "experiment.feedback", "adversarial", "a plant with a1, b1 and b2 - a1 b1 not zero");
  }
}

TRAMMEL_INLINE LoopSimulator::LoopSimulator(LoopExperiment experiment) : experiment_(std::move(experiment)) {
  validate(experiment_);
  const Plant& plant = experiment_.plant;
  first_guess_ = detail::kFirstGuess * unknown_of(experiment_.model, plant);
  const auto na = static_cast<int>(plant.a.size());
  const int nb = plant.delay - 1 + static_cast<int>(plant.b.size());
  if (experiment_.feedback == LoopFeedback::kPlaced || experiment_.feedback == LoopFeedback::kSelfTuning) {
    characteristic_ = repeated_pole(experiment_.pole, std::max(na, 1) + nb - 1);
  }
  const bool designed = experiment_.feedback == LoopFeedback::kDeadBeat ||
                        experiment_.feedback == LoopFeedback::kPlaced ||
                        experiment_.feedback == LoopFeedback::kSelfTuning;
  require(!designed || placement_.place(plant, characteristic_, fixed_), "experiment.plant",
          "A and B with a common factor", "coprime polynomials, so that the feedback exists");
}

TRAMMEL_INLINE double LoopSimulator::self_tuning(const LoopView& view) {
  // Known terms to the left, unknown ones to the right: target = regressor . parameters + v.
  double target = view.y(0);
  Eigen::Index next = 0;
  detail::for_each_coefficient(experiment_.model,
                               [&](bool is_a, int index, const std::optional<double>& value) {
                                 const double term = is_a ? -view.y(index) : view.u(index);
                                 if (value) {
                                   target -= *value * term;
                                 } else {
                                   regressor_(next++) = term;
                                 }
                               });
  gain_.noalias() = covariance_ * regressor_;
  const double scale = 1.0 / (1.0 + regressor_.dot(gain_));
  parameters_ += gain_ * (scale * (target - regressor_.dot(parameters_)));
  covariance_.noalias() -= scale * gain_ * gain_.transpose();
  next = 0;
  detail::for_each_coefficient(
      experiment_.model, [&](bool is_a, int index, const std::optional<double>& value) {
        if (!value) {
          (is_a ? estimate_.a(index - 1) : estimate_.b(index - estimate_.delay)) = parameters_(next++);
        }
      });
  placement_.place(estimate_, characteristic_, tuned_);  // keeps the last feedback where it fails
  return tuned_(view);
}

TRAMMEL_INLINE double LoopSimulator::adversarial(const LoopView& view) {
  const Plant& plant = experiment_.plant;
  const double a1 = plant.a(0);
  const double a2 = plant.a(1);
  const double b1 = plant.b(0);
  const double b2 = plant.b(1);
  const double v = detail::kHalfNoise;
  if (view.time % 2 == 0) {
    // The residual of the published form at the truth is v - a1 y_{t-1}; its sum with the probes so far
    // decides whether the next one is made large or zero.
    const double residual = v - a1 * view.y(1);
    sum_ += view.record.probe(view.time / 2) * residual;
    square_ += residual * residual;
    target_ = std::abs(sum_) > detail::kStopAt * std::sqrt(square_) ? v / a1 : detail::kHeldOutput;
    return (target_ + a1 * view.y(0) + a2 * view.y(1) - b2 * view.u(1) - v) / b1;
  }
  // Chosen so that the next input, apart from the answer to the probe, can be zero: the loop stays bounded.
  const double rest = -a1 * view.y(0) - a2 * view.y(1) + b2 * view.u(1) + v;
  return (target_ + a1 * rest + a2 * view.y(0) - v) / (b2 - a1 * b1);
}

TRAMMEL_INLINE double LoopSimulator::noise_at(const LoopView& view, RandomStream& random) {
  const auto time = static_cast<double>(view.time);
  const auto cauchy = [&] { return std::tan(std::numbers::pi * (random.uniform() - 0.5)); };
  switch (experiment_.noise) {
    case LoopNoise::kGaussianBias:
      return 0.5 + std::sqrt(0.1) * random.normal();
    case LoopNoise::kConstant:
      return 20.0;
    case LoopNoise::kHalf:
      return detail::kHalfNoise;
    case LoopNoise::kDeterministic:
      return 0.1 * std::sin(time) + 19.0 * detail::sign_of(50.0 - std::fmod(time, 100.0));
    case LoopNoise::kCauchy:
      return cauchy();
    case LoopNoise::kCauchyCubed: {
      const double value = cauchy();
      return value * value * value;
    }
    case LoopNoise::kGrowing:
      return std::pow(1.01, time);
    case LoopNoise::kRamp:
      return 0.05 * time;
    case LoopNoise::kReacting: {
      // Looks at the probes before its own group only.
      const bool stopped = std::abs(sum_) > detail::kStopAt * std::sqrt(square_);
      const double value = stopped ? 0.0 : detail::kHalfNoise;
      if (view.time % experiment_.period == experiment_.period - 1) {
        sum_ += view.record.probe(view.time / experiment_.period) * value;
        square_ += value * value;
      }
      return value;
    }
    case LoopNoise::kZero:
      break;
  }
  return 0.0;
}

TRAMMEL_INLINE void LoopSimulator::simulate(std::uint64_t seed, std::uint64_t run, ProbedRecord& record) {
  record.period = experiment_.period;
  record.gain = experiment_.gain;
  record.probe.resize(experiment_.probes);
  RandomStream probes = run_stream(seed, run, DrawPurpose::kProbe);
  const double width = std::sqrt(3.0);  // unit variance
  for (double& probe : record.probe) {
    probe = experiment_.probe == ProbeLaw::kSigns ? probes.sign() : width * (2.0 * probes.uniform() - 1.0);
  }
  sum_ = 0.0;
  square_ = 0.0;
  target_ = 0.0;
  if (experiment_.feedback == LoopFeedback::kSelfTuning) {
    estimate_ = experiment_.plant;
    parameters_ = first_guess_;
    const Eigen::Index unknowns = parameters_.size();
    covariance_.setIdentity(unknowns, unknowns);
    covariance_ *= detail::kFirstVariance;
    regressor_.resize(unknowns);
    gain_.resize(unknowns);
    tuned_ = fixed_;
  }
  RandomStream noise = run_stream(seed, run, DrawPurpose::kNoise);
  simulate_loop(
      experiment_.plant,
      [this](const LoopView& view) {
        switch (experiment_.feedback) {
          case LoopFeedback::kDeadBeat:
          case LoopFeedback::kPlaced:
            return fixed_(view);
          case LoopFeedback::kSelfTuning:
            return self_tuning(view);
          case LoopFeedback::kAdversarial:
            return adversarial(view);
          case LoopFeedback::kNone:
            break;
        }
        return 0.0;
      },
      [&](const LoopView& view) { return noise_at(view, noise); }, record);
}

}  // namespace trammel::inline TRAMMEL_ABI::region
