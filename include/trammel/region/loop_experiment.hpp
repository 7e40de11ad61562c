// SPDX-License-Identifier: Apache-2.0
/// @file
/// Probed closed loops with a choice of feedbacks, noises and probe laws, reproducible run by run.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string_view>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/random.hpp"
#include "trammel/region/closed_loop.hpp"
#include "trammel/region/plant.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// The law of u_t without probe.
enum class LoopFeedback {
  kNone,         ///< u = 0; the plant should be stable
  kDeadBeat,     ///< closed-loop polynomial 1, from the true plant
  kPlaced,       ///< all closed-loop poles at one place, from the true plant
  kSelfTuning,   ///< the same from recursive least-squares estimates of the unknown coefficients
  kAdversarial,  ///< counterexample to the published level: stops the residual when its sum is large
};

/// The law of v_t.
enum class LoopNoise {
  kGaussianBias,   ///< N(0.5, 0.1)
  kConstant,       ///< 20
  kHalf,           ///< 0.5
  kDeterministic,  ///< 0.1 sin t + 19 sign(50 - t mod 100)
  kCauchy,         ///< standard Cauchy
  kCauchyCubed,    ///< its third power
  kGrowing,        ///< 1.01^t
  kRamp,           ///< 0.05 t
  kReacting,       ///< 0.5 until its sum with the past probes is large, then 0: violates the independence
  kZero,           ///< 0
};

/// The law of the probes.
enum class ProbeLaw {
  kSigns,    ///< +1 or -1
  kUniform,  ///< uniform with unit variance: no ties
};

/// Names as in input files, in the order of the enumerators.
inline constexpr std::string_view kFeedbackNames[] = {"none", "dead_beat", "placed", "self_tuning",
                                                      "adversarial"};
inline constexpr std::string_view kNoiseNames[] = {
    "gaussian_bias", "constant", "half", "deterministic", "cauchy",
    "cauchy_cubed",  "growing",  "ramp", "reacting",      "zero"};
inline constexpr std::string_view kProbeNames[] = {"signs", "uniform"};

/// A loop to simulate. Default: example 2 of Amelin (2013); the feedback, the probe law and its gain are not
/// printed there.
struct LoopExperiment {
  Plant plant{.a = Eigen::VectorXd{{-2.0, 1.0}}, .b = Eigen::VectorXd{{1.0, 1.6}}, .delay = 1};
  PlantModel model{.a = {std::nullopt, 1.0}, .b = {std::nullopt, 1.6}, .delay = 1};
  LoopFeedback feedback = LoopFeedback::kDeadBeat;
  LoopNoise noise = LoopNoise::kGaussianBias;
  ProbeLaw probe = ProbeLaw::kSigns;
  int period = 2;
  int probes = 480;
  double gain = 1.0;
  double pole = 0.5;  ///< kPlaced and kSelfTuning
};

/// Throws Error naming the member out of range, or where the feedback does not suit the plant.
void validate(const LoopExperiment& experiment);

/// What a run of an experiment draws from: independent streams of one seed, chosen by the number of the run
/// and the purpose, so that results do not depend on threads or order.
enum class DrawPurpose : std::uint64_t { kProbe, kNoise, kStrings, kSigns, kTies };

[[nodiscard]] constexpr RandomStream run_stream(std::uint64_t seed, std::uint64_t run,
                                                DrawPurpose purpose) noexcept {
  constexpr std::uint64_t kPurposes = 8;
  return RandomStream(seed, run * kPurposes + static_cast<std::uint64_t>(purpose));
}

/// Runs an experiment again and again; keeps its work space, so that only the first run allocates.
class LoopSimulator {
 public:
  /// Error where `validate` says so.
  explicit LoopSimulator(LoopExperiment experiment);

  [[nodiscard]] const LoopExperiment& experiment() const { return experiment_; }
  /// Fills `record` with run number `run`.
  void simulate(std::uint64_t seed, std::uint64_t run, ProbedRecord& record);

 private:
  [[nodiscard]] double self_tuning(const LoopView& view);
  [[nodiscard]] double adversarial(const LoopView& view);
  [[nodiscard]] double noise_at(const LoopView& view, RandomStream& random);

  LoopExperiment experiment_;
  PolePlacement placement_;
  LinearFeedback fixed_;
  // recursive least squares of kSelfTuning
  LinearFeedback tuned_;
  Plant estimate_;
  Eigen::VectorXd characteristic_;
  Eigen::VectorXd first_guess_;
  Eigen::VectorXd parameters_;
  Eigen::VectorXd regressor_;
  Eigen::VectorXd gain_;
  Eigen::MatrixXd covariance_;
  // sums of kAdversarial and kReacting
  double sum_ = 0.0;
  double square_ = 0.0;
  double target_ = 0.0;
};

}  // namespace trammel::inline TRAMMEL_ABI::region

#ifndef TRAMMEL_COMPILED
#include "trammel/region/loop_experiment_impl.hpp"
#endif
