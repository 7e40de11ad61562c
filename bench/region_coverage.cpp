// SPDX-License-Identifier: Apache-2.0
// Coverage tables of the confidence regions: region_coverage [runs] [threads] [seed]
#include <unistd.h>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include "trammel/region/coverage.hpp"

namespace {

using trammel::region::LoopFeedback;
using trammel::region::LoopNoise;
using trammel::region::ProbeLaw;

struct Row {
  const char* title;
  LoopNoise noise;
  LoopFeedback feedback;
  ProbeLaw probe;
};

constexpr Row kRows[] = {
    {"N(0.5, 0.1), dead-beat, signs", LoopNoise::kGaussianBias, LoopFeedback::kDeadBeat, ProbeLaw::kSigns},
    {"N(0.5, 0.1), placed, signs", LoopNoise::kGaussianBias, LoopFeedback::kPlaced, ProbeLaw::kSigns},
    {"constant 20, dead-beat, uniform", LoopNoise::kConstant, LoopFeedback::kDeadBeat, ProbeLaw::kUniform},
    {"deterministic, placed, uniform", LoopNoise::kDeterministic, LoopFeedback::kPlaced, ProbeLaw::kUniform},
    {"Cauchy, dead-beat, signs", LoopNoise::kCauchy, LoopFeedback::kDeadBeat, ProbeLaw::kSigns},
    {"Cauchy cubed, placed, uniform", LoopNoise::kCauchyCubed, LoopFeedback::kPlaced, ProbeLaw::kUniform},
    {"1.01^t, dead-beat, uniform", LoopNoise::kGrowing, LoopFeedback::kDeadBeat, ProbeLaw::kUniform},
    {"0.05 t, dead-beat, uniform", LoopNoise::kRamp, LoopFeedback::kDeadBeat, ProbeLaw::kUniform},
    {"N(0.5, 0.1), self-tuning, signs", LoopNoise::kGaussianBias, LoopFeedback::kSelfTuning,
     ProbeLaw::kSigns},
    {"0.5, adversarial, signs", LoopNoise::kHalf, LoopFeedback::kAdversarial, ProbeLaw::kSigns},
    {"reacting noise, dead-beat, signs", LoopNoise::kReacting, LoopFeedback::kDeadBeat, ProbeLaw::kSigns},
};

/// A bar on the terminal with the time left, nothing when stderr is not one.
class ProgressBar {
 public:
  ProgressBar(int tables, int total) : first_(tables), total_(total) {}
  void operator()(const trammel::Progress& progress) const {
    if (isatty(STDERR_FILENO) == 0) {
      return;
    }
    constexpr int kWidth = 40;
    const double fraction = (first_ + progress.fraction) / total_;
    const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    const auto filled = static_cast<int>(fraction * kWidth);
    const double left =
        progress.fraction > 0.0 ? elapsed / progress.fraction * (total_ - first_ - progress.fraction) : 0.0;
    std::fprintf(stderr, "\r[%s%s] %5.1f %%  %4.0f s left ", std::string(filled, '#').c_str(),
                 std::string(kWidth - filled, '.').c_str(), 100.0 * fraction, left);
    if (fraction >= 1.0) {
      std::fprintf(stderr, "\n");
    }
  }

 private:
  int first_;
  int total_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

int main(int argc, char** argv) {
  using trammel::region::CoverageRow;
  trammel::region::CoverageSettings settings;
  settings.runs = argc > 1 ? std::atoi(argv[1]) : settings.runs;
  settings.threads =
      argc > 2 ? std::atoi(argv[2]) : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  settings.seed = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : settings.seed;
  std::printf(
      "Share of %d runs in which the region contains the truth (%d probes, M = %d, q = %d: 0.975 per "
      "channel, 0.95 joint; SPS 0.95; self-normalised at least 0.975)\n\n",
      settings.runs, trammel::region::LoopExperiment{}.probes, settings.members, settings.excluded);
  std::printf(
      "| noise, feedback, probe | paper form 1, 2, joint | full residual 1, 2, joint | SPS | "
      "self-normalised |\n|---|---|---|---|---|\n");
  const auto start = std::chrono::steady_clock::now();
  int table = 0;
  for (const Row& row : kRows) {
    trammel::region::LoopExperiment experiment;
    experiment.noise = row.noise;
    experiment.feedback = row.feedback;
    experiment.probe = row.probe;
    const ProgressBar bar(table++, static_cast<int>(std::size(kRows)));
    const trammel::region::CoverageCounts counts = trammel::region::study_coverage(experiment, settings, bar);
    const auto share = [&](CoverageRow which) { return counts.share(which); };
    std::printf("| %s | %.4f %.4f %.4f | %.4f %.4f %.4f | %.4f | %.4f |\n", row.title,
                share(CoverageRow::kPredictionFirst), share(CoverageRow::kPredictionSecond),
                share(CoverageRow::kPredictionJoint), share(CoverageRow::kPlantFirst),
                share(CoverageRow::kPlantSecond), share(CoverageRow::kPlantJoint), share(CoverageRow::kSps),
                share(CoverageRow::kSelfNormalised));
    std::fflush(stdout);
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::fprintf(stderr, "%.1f s on %d threads\n", seconds, settings.threads);
  return 0;
}
