// SPDX-License-Identifier: Apache-2.0
/// @file
/// The plant of example 1 of Amelin (2013) with records drawn from SplitMix64, for tests and benchmarks.
#pragma once

#include <cmath>
#include <vector>

#include "trammel/core/random.hpp"
#include "trammel/region/closed_loop.hpp"
#include "trammel/region/strings.hpp"

namespace trammel::test {

/// y_t + a y_{t-1} + y_{t-2} = b u_{t-1} + 1.6 u_{t-2} + v_t with a and b unknown.
inline region::PlantModel example_model() {
  return {.a = {std::nullopt, 1.0}, .b = {std::nullopt, 1.6}, .delay = 1};
}

inline region::Plant example_plant() {
  return {.a = Eigen::VectorXd{{-2.0, 1.0}}, .b = Eigen::VectorXd{{1.0, 1.6}}, .delay = 1};
}

/// A record with its strings for LSCR and its signs for SPS.
struct ExampleData {
  region::ProbedRecord record;
  region::BinaryStrings strings;
  region::BinaryStrings signs;
  int excluded = 0;
  int signs_excluded = 0;
};

/// Closed-loop polynomial 1 for this plant.
inline region::LinearFeedback dead_beat() {
  region::LinearFeedback feedback;
  feedback.output = Eigen::VectorXd{{-170.0, 105.0}} / 169.0;
  feedback.input = Eigen::VectorXd::Constant(1, -168.0 / 169.0);
  return feedback;
}

inline void draw_row_of_bits(SplitMix64& random, region::BinaryStrings& strings, int row) {
  for (int n = 0; n < strings.length(); ++n) {
    strings.set(row, n, random.bit());
  }
}

/// 32 probes of gain 4, 32 members and q = 2; 20 members and q = 2 for SPS; seed 4.
inline ExampleData small_example() {
  constexpr int kProbes = 32;
  SplitMix64 random(4);
  ExampleData data;
  data.record.period = 2;
  data.record.gain = 4.0;
  data.record.probe.resize(kProbes);
  for (double& probe : data.record.probe) {
    probe = random.sign();
  }
  std::vector<double> noise(2 * kProbes);
  for (double& v : noise) {
    v = 0.5 + std::nearbyint(8.0 * (random.uniform() - 0.5)) / 8.0;
  }
  data.strings.resize(31, kProbes);
  for (int j = 0; j < data.strings.count(); ++j) {
    do {
      draw_row_of_bits(random, data.strings, j);
    } while (!data.strings.is_new(j));
  }
  data.signs.resize(19, kProbes);
  for (int j = 0; j < data.signs.count(); ++j) {
    draw_row_of_bits(random, data.signs, j);
  }
  data.excluded = 2;
  data.signs_excluded = 2;
  region::simulate_loop(
      example_plant(), dead_beat(),
      [&](const region::LoopView& view) { return noise[static_cast<std::size_t>(view.time)]; }, data.record);
  return data;
}

/// Example 2 of Amelin (2013): 480 probes, 480 members, q = 6; 400 members and q = 20 for SPS; seed 960480.
inline ExampleData example_2() {
  constexpr int kProbes = 480;
  SplitMix64 random(960480);
  ExampleData data;
  data.record.period = 2;
  data.record.probe.resize(kProbes);
  for (double& probe : data.record.probe) {
    probe = random.sign();
  }
  std::vector<double> noise(2 * kProbes);
  for (double& v : noise) {
    double sum = 0.0;
    for (int k = 0; k < 12; ++k) {
      sum += random.uniform();
    }
    v = 0.5 + std::sqrt(0.1) * (sum - 6.0);
  }
  data.strings.resize(479, kProbes);
  for (int j = 0; j < data.strings.count(); ++j) {
    draw_row_of_bits(random, data.strings, j);
  }
  data.signs.resize(399, kProbes);
  for (int j = 0; j < data.signs.count(); ++j) {
    draw_row_of_bits(random, data.signs, j);
  }
  data.excluded = 6;
  data.signs_excluded = 20;
  region::simulate_loop(
      example_plant(), dead_beat(),
      [&](const region::LoopView& view) { return noise[static_cast<std::size_t>(view.time)]; }, data.record);
  return data;
}

}  // namespace trammel::test
