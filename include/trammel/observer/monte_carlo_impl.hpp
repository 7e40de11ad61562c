// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of monte_carlo.hpp.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <string>
#include <thread>

#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/observer/monte_carlo.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

namespace detail {

/// Runs per work item: its sums are formed in order of the runs, and the items' sums in order of the items,
/// so that no sum depends on which thread did what.
inline constexpr std::int64_t kRunsPerBlock = 64;
/// Moments at which the spread is recorded, at most.
inline constexpr std::size_t kMaxSpreadPoints = 200;

/// Sums of one block at the recorded moments.
struct SpreadSums {
  double error = 0.0;
  double error_square = 0.0;
  double variance = 0.0;
};

/// A source of noise and starts for one run.
class RunRandom {
 public:
  RunRandom(std::uint64_t seed, std::int64_t run) : stream_(seed, static_cast<std::uint64_t>(run)) {}

  Eigen::Vector3d start(const FlightLoop& loop, const Eigen::Matrix3d& factor, double largest_x) {
    constexpr int kMaxDraws = 100000;
    for (int draw = 0; draw < kMaxDraws; ++draw) {
      Eigen::Vector3d normal;
      for (double& value : normal) {
        value = stream_.normal();
      }
      const Eigen::Vector3d start = loop.prior().position_m + factor * normal;
      if (start.x() <= largest_x) {
        return start;
      }
    }
    throw Error({"max_start_x_m", std::to_string(largest_x),
                 "a limit that the prior meets at least once in 100000 draws"});
  }

  Eigen::Vector2d operator()() {
    const double first = stream_.normal();
    return {first, stream_.normal()};
  }

 private:
  RandomStream stream_;
};

[[nodiscard]] inline MeanDeviation mean_deviation(const std::vector<double>& values) {
  const auto count = static_cast<double>(values.size());
  MeanDeviation result;
  double sum = 0.0;
  for (const double value : values) {
    sum += value;
  }
  result.mean = values.empty() ? std::numeric_limits<double>::quiet_NaN() : sum / count;
  double square = 0.0;
  for (const double value : values) {
    square += (value - result.mean) * (value - result.mean);
  }
  if (values.size() > 1) {
    result.deviation = std::sqrt(square / (count - 1.0));
  }
  return result;
}

/// The simulation while it runs.
class Simulation {
 public:
  Simulation(const FlightLoop& loop, const MonteCarloSettings& settings)
      : loop_(loop),
        settings_(settings),
        blocks_((settings.runs + kRunsPerBlock - 1) / kRunsPerBlock),
        factor_(linalg::Cholesky3(loop.prior().covariance_m2).matrixL()) {
    const auto runs = static_cast<std::size_t>(settings.runs);
    result_.error_x_m.resize(runs);
    result_.miss_m.resize(runs);
    result_.effort_m.resize(runs);
    result_.nees.resize(runs);
    variance_x_.resize(runs);
    moved_back_.resize(runs);
    skipped_.resize(runs);
    const std::size_t events = loop.events().size();
    const std::size_t stride = (events + kMaxSpreadPoints - 1) / kMaxSpreadPoints;
    for (std::size_t k = 0; k < events; k += stride) {
      moments_.push_back(k);
    }
    if (moments_.back() != events - 1) {
      moments_.push_back(events - 1);
    }
    sums_.resize(static_cast<std::size_t>(blocks_) * moments_.size());
  }

  /// Works until no block is left; `tell` is called after every block.
  template <class Tell>
  void work(const Tell& tell) noexcept {
    try {
      for (std::int64_t block = next_++; block < blocks_ && !failed_; block = next_++) {
        fly_block(block);
        ++done_;
        tell();
      }
    } catch (...) {
      const std::scoped_lock lock(mutex_);
      if (!failed_) {
        failure_ = std::current_exception();
        failed_ = true;
      }
    }
  }

  [[nodiscard]] double fraction() const { return static_cast<double>(done_) / static_cast<double>(blocks_); }
  [[nodiscard]] std::int64_t blocks() const { return blocks_; }

  MonteCarloResult finish() {
    if (failed_) {
      std::rethrow_exception(failure_);
    }
    result_.error = mean_deviation(result_.error_x_m);
    result_.miss = mean_deviation(result_.miss_m);
    result_.effort = mean_deviation(result_.effort_m);
    result_.rms_predicted_m = std::sqrt(mean_deviation(variance_x_).mean);
    result_.median_nees = quantile(result_.nees, 0.5);
    for (std::size_t run = 0; run < moved_back_.size(); ++run) {
      result_.runs_moved_back += moved_back_[run];
      result_.skipped += skipped_[run];
    }
    collect_spread();
    const std::int64_t kept = std::min<std::int64_t>(settings_.sample_paths, settings_.runs);
    for (std::int64_t run = 0; run < kept; ++run) {
      result_.paths.push_back(sample_path(run));
    }
    return std::move(result_);
  }

 private:
  void fly_block(std::int64_t block) {
    SpreadSums* const sums = &sums_[static_cast<std::size_t>(block) * moments_.size()];
    const std::int64_t last = std::min(settings_.runs, (block + 1) * kRunsPerBlock);
    for (std::int64_t run = block * kRunsPerBlock; run < last; ++run) {
      RunRandom random(settings_.seed, run);
      const Eigen::Vector3d start = random.start(loop_, factor_, settings_.max_start_x_m);
      std::size_t event_index = 0;
      std::size_t moment = 0;
      const FlightOutcome outcome =
          loop_.fly(start, random, [&](const FlightEvent&, const Eigen::Vector3d& truth, const auto& filter) {
            if (moment < moments_.size() && event_index++ == moments_[moment]) {
              const double error = filter.position().x() - truth.x();
              sums[moment].error += error;
              sums[moment].error_square += error * error;
              sums[moment].variance += filter.variance_x();
              ++moment;
            }
          });
      const auto index = static_cast<std::size_t>(run);
      result_.error_x_m[index] = outcome.error.x();
      result_.miss_m[index] = outcome.miss_m;
      result_.effort_m[index] = outcome.effort_m;
      result_.nees[index] = outcome.nees;
      variance_x_[index] = outcome.covariance(0, 0);
      moved_back_[index] = static_cast<std::int8_t>(outcome.moved_back > 0);
      skipped_[index] = outcome.skipped;
    }
  }

  void collect_spread() {
    const auto count = static_cast<double>(settings_.runs);
    for (std::size_t m = 0; m < moments_.size(); ++m) {
      SpreadSums total;
      for (std::int64_t block = 0; block < blocks_; ++block) {
        const SpreadSums& part = sums_[static_cast<std::size_t>(block) * moments_.size() + m];
        total.error += part.error;
        total.error_square += part.error_square;
        total.variance += part.variance;
      }
      SpreadPoint point;
      point.time_s = loop_.events()[moments_[m]].time_s;
      point.mean_error_x_m = total.error / count;
      const double square = total.error_square - count * point.mean_error_x_m * point.mean_error_x_m;
      point.sd_error_x_m = settings_.runs > 1 ? std::sqrt(std::max(square, 0.0) / (count - 1.0))
                                              : std::numeric_limits<double>::quiet_NaN();
      point.rms_predicted_x_m = std::sqrt(total.variance / count);
      result_.spread.push_back(point);
    }
  }

  [[nodiscard]] SamplePath sample_path(std::int64_t run) const {
    RunRandom random(settings_.seed, run);
    SamplePath path;
    const Eigen::Vector3d start = random.start(loop_, factor_, settings_.max_start_x_m);
    (void)loop_.fly(start, random,
                    [&](const FlightEvent& event, const Eigen::Vector3d& truth, const auto& filter) {
                      path.times_s.push_back(event.time_s);
                      path.truth_m.push_back(truth);
                      path.estimate_m.push_back(filter.position());
                    });
    return path;
  }

  const FlightLoop& loop_;
  MonteCarloSettings settings_;
  std::int64_t blocks_;
  Eigen::Matrix3d factor_;
  std::vector<std::size_t> moments_;  ///< events at which the spread is recorded
  std::vector<SpreadSums> sums_;      ///< blocks x moments
  std::vector<double> variance_x_;
  std::vector<std::int8_t> moved_back_;
  std::vector<std::int64_t> skipped_;
  MonteCarloResult result_;
  std::atomic<std::int64_t> next_{0};
  std::atomic<std::int64_t> done_{0};
  std::atomic<bool> failed_{false};
  std::mutex mutex_;
  std::exception_ptr failure_;
};

}  // namespace detail

TRAMMEL_INLINE double quantile(std::vector<double> values, double probability) {
  if (values.empty()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  std::sort(values.begin(), values.end());
  const double place = probability * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
}

TRAMMEL_INLINE MonteCarloResult simulate(const FlightLoop& loop, const MonteCarloSettings& settings,
                                         const ProgressObserver& observe) {
  if (settings.runs < 1) {
    throw Error({"runs", std::to_string(settings.runs), "at least 1"});
  }
  require(!std::isnan(settings.max_start_x_m), "max_start_x_m", "not a number", "a number");
  detail::Simulation simulation(loop, settings);
  const unsigned wanted =
      settings.threads > 0 ? settings.threads : std::max(1U, std::thread::hardware_concurrency());
  const auto threads = static_cast<unsigned>(std::min<std::int64_t>(wanted, simulation.blocks()));
  std::vector<std::thread> helpers;
  for (unsigned i = 1; i < threads; ++i) {
    helpers.emplace_back([&simulation] { simulation.work([] {}); });
  }
  simulation.work([&] {
    if (observe) {
      observe({"simulate flights", simulation.fraction()});
    }
  });
  for (std::thread& helper : helpers) {
    helper.join();
  }
  return simulation.finish();
}

}  // namespace trammel::inline TRAMMEL_ABI::observer
