// SPDX-License-Identifier: Apache-2.0
/// @file
/// Progress on a terminal: one line on the error output, with the remaining time.
#pragma once

#include <chrono>
#include <string>

#include "trammel/core/progress.hpp"

namespace trammel::program {

/// Draws progress on standard error if that is a terminal, and removes it at the end. Work shorter than half
/// a second shows nothing.
class TerminalProgress {
 public:
  TerminalProgress();
  ~TerminalProgress();
  TerminalProgress(const TerminalProgress&) = delete;
  TerminalProgress& operator=(const TerminalProgress&) = delete;

  /// Observer that draws on this line; empty if standard error is not a terminal. Must not outlive it.
  [[nodiscard]] ProgressObserver observer();

 private:
  using Clock = std::chrono::steady_clock;

  void show(const Progress& progress);

  bool on_terminal_;
  bool drawn_ = false;
  std::string phase_;
  Clock::time_point phase_begin_;
  Clock::time_point last_drawn_;
};

/// "2 min 5 s", "3 s".
[[nodiscard]] std::string describe_duration(double seconds);

}  // namespace trammel::program
