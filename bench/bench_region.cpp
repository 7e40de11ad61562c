// SPDX-License-Identifier: Apache-2.0
// Example 2 of Amelin (2013): sums of 479 strings over 480 probes and the exact polygon, against the product
// of a 480 x 480 by a 480 x 3 matrix on the same machine.
#include <benchmark/benchmark.h>

#include "trammel/region/coverage.hpp"
#include "trammel/region/loop_experiment.hpp"
#include "trammel/region/lscr.hpp"
#include "trammel/region/planar.hpp"

namespace {

using namespace trammel::region;

struct Example2 {
  Example2() {
    LoopSimulator simulator(experiment);
    simulator.simulate(1, 0, record);
    strings.resize(479, experiment.probes);
    trammel::RandomStream random = run_stream(1, 0, DrawPurpose::kStrings);
    draw_distinct_strings(random, strings);
    trammel::RandomStream order = run_stream(1, 0, DrawPurpose::kTies);
    draw_tie_flags(order, 480, ties);
  }
  LoopExperiment experiment;
  ProbedRecord record;
  BinaryStrings strings;
  std::vector<char> ties;
};

void product_480(benchmark::State& state) {
  const Eigen::MatrixXd a = Eigen::MatrixXd::Random(480, 480);
  const Eigen::MatrixXd b = Eigen::MatrixXd::Random(480, 3);
  Eigen::MatrixXd c(480, 3);
  for ([[maybe_unused]] auto _ : state) {
    c.noalias() = a * b;
    benchmark::DoNotOptimize(c.data());
  }
}

void polygon(benchmark::State& state, ResidualForm form) {
  const Example2 data;
  ProbedResiduals residuals;
  LscrRegion region;
  PlanarWork work;
  PlanarRegion out;
  for ([[maybe_unused]] auto _ : state) {
    if (form == ResidualForm::kPrediction) {
      prediction_residuals(data.experiment.model, data.record, KnownTerms::kOnce, residuals);
    } else {
      plant_residuals(data.experiment.model, data.record, 0, {}, residuals);
    }
    region.assign(residuals, data.strings, data.ties, 6, form);
    benchmark::DoNotOptimize(exact_polygon(region, work, out));
    benchmark::DoNotOptimize(out.area);
  }
}

void polygon_published_form(benchmark::State& state) { polygon(state, ResidualForm::kPrediction); }
void polygon_full_residuals(benchmark::State& state) { polygon(state, ResidualForm::kPlant); }

void coverage_run(benchmark::State& state) {
  CoverageRunner runner(LoopExperiment{}, CoverageSettings{});
  CoverageCounts counts;
  std::uint64_t run = 0;
  for ([[maybe_unused]] auto _ : state) {
    runner.run(run++, counts);
  }
  benchmark::DoNotOptimize(counts.hits[0]);
}

}  // namespace

BENCHMARK(product_480);
BENCHMARK(polygon_published_form);
BENCHMARK(polygon_full_residuals);
BENCHMARK(coverage_run);
