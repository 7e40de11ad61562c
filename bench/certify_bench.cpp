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
#include "trammel/core/random.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

struct Named {
  std::string name;
  trammel::GuaranteedProblem problem;
};

/// A motion in three axes with constant acceleration on each of `segments` segments of 10 s, in truncated
/// powers: positions measured at 71 times along random directions, `outputs` positions wanted.
trammel::GuaranteedProblem raw_problem(Eigen::Index segments, Eigen::Index outputs) {
  constexpr double kSegment_s = 10.0;
  constexpr Eigen::Index kTimes = 71;
  constexpr double kNoise_m = 20.0;
  const Eigen::Index p = 3 * (segments + 2);
  const double duration = kSegment_s * static_cast<double>(segments);
  const auto position = [&](Eigen::Index k, Eigen::Index count) {
    const double t = duration * static_cast<double>(k) / static_cast<double>(count - 1);
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3, p);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      rows(axis, axis) = 1.0;
      rows(axis, 3 + axis) = t;
      for (Eigen::Index i = 0; i < segments; ++i) {
        const double since = t - kSegment_s * static_cast<double>(i);
        const double inside = std::clamp(since, 0.0, kSegment_s);
        rows(axis, 3 * (i + 2) + axis) = inside * (std::max(since, 0.0) - inside / 2.0);
      }
    }
    return rows;
  };
  trammel::RandomStream random(1);
  trammel::GuaranteedProblem problem;
  problem.information_factor.resize(3 * kTimes, p);
  for (Eigen::Index k = 0; k < kTimes; ++k) {
    Eigen::Matrix3d mixing;
    for (double& entry : mixing.reshaped()) {
      entry = random.normal() / kNoise_m;
    }
    problem.information_factor.middleRows(3 * k, 3) = mixing * position(k, kTimes);
  }
  problem.criterion_factor.resize(outputs, p);
  for (Eigen::Index k = 0; k < outputs / 3; ++k) {
    problem.criterion_factor.middleRows(3 * k, 3) =
        position(k, outputs / 3) / std::sqrt(static_cast<double>(outputs) / 3.0);
  }
  for (Eigen::Index l = 0; l < segments + 2; ++l) {
    Eigen::MatrixXd bound = Eigen::MatrixXd::Zero(3, p);
    bound.middleCols(3 * l, 3).diagonal().setConstant(1.0 / (l == 0 ? 100.0 : l == 1 ? 10.0 : 3.0));
    problem.ellipsoids.push_back(bound);
  }
  return problem;
}

const std::vector<Named>& problems() {
  static const std::vector<Named> list = [] {
    std::vector<Named> made;
    for (const trammel::zoo::Instance& instance : trammel::zoo::all_instances()) {
      made.push_back({std::string(instance.name), trammel::assemble(instance.scenario).problem});
    }
    made.push_back({"raw, 60 outputs", raw_problem(7, 60)});
    made.push_back({"raw, 60 outputs", raw_problem(18, 60)});
    made.push_back({"raw, 3000 outputs", raw_problem(18, 3000)});
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
