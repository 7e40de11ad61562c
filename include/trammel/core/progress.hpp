// SPDX-License-Identifier: Apache-2.0
/// @file
/// Progress of long work, told to whoever wants to know.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// One report of progress.
struct Progress {
  std::string_view phase;  ///< what is being done, in a few words
  double fraction = 0.0;   ///< done so far, 0 to 1, never decreasing within one phase
};

/// Called now and then by long work, always from the thread that called the library. Empty: not told.
using ProgressObserver = std::function<void(const Progress&)>;

/// `observe` behind a guard that holds what Progress promises where several steps report under one phase: a
/// fraction that would go back, or that is not a number, is told as the largest so far. Empty for none.
[[nodiscard]] inline ProgressObserver steady(ProgressObserver observe) {
  if (!observe) {
    return observe;
  }
  return [observe = std::move(observe), phase = std::string(), last = 0.0](const Progress& progress) mutable {
    if (progress.phase != phase) {
      phase = progress.phase;
      last = 0.0;
    }
    if (progress.fraction > last) {
      last = progress.fraction < 1.0 ? progress.fraction : 1.0;
    }
    observe({.phase = progress.phase, .fraction = last});
  };
}

}  // namespace trammel::inline TRAMMEL_ABI
