// SPDX-License-Identifier: Apache-2.0
/// @file
/// Progress of long work, told to whoever wants to know.
#pragma once

#include <functional>
#include <string_view>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// One report of progress.
struct Progress {
  std::string_view phase;  ///< what is being done, in a few words
  double fraction = 0.0;   ///< done so far, 0 to 1, never decreasing within one phase
};

/// Called now and then by long work, always from the thread that called the library. Empty: not told.
using ProgressObserver = std::function<void(const Progress&)>;

}  // namespace trammel::inline TRAMMEL_ABI
