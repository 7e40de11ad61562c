// SPDX-License-Identifier: Apache-2.0
/// @file
/// How often regions contain the true parameters: many simulated runs, on several threads.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>

#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/region/loop_experiment.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// What is counted. LSCR rows: channel 1, channel 2 and all channels together.
enum class CoverageRow {
  kPredictionFirst,
  kPredictionSecond,
  kPredictionJoint,
  kPlantFirst,
  kPlantSecond,
  kPlantJoint,
  kSps,
  kSelfNormalised
};
inline constexpr int kCoverageRows = 8;
inline constexpr std::string_view kCoverageNames[kCoverageRows] = {"paper_lscr_1",
                                                                   "paper_lscr_2",
                                                                   "paper_lscr_joint",
                                                                   "full_residual_lscr_1",
                                                                   "full_residual_lscr_2",
                                                                   "full_residual_lscr_joint",
                                                                   "sps_joint",
                                                                   "self_normalised_joint"};

/// Settings of a coverage study; the levels are those of example 2 of Amelin (2013).
struct CoverageSettings {
  int runs = 20000;
  int members = 480;      ///< M of LSCR
  int excluded = 6;       ///< q of LSCR
  int sps_members = 100;  ///< m
  int sps_excluded = 5;   ///< q
  double delta = 0.0125;  ///< of each channel of the self-normalised region; rho2 is the number of probes
  std::uint64_t seed = 1;
  int threads = 1;
};

/// Number of runs in which each region contained the truth.
struct CoverageCounts {
  int runs = 0;
  std::array<int, kCoverageRows> hits{};

  [[nodiscard]] double share(CoverageRow row) const {
    return static_cast<double>(hits[static_cast<std::size_t>(row)]) / runs;
  }
};

/// One thread's work space; only the first run allocates.
class CoverageRunner {
 public:
  CoverageRunner(const LoopExperiment& experiment, const CoverageSettings& settings);
  ~CoverageRunner();
  CoverageRunner(const CoverageRunner&) = delete;
  CoverageRunner& operator=(const CoverageRunner&) = delete;

  /// Adds run number `run` to the counts.
  void run(std::uint64_t run, CoverageCounts& counts);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

/// Runs the study on settings.threads threads; the same counts for any number of them. `observer` hears of
/// the progress from the calling thread.
[[nodiscard]] CoverageCounts study_coverage(const LoopExperiment& experiment,
                                            const CoverageSettings& settings,
                                            const ProgressObserver& observer = {});

}  // namespace trammel::inline TRAMMEL_ABI::region

#ifndef TRAMMEL_COMPILED
#include "trammel/region/coverage_impl.hpp"
#endif
