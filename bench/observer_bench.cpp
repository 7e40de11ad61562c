// SPDX-License-Identifier: Apache-2.0
// One plan of the bearings-only observer beside a 3 x 3 inverse in the same run, and whole flights.
#include <vector>

#include <benchmark/benchmark.h>
#include <Eigen/LU>

#include "trammel/core/random.hpp"
#include "trammel/observer/monte_carlo.hpp"

namespace {

using namespace trammel;

/// The published example with starts drawn from its prior.
std::vector<observer::PlanProblem> problems(double beta) {
  constexpr int kProblems = 256;
  std::vector<observer::PlanProblem> result;
  RandomStream random(1);
  for (int i = 0; i < kProblems; ++i) {
    observer::PlanProblem problem;
    problem.position_m << -10000.0 + 500.0 * random.uniform(), 50.0 + 20.0 * random.normal(),
        -100.0 + 20.0 * random.normal();
    problem.covariance_m2 = Eigen::Vector3d(640000.0, 400.0, 400.0).asDiagonal();
    problem.covariance_m2(0, 1) = problem.covariance_m2(1, 0) = 1000.0 * random.uniform();
    problem.speed_mps = 100.0;
    problem.time_to_go_s = 80.0;
    problem.sigma0 = 0.002;
    problem.measurement_interval_s = 0.2;
    problem.beta_per_s.x() = beta;
    result.push_back(problem);
  }
  return result;
}

void BM_Inverse3x3(benchmark::State& state) {
  const auto inputs = problems(1.0);
  std::size_t i = 0;
  for (auto _ : state) {
    Eigen::Matrix3d inverse = inputs[i++ % inputs.size()].covariance_m2.inverse();
    benchmark::DoNotOptimize(inverse);
  }
}
BENCHMARK(BM_Inverse3x3);

void BM_PlanSingleWeight(benchmark::State& state) {
  const double beta = state.range(0) == 0 ? 1e-6 : static_cast<double>(state.range(0)) * 0.1;
  const auto inputs = problems(beta);
  std::size_t i = 0;
  for (auto _ : state) {
    observer::Plan plan = observer::make_plan_unchecked(inputs[i++ % inputs.size()]);
    benchmark::DoNotOptimize(plan);
  }
}
BENCHMARK(BM_PlanSingleWeight)->Arg(0)->Arg(1)->Arg(100);

void BM_PlanGeneralWeights(benchmark::State& state) {
  auto inputs = problems(0.1);
  for (auto& problem : inputs) {
    problem.beta_per_s << 0.1, 1000.0, 10.0;
  }
  std::size_t i = 0;
  for (auto _ : state) {
    observer::Plan plan = observer::make_plan_unchecked(inputs[i++ % inputs.size()]);
    benchmark::DoNotOptimize(plan);
  }
}
BENCHMARK(BM_PlanGeneralWeights);

void BM_FlightsOneThread(benchmark::State& state) {
  const observer::FlightLoop loop(problems(10.0).front(), {});
  observer::MonteCarloSettings settings;
  settings.runs = 200;
  settings.threads = 1;
  settings.sample_paths = 0;
  settings.max_start_x_m = -8000.0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(observer::simulate(loop, settings));
  }
  state.SetItemsProcessed(state.iterations() * settings.runs);
}
BENCHMARK(BM_FlightsOneThread)->Unit(benchmark::kMillisecond);

}  // namespace
