// SPDX-License-Identifier: Apache-2.0
// Statistical targets, with bands of four standard errors, and the independence of threads.
#include <gtest/gtest.h>

#include "heap_watch.hpp"
#include "trammel/region/coverage.hpp"
#include "trammel/region/planar.hpp"

namespace {

using namespace trammel::region;

constexpr int kRuns = 2000;

CoverageCounts study(LoopNoise noise, LoopFeedback feedback, ProbeLaw probe, int runs = kRuns) {
  LoopExperiment experiment;
  experiment.noise = noise;
  experiment.feedback = feedback;
  experiment.probe = probe;
  CoverageSettings settings;
  settings.runs = runs;
  settings.seed = 77;
  settings.threads = 2;
  return study_coverage(experiment, settings);
}

void expect_in_band(double share, double low = 0.961, double high = 0.989) {
  EXPECT_GE(share, low);
  EXPECT_LE(share, high);
}

void expect_exact_regions(const CoverageCounts& counts) {
  expect_in_band(counts.share(CoverageRow::kPlantFirst));
  expect_in_band(counts.share(CoverageRow::kPlantSecond));
  EXPECT_GE(counts.share(CoverageRow::kPlantJoint), 0.93);
  expect_in_band(counts.share(CoverageRow::kSps), 0.9305, 0.9695);
  EXPECT_GE(counts.share(CoverageRow::kSelfNormalised), 0.975);
}

TEST(RegionCoverage, Example2) {
  const CoverageCounts counts = study(LoopNoise::kGaussianBias, LoopFeedback::kDeadBeat, ProbeLaw::kSigns);
  EXPECT_EQ(counts.runs, kRuns);
  expect_exact_regions(counts);
  expect_in_band(counts.share(CoverageRow::kPredictionFirst));
  expect_in_band(counts.share(CoverageRow::kPredictionSecond));
}

TEST(RegionCoverage, HeavyTails) {
  expect_exact_regions(study(LoopNoise::kCauchyCubed, LoopFeedback::kPlaced, ProbeLaw::kUniform));
}

TEST(RegionCoverage, SelfTuningFeedback) {
  expect_exact_regions(study(LoopNoise::kGaussianBias, LoopFeedback::kSelfTuning, ProbeLaw::kSigns));
}

/// Constant noise and signs: only the random order of ties keeps the level.
TEST(RegionCoverage, Ties) {
  expect_exact_regions(study(LoopNoise::kConstant, LoopFeedback::kDeadBeat, ProbeLaw::kSigns));
}

TEST(RegionCoverage, AdversarialFeedbackBreaksThePublishedForm) {
  const CoverageCounts counts = study(LoopNoise::kHalf, LoopFeedback::kAdversarial, ProbeLaw::kSigns);
  EXPECT_LT(counts.share(CoverageRow::kPredictionFirst), 0.88);
  expect_exact_regions(counts);
}

/// When the noise reacts to past probes only the self-normalised region keeps its level.
TEST(RegionCoverage, ReactingNoise) {
  const CoverageCounts counts = study(LoopNoise::kReacting, LoopFeedback::kDeadBeat, ProbeLaw::kSigns);
  EXPECT_LT(counts.share(CoverageRow::kPlantFirst), 0.88);
  EXPECT_LT(counts.share(CoverageRow::kSps), 0.88);
  EXPECT_GE(counts.share(CoverageRow::kSelfNormalised), 0.975);
}

TEST(RegionCoverage, SameCountsForAnyNumberOfThreads) {
  const LoopExperiment experiment;
  CoverageSettings settings;
  settings.runs = 130;  // not a multiple of the blocks that threads take
  settings.members = 40;
  settings.excluded = 4;
  settings.seed = 5;
  const CoverageCounts one = study_coverage(experiment, settings);
  double last = 0.0;
  for (const int threads : {2, 3, 7}) {
    settings.threads = threads;
    const CoverageCounts many = study_coverage(experiment, settings, [&](const trammel::Progress& progress) {
      EXPECT_GE(progress.fraction, 0.0);
      EXPECT_LE(progress.fraction, 1.0);
      last = progress.fraction;
    });
    EXPECT_EQ(many.runs, one.runs);
    EXPECT_EQ(many.hits, one.hits);
  }
  settings.seed = 6;
  EXPECT_NE(study_coverage(experiment, settings).hits, one.hits);
  EXPECT_GE(last, 0.0);
}

TEST(RegionCoverage, NoAllocationPerRun) {
  for (const LoopFeedback feedback :
       {LoopFeedback::kDeadBeat, LoopFeedback::kSelfTuning, LoopFeedback::kAdversarial}) {
    LoopExperiment experiment;
    experiment.feedback = feedback;
    CoverageRunner runner(experiment, CoverageSettings{});
    CoverageCounts counts;
    runner.run(0, counts);
    const long before = trammel::test::allocation_count();
    for (std::uint64_t run = 1; run < 20; ++run) {
      runner.run(run, counts);
    }
    EXPECT_EQ(trammel::test::allocation_count(), before) << "feedback " << static_cast<int>(feedback);
  }
}

TEST(RegionCoverage, NoAllocationPerPolygonOnceGrown) {
  const LoopExperiment experiment;
  LoopSimulator simulator(experiment);
  ProbedRecord record;
  ProbedResiduals prediction;
  ProbedResiduals plant;
  BinaryStrings strings;
  strings.resize(479, experiment.probes);
  std::vector<char> ties(479, 0);
  LscrRegion region;
  PlanarWork work;
  PlanarRegion polygon;
  const auto pass = [&](std::uint64_t run) {
    simulator.simulate(3, run, record);
    trammel::RandomStream random = run_stream(3, run, DrawPurpose::kStrings);
    draw_distinct_strings(random, strings);
    prediction_residuals(experiment.model, record, KnownTerms::kOnce, prediction);
    region.assign(prediction, strings, ties, 6, ResidualForm::kPrediction);
    EXPECT_TRUE(exact_polygon(region, work, polygon));
    plant_residuals(experiment.model, record, 0, {}, plant);
    region.assign(plant, strings, ties, 6, ResidualForm::kPlant);
    (void)exact_polygon(region, work, polygon);
  };
  for (std::uint64_t run = 0; run < 10; ++run) {
    pass(run);
  }
  const long before = trammel::test::allocation_count();
  for (std::uint64_t run = 0; run < 10; ++run) {
    pass(run);
  }
  EXPECT_EQ(trammel::test::allocation_count(), before);
}

}  // namespace
