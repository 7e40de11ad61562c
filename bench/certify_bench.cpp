// SPDX-License-Identifier: Apache-2.0
// Cost of a verified certificate beside the cost of the solution it certifies.
#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "trammel/certify/certificate.hpp"
#include "trammel/certify/near_optimality.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

trammel::GuaranteedProblem problem_of(std::int64_t index) {
  return trammel::assemble(trammel::zoo::all_instances()[static_cast<std::size_t>(index)].scenario).problem;
}

void label(benchmark::State& state, const trammel::GuaranteedProblem& problem) {
  state.SetLabel(std::string(trammel::zoo::all_instances()[static_cast<std::size_t>(state.range(0))].name) +
                 ", p = " + std::to_string(problem.parameters()));
}

void verify(benchmark::State& state) {
  const trammel::GuaranteedProblem problem = problem_of(state.range(0));
  const trammel::minimax::Solution solution = trammel::minimax::solve(problem);
  trammel::certify::Certificate certificate;
  for (auto _ : state) {
    certificate = trammel::certify::verify(problem, solution);
    benchmark::DoNotOptimize(certificate);
  }
  state.counters["relative_gap"] = certificate.relative_gap();
  state.counters["verified"] = certificate.claim == trammel::Claim::kVerified ? 1.0 : 0.0;
  label(state, problem);
}

/// Median over the iterations of the ratio of the two times, measured one after the other.
void verify_over_solve(benchmark::State& state) {
  const trammel::GuaranteedProblem problem = problem_of(state.range(0));
  using Clock = std::chrono::steady_clock;
  std::vector<double> ratios;
  for (auto _ : state) {
    const auto start = Clock::now();
    const trammel::minimax::Solution solution = trammel::minimax::solve(problem);
    const auto solved = Clock::now();
    const auto certificate = trammel::certify::verify(problem, solution);
    const auto verified = Clock::now();
    benchmark::DoNotOptimize(certificate);
    ratios.push_back(std::chrono::duration<double>(verified - solved) /
                     std::chrono::duration<double>(solved - start));
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2),
                   ratios.end());
  state.counters["verify_over_solve"] = ratios[ratios.size() / 2];
  label(state, problem);
}

void near_optimality(benchmark::State& state) {
  const trammel::GuaranteedProblem problem = problem_of(state.range(0));
  const trammel::minimax::Solution solution = trammel::minimax::solve(problem);
  for (auto _ : state) {
    benchmark::DoNotOptimize(trammel::certify::assess_near_optimality(problem, solution));
  }
  label(state, problem);
}

const int kInstances = static_cast<int>(trammel::zoo::all_instances().size());

BENCHMARK(verify)->DenseRange(0, kInstances - 1)->Unit(benchmark::kMillisecond);
BENCHMARK(verify_over_solve)->DenseRange(0, kInstances - 1)->Unit(benchmark::kMillisecond);
BENCHMARK(near_optimality)->DenseRange(0, kInstances - 1)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
