// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of coverage.hpp.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "trammel/core/parallel.hpp"
#include "trammel/region/coverage.hpp"
#include "trammel/region/loop_experiment_impl.hpp"
#include "trammel/region/lscr_impl.hpp"
#include "trammel/region/self_normalised_impl.hpp"
#include "trammel/region/sps_impl.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

struct CoverageRunner::Work {
  explicit Work(const LoopExperiment& experiment, const CoverageSettings& run_settings)
      : settings(run_settings),
        simulator(experiment),
        truth(unknown_of(experiment.model, experiment.plant)),
        theta(impulse_parameters(experiment.plant, experiment.period)) {
    strings.resize(settings.members - 1, experiment.probes);
    signs.resize(settings.sps_members - 1, experiment.probes);
  }
  CoverageSettings settings;
  LoopSimulator simulator;
  Eigen::VectorXd truth;
  Eigen::VectorXd theta;
  ProbedRecord record;
  ProbedResiduals plant_part;
  ProbedResiduals prediction_part;
  BinaryStrings strings;
  BinaryStrings signs;
  std::vector<char> ties;
  std::vector<char> sign_ties;
  LscrRegion plant_region;
  LscrRegion prediction_region;
  SpsRegion sps;
  SelfNormalisedRegion self_normalised;
  ResidualFilter no_filter;
};

TRAMMEL_INLINE CoverageRunner::CoverageRunner(const LoopExperiment& experiment,
                                              const CoverageSettings& settings)
    : work_(std::make_unique<Work>(experiment, settings)) {
  require(settings.members >= 2, [&] {
    return ErrorDetail{"coverage: members", std::to_string(settings.members), "at least 2"};
  });
  require(settings.sps_members >= 2, [&] {
    return ErrorDetail{"coverage: sps_members", std::to_string(settings.sps_members), "at least 2"};
  });
}

TRAMMEL_INLINE CoverageRunner::~CoverageRunner() = default;

TRAMMEL_INLINE void CoverageRunner::run(std::uint64_t run, CoverageCounts& counts) {
  Work& work = *work_;
  const CoverageSettings& settings = work.settings;
  const LoopExperiment& experiment = work.simulator.experiment();
  work.simulator.simulate(settings.seed, run, work.record);
  RandomStream strings = run_stream(settings.seed, run, DrawPurpose::kStrings);
  RandomStream signs = run_stream(settings.seed, run, DrawPurpose::kSigns);
  RandomStream ties = run_stream(settings.seed, run, DrawPurpose::kTies);
  draw_distinct_strings(strings, work.strings);
  draw_strings(signs, work.signs);
  draw_tie_flags(ties, settings.members, work.ties);
  draw_tie_flags(ties, settings.sps_members, work.sign_ties);
  plant_residuals(experiment.model, work.record, 0, work.no_filter, work.plant_part);
  prediction_residuals(experiment.model, work.record, KnownTerms::kOnce, work.prediction_part);

  const auto count = [&](CoverageRow row, bool hit) {
    counts.hits[static_cast<std::size_t>(row)] += hit ? 1 : 0;
  };
  const auto count_lscr = [&](const LscrRegion& region, const Eigen::VectorXd& truth, CoverageRow first) {
    bool all = true;
    for (int channel = 0; channel < region.channels(); ++channel) {
      const bool hit = region.channel_contains(channel, truth);
      all = all && hit;
      if (channel < 2) {
        count(static_cast<CoverageRow>(static_cast<int>(first) + channel), hit);
      }
    }
    count(static_cast<CoverageRow>(static_cast<int>(first) + 2), all);
  };
  work.prediction_region.assign(work.prediction_part, work.strings, work.ties, settings.excluded,
                                ResidualForm::kPrediction);
  count_lscr(work.prediction_region, work.theta, CoverageRow::kPredictionFirst);
  work.plant_region.assign(work.plant_part, work.strings, work.ties, settings.excluded, ResidualForm::kPlant);
  count_lscr(work.plant_region, work.truth, CoverageRow::kPlantFirst);
  work.sps.assign(work.plant_part, work.signs, work.sign_ties, settings.sps_excluded);
  count(CoverageRow::kSps, work.sps.contains(work.truth));
  work.self_normalised.assign(work.plant_part, settings.delta, static_cast<double>(experiment.probes));
  count(CoverageRow::kSelfNormalised, work.self_normalised.contains(work.truth));
  counts.runs += 1;
}

TRAMMEL_INLINE CoverageCounts study_coverage(const LoopExperiment& experiment,
                                             const CoverageSettings& settings,
                                             const ProgressObserver& observer) {
  require(settings.runs >= 1, [&] {
    return ErrorDetail{"coverage: runs", std::to_string(settings.runs), "at least 1"};
  });
  require(settings.threads >= 1, [&] {
    return ErrorDetail{"coverage: threads", std::to_string(settings.threads), "at least 1"};
  });
  constexpr int kBlock = 50;  // runs taken at a time: a few milliseconds each
  const auto threads = static_cast<unsigned>(settings.threads);
  std::vector<CoverageCounts> counts(threads);
  for_each_with_own_work(
      static_cast<std::size_t>((settings.runs + kBlock - 1) / kBlock), threads,
      [&](std::size_t thread) {
        return
            [&, thread, runner = std::make_unique<CoverageRunner>(experiment, settings)](std::size_t block) {
              const int first = static_cast<int>(block) * kBlock;
              const int last = std::min(first + kBlock, settings.runs);
              for (int run = first; run < last; ++run) {
                runner->run(static_cast<std::uint64_t>(run), counts[thread]);
              }
            };
      },
      [&](std::size_t done) {
        if (observer) {
          const double runs = static_cast<double>(done) * kBlock;
          observer({"coverage", std::min(1.0, runs / settings.runs)});
        }
      });
  CoverageCounts total;
  for (const CoverageCounts& own : counts) {
    total.runs += own.runs;
    for (std::size_t row = 0; row < total.hits.size(); ++row) {
      total.hits[row] += own.hits[row];
    }
  }
  return total;
}

}  // namespace trammel::inline TRAMMEL_ABI::region
