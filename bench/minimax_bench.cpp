// SPDX-License-Identifier: Apache-2.0
/// @file
/// Time of the certified solve in units of one dense p x p product of the same run.
///   ./bench_minimax --benchmark_repetitions=5 --benchmark_report_aggregates_only=true
/// The claim is the counter `products` (median): time of the solve over the median time of a product.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <vector>

#include "trammel/minimax/solve.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

double seconds_of_product(Eigen::Index p) {
  const Eigen::MatrixXd a = Eigen::MatrixXd::Random(p, p);
  const Eigen::MatrixXd b = Eigen::MatrixXd::Random(p, p);
  Eigen::MatrixXd c(p, p);
  constexpr int kTimes = 51;
  std::vector<double> seconds(kTimes);
  for (double& one : seconds) {
    const auto start = std::chrono::steady_clock::now();
    c.noalias() = a * b;
    benchmark::DoNotOptimize(c.data());
    one = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  std::nth_element(seconds.begin(), seconds.begin() + kTimes / 2, seconds.end());
  return seconds[kTimes / 2];
}

void solve_instance(benchmark::State& state, const trammel::zoo::Instance& instance) {
  const trammel::GuaranteedProblem problem = trammel::assemble(instance.scenario).problem;
  const double product = seconds_of_product(problem.parameters());
  trammel::minimax::Solution solution;
  double seconds = 0.0;
  for (auto _ : state) {
    solution = trammel::minimax::solve(problem);
    seconds += solution.solve_time_s;
  }
  state.counters["products"] = seconds / static_cast<double>(state.iterations()) / product;
  state.counters["gap"] = solution.relative_gap();
  state.counters["steps"] = solution.iterations;
}

void Manoeuvre(benchmark::State& state) { solve_instance(state, trammel::zoo::manoeuvre()); }
void ManoeuvreNoisy(benchmark::State& state) { solve_instance(state, trammel::zoo::manoeuvre_noisy()); }
void R20(benchmark::State& state) { solve_instance(state, trammel::zoo::r20()); }
void R40Noisy(benchmark::State& state) { solve_instance(state, trammel::zoo::r40_noisy()); }
void LongFlight40(benchmark::State& state) { solve_instance(state, trammel::zoo::long_flight(40)); }
void LongFlight98(benchmark::State& state) { solve_instance(state, trammel::zoo::long_flight(98)); }

BENCHMARK(Manoeuvre)->Unit(benchmark::kMillisecond);
BENCHMARK(ManoeuvreNoisy)->Unit(benchmark::kMillisecond);
BENCHMARK(R20)->Unit(benchmark::kMillisecond);
BENCHMARK(R40Noisy)->Unit(benchmark::kMillisecond);
BENCHMARK(LongFlight40)->Unit(benchmark::kMillisecond);
BENCHMARK(LongFlight98)->Unit(benchmark::kMillisecond);

}  // namespace
