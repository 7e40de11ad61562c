// SPDX-License-Identifier: Apache-2.0
/// @file
/// Named scenarios with known optimum, for tests, benchmarks and examples.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "trammel/core/config.hpp"
#include "trammel/problem/guaranteed_problem.hpp"
#include "trammel/problem/scenario.hpp"

namespace trammel::inline TRAMMEL_ABI::zoo {

/// What is known about an instance (m): certified interval of the guaranteed rms error and comparison values.
struct KnownOptimum {
  double lower_rms_m = 0.0;
  double upper_rms_m = 0.0;
  double gauss_markov_rms_m = 0.0;
  std::optional<double> prior_rms_m;
};

/// A scenario, with its optimum where that is known.
struct Instance {
  std::string_view name;
  Scenario scenario;
  std::optional<KnownOptimum> optimum;
};

/// The manoeuvre of Mamaev and Semenikhin (README, Sources): 70 s in `segments` equal segments, one station
/// that measures direction cosines and range at 1 Hz, deviations up to 100 m, 10 m/s, 37 m/s^2; covariance
/// times `noise`.
[[nodiscard]] Scenario manoeuvre_scenario(int segments, double noise);

/// 7 segments, covariance as printed; p = 27.
[[nodiscard]] Instance manoeuvre();
/// 7 segments, covariance times 180/pi; p = 27.
[[nodiscard]] Instance manoeuvre_noisy();
/// 20 segments, covariance as printed; p = 66.
[[nodiscard]] Instance r20();
/// 40 segments, covariance times 180/pi: nearly singular least favourable prior; p = 126.
[[nodiscard]] Instance r40_noisy();
/// Uniform motion over 10 s, 40 measurements, mean over their times, deviations up to 250 m and 25 m/s (the
/// dual iterative method of the sources); p = 6.
[[nodiscard]] Instance paper004();
/// A circling aircraft seen at 1 Hz by two tracking radars (15 m, 1 mrad): `segments` segments of 10 s,
/// deviations up to 100 m, 10 m/s, 8 m/s^2; p = 3 (segments + 2). The optimum is known for 40 and 98
/// segments.
[[nodiscard]] Instance long_flight(int segments);

/// A linear model in truncated powers, badly conditioned on purpose: a motion in three axes with constant
/// acceleration on each of `segments` segments of 10 s, positions measured at 71 times along random
/// directions with 20 m, `outputs` / 3 >= 2 positions wanted, deviations up to 100 m, 10 m/s, 3 m/s^2; p = 3
/// (segments + 2).
[[nodiscard]] GuaranteedProblem truncated_powers(Eigen::Index segments, Eigen::Index outputs);

/// The instances of scenarios above, long_flight with 40 and 98 segments.
[[nodiscard]] std::vector<Instance> all_instances();

}  // namespace trammel::inline TRAMMEL_ABI::zoo

#ifndef TRAMMEL_COMPILED
#include "trammel/problem/zoo_impl.hpp"
#endif
