// SPDX-License-Identifier: Apache-2.0
// Cost of a verified certificate beside the cost of the solution it certifies.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "trammel/certify/certificate.hpp"
#include "trammel/certify/near_optimality.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

struct Named {
  std::string name;
  trammel::GuaranteedProblem problem;
};

const std::vector<Named>& problems() {
  static const std::vector<Named> list = [] {
    std::vector<Named> made;
    for (const trammel::zoo::Instance& instance : trammel::zoo::all_instances()) {
      made.push_back({std::string(instance.name), trammel::assemble(instance.scenario).problem});
    }
    made.push_back({"raw, 60 outputs", trammel::zoo::truncated_powers(7, 60)});
    made.push_back({"raw, 60 outputs", trammel::zoo::truncated_powers(18, 60)});
    made.push_back({"raw, 3000 outputs", trammel::zoo::truncated_powers(18, 3000)});
    made.push_back({"raw, 3000 outputs", trammel::zoo::truncated_powers(48, 3000)});
    return made;
  }();
  return list;
}

const trammel::GuaranteedProblem& problem_of(std::int64_t index) {
  return problems()[static_cast<std::size_t>(index)].problem;
}

void label(benchmark::State& state) {
  state.SetLabel(problems()[static_cast<std::size_t>(state.range(0))].name +
                 ", p = " + std::to_string(problem_of(state.range(0)).parameters()));
}

void verify(benchmark::State& state) {
  const trammel::GuaranteedProblem& problem = problem_of(state.range(0));
  const trammel::minimax::Solution solution = trammel::minimax::solve(problem);
  trammel::certify::Certificate certificate;
  for (auto _ : state) {
    certificate = trammel::certify::verify(problem, solution);
    benchmark::DoNotOptimize(certificate);
  }
  state.counters["relative_gap"] = certificate.relative_gap();
  state.counters["verified"] = certificate.claim == trammel::Claim::kVerified ? 1.0 : 0.0;
  label(state);
}

/// Median over the iterations of the ratio of the two times, measured one after the other.
void verify_over_solve(benchmark::State& state) {
  const trammel::GuaranteedProblem& problem = problem_of(state.range(0));
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
  label(state);
}

void near_optimality(benchmark::State& state) {
  const trammel::GuaranteedProblem& problem = problem_of(state.range(0));
  const trammel::minimax::Solution solution = trammel::minimax::solve(problem);
  for (auto _ : state) {
    benchmark::DoNotOptimize(trammel::certify::assess_near_optimality(problem, solution));
  }
  label(state);
}

const std::int64_t kLast = static_cast<std::int64_t>(problems().size()) - 1;

BENCHMARK(verify)->DenseRange(0, kLast)->Unit(benchmark::kMillisecond);
BENCHMARK(verify_over_solve)->DenseRange(0, kLast)->Unit(benchmark::kMillisecond);
BENCHMARK(near_optimality)->DenseRange(0, kLast)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
