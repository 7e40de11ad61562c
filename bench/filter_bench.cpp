// SPDX-License-Identifier: Apache-2.0
/// @file
/// Time per update of the constant-gain filters beside the plainest loop written by hand.
///   ./bench_filter --benchmark_repetitions=9 --benchmark_report_aggregates_only=true
/// The claim is the ratio of medians of one run, per update (1e6 updates per iteration).
#include <benchmark/benchmark.h>

#include <cstddef>
#include <optional>
#include <vector>

#include "trammel/core/random.hpp"
#include "trammel/filter/fading_memory_filter.hpp"
#include "trammel/filter/fixed_gain_filter.hpp"
#include "trammel/filter/rules.hpp"
#include "trammel/filter/tracker.hpp"

namespace {

constexpr std::size_t kUpdates = 1000000;

std::vector<double> measurements() {
  trammel::RandomStream random(1);
  std::vector<double> z(kUpdates);
  for (std::size_t i = 0; i < z.size(); ++i) {
    z[i] = 0.01 * static_cast<double>(i) + random.normal();
  }
  return z;
}

void count(benchmark::State& state) {
  state.counters["per_update"] =
      benchmark::Counter(static_cast<double>(kUpdates),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void HandWrittenAlphaBeta(benchmark::State& state) {
  const std::vector<double> z = measurements();
  const double t = 0.1;
  const double alpha = 0.5;
  const double beta_t = 0.3 / t;
  for (auto _ : state) {
    double x = 0.0;
    double v = 0.0;
    for (const double measured : z) {
      x += t * v;
      const double u = measured - x;
      x += alpha * u;
      v += beta_t * u;
    }
    benchmark::DoNotOptimize(x);
    benchmark::DoNotOptimize(v);
  }
  count(state);
}
BENCHMARK(HandWrittenAlphaBeta);

template <class Scalar, int Order, int Axes>
void FixedGain(benchmark::State& state) {
  const std::vector<double> z = measurements();
  using Filter = trammel::filter::FixedGainFilter<Scalar, Order, Axes>;
  Eigen::VectorXd gains = trammel::filter::fading_memory(Order, 0.6);
  if (Order == 2) {
    gains << 0.5, 0.3;
  }
  const Filter fresh(gains.cast<Scalar>(), Scalar(0.1));
  for (auto _ : state) {
    Filter filter = fresh;
    for (const double measured : z) {
      filter.update(Filter::Measurement::Constant(static_cast<Scalar>(measured)));
    }
    auto result = filter.state();
    benchmark::DoNotOptimize(result);
  }
  count(state);
}
BENCHMARK(FixedGain<double, 2, 1>)->Name("AlphaBeta");
BENCHMARK(FixedGain<float, 2, 1>)->Name("AlphaBetaFloat");
BENCHMARK(FixedGain<double, 2, 3>)->Name("AlphaBetaThreeAxes");
BENCHMARK(FixedGain<double, 3, 1>)->Name("AlphaBetaGamma");
BENCHMARK(FixedGain<double, 4, 1>)->Name("OrderFour");

void TrackerAlphaBeta(benchmark::State& state) {
  const std::vector<double> z = measurements();
  using Track = trammel::filter::Tracker<double, 2>;
  trammel::filter::TrackerSettings settings;
  settings.sampling_s = 0.1;
  settings.gate = 6.0;
  const Track fresh(Eigen::Vector2d(0.5, 0.3), 13.0 / 27.0, 25.0 / 27.0, settings);
  for (auto _ : state) {
    Track track = fresh;
    for (const double measured : z) {
      track.step(Track::Measurement(measured));
    }
    auto result = track.state();
    benchmark::DoNotOptimize(result);
  }
  count(state);
}
BENCHMARK(TrackerAlphaBeta);

void FadingMemoryAnyTimes(benchmark::State& state) {
  const std::vector<double> z = measurements();
  using Filter = trammel::filter::FadingMemoryFilter<double, 2>;
  for (auto _ : state) {
    Filter filter(0.5, 0.1);
    for (const double measured : z) {
      filter.predict(0.1);
      filter.correct(Filter::Measurement(measured));
    }
    auto result = filter.state();
    benchmark::DoNotOptimize(result);
  }
  count(state);
}
BENCHMARK(FadingMemoryAnyTimes);

}  // namespace

BENCHMARK_MAIN();
