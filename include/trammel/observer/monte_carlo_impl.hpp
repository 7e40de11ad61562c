// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of monte_carlo.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/core/normal_lanes.hpp"
#include "trammel/core/packet.hpp"
#include "trammel/core/parallel.hpp"
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

/// Start of one run.
[[nodiscard]] inline Eigen::Vector3d draw_start(RandomStream random, const FlightLoop& loop,
                                                const Eigen::Matrix3d& factor, double largest_x) {
  constexpr int kMaxDraws = 100000;
  for (int draw = 0; draw < kMaxDraws; ++draw) {
    Eigen::Vector3d normal;
    for (double& value : normal) {
      value = random.normal();
    }
    const Eigen::Vector3d start = loop.prior().position_m + factor * normal;
    if (start.x() <= largest_x) {
      return start;
    }
  }
  throw Error(
      {"max_start_x_m", shortest(largest_x), "a limit that the prior meets at least once in 100000 draws"});
}

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
    result_.paths.resize(std::min(runs, static_cast<std::size_t>(std::max(settings.sample_paths, 0))));
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

  [[nodiscard]] std::int64_t blocks() const { return blocks_; }

  /// Flies the runs of one block; blocks may be flown at the same time.
  void fly_block(std::int64_t block) {
    const std::int64_t last = std::min(settings_.runs, (block + 1) * kRunsPerBlock);
    for (std::int64_t run = block * kRunsPerBlock; run < last;) {
      if (loop_.settings().filter == FilterKind::kExtendedKalman) {
        run += fly_lanes<Packet>(block, run, last);
      } else {
        run += fly_lanes<double>(block, run, last);
      }
    }
  }

  MonteCarloResult finish() {
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
    return std::move(result_);
  }

 private:
  /// Runs from `first` on, as many as Real has lanes, but none from `last` on.
  template <class Real>
  std::int64_t fly_lanes(std::int64_t block, std::int64_t first, std::int64_t last) {
    SpreadSums* const sums = &sums_[static_cast<std::size_t>(block) * moments_.size()];
    const auto begin = static_cast<std::size_t>(first);
    const std::size_t count = std::min(static_cast<std::size_t>(last - first), kLanesOf<Real>);
    // Lanes beyond the last run fly as well; nobody looks at them.
    Vector3<Real> start;
    for (std::size_t lane = 0; lane < kLanesOf<Real>; ++lane) {
      const Eigen::Vector3d drawn =
          draw_start(RandomStream(settings_.seed, begin + std::min(lane, count - 1)), loop_, factor_,
                     settings_.max_start_x_m);
      for (int i = 0; i < 3; ++i) {
        set_lane(start[i], lane, drawn[i]);
      }
    }
    const std::size_t sampled =
        begin < result_.paths.size() ? std::min(count, result_.paths.size() - begin) : 0;
    std::size_t event_index = 0;
    std::size_t moment = 0;
    const auto watch = [&](const FlightEvent& event, const Vector3<Real>& truth, const auto& filter) {
      for (std::size_t lane = 0; lane < sampled; ++lane) {
        const auto of_lane = [&](const Real& value) { return lane_of(value, lane); };
        SamplePath& path = result_.paths[begin + lane];
        path.times_s.push_back(event.time_s);
        path.truth_m.emplace_back(truth.unaryExpr(of_lane));
        path.estimate_m.emplace_back(filter.position().unaryExpr(of_lane));
      }
      if (moment < moments_.size() && event_index++ == moments_[moment]) {
        const Real error = filter.position().x() - truth.x();
        for (std::size_t lane = 0; lane < count; ++lane) {
          const double of_lane = lane_of(error, lane);
          sums[moment].error += of_lane;
          sums[moment].error_square += of_lane * of_lane;
          sums[moment].variance += lane_of(filter.variance_x(), lane);
        }
        ++moment;
      }
    };
    NormalLanes<Real> noise(settings_.seed, begin);
    std::array<FlightOutcome, kLanesOf<Real>> outcomes;
    if constexpr (kLanesOf<Real> == 1) {
      outcomes[0] = loop_.fly(start, noise, watch);
    } else {
      outcomes = loop_.fly_lanes<Real>(start, noise, watch);
    }
    for (std::size_t lane = 0; lane < count; ++lane) {
      const FlightOutcome& outcome = outcomes[lane];
      const std::size_t run = begin + lane;
      result_.error_x_m[run] = outcome.error.x();
      result_.miss_m[run] = outcome.miss_m;
      result_.effort_m[run] = outcome.effort_m;
      result_.nees[run] = outcome.nees;
      variance_x_[run] = outcome.covariance(0, 0);
      moved_back_[run] = static_cast<std::int8_t>(outcome.moved_back > 0);
      skipped_[run] = outcome.skipped;
    }
    return static_cast<std::int64_t>(count);
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
};

}  // namespace detail

TRAMMEL_INLINE double quantile(std::vector<double> values, double probability) {
  if (values.empty()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const double place = probability * static_cast<double>(values.size() - 1);
  const auto below = values.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(values.begin(), below, values.end());
  const auto above = below + 1 == values.end() ? below : std::min_element(below + 1, values.end());
  return *below + (place - std::floor(place)) * (*above - *below);
}

TRAMMEL_INLINE MonteCarloResult simulate(const FlightLoop& loop, const MonteCarloSettings& settings,
                                         const ProgressObserver& observe) {
  if (settings.runs < 1) {
    throw Error({"runs", std::to_string(settings.runs), "at least 1"});
  }
  require(!std::isnan(settings.max_start_x_m), "max_start_x_m", "not a number", "a number");
  detail::Simulation simulation(loop, settings);
  const auto blocks = static_cast<std::size_t>(simulation.blocks());
  for_each_in_parallel(
      blocks, settings.threads,
      [&](std::size_t block) { simulation.fly_block(static_cast<std::int64_t>(block)); },
      [&](std::size_t done) {
        if (observe) {
          observe({"simulate flights", static_cast<double>(done) / static_cast<double>(blocks)});
        }
      });
  return simulation.finish();
}

}  // namespace trammel::inline TRAMMEL_ABI::observer
