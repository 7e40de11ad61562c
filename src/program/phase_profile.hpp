// SPDX-License-Identifier: Apache-2.0
/// @file
/// Where the time of a command went.
#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <vector>

#include "trammel/core/progress.hpp"

namespace trammel::program {

/// Adds up the time of each phase that progress is told of: a phase lasts from its first report to the first
/// of another one.
class PhaseProfile {
 public:
  /// Ends the phase that runs and begins this one.
  void enter(std::string_view phase);

  /// Observer that takes the time and hands on to `next`, which may be empty. Must not outlive this object.
  [[nodiscard]] ProgressObserver observer(ProgressObserver next);

  /// Ends the phase that runs. One line per phase, in the order they began: seconds, share, name; and the
  /// sum.
  [[nodiscard]] std::string table();

 private:
  using Clock = std::chrono::steady_clock;
  struct Phase {
    std::string name;
    double seconds = 0.0;
  };

  std::vector<Phase> phases_;
  std::size_t current_ = 0;
  Clock::time_point begin_;
};

}  // namespace trammel::program
