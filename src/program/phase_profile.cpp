// SPDX-License-Identifier: Apache-2.0
#include "phase_profile.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

namespace trammel::program {

void PhaseProfile::enter(std::string_view phase) {
  const Clock::time_point now = Clock::now();
  if (!phases_.empty()) {
    if (phases_[current_].name == phase) {
      return;
    }
    phases_[current_].seconds += std::chrono::duration<double>(now - begin_).count();
  }
  begin_ = now;
  const auto known = std::find_if(phases_.begin(), phases_.end(),
                                  [phase](const Phase& other) { return other.name == phase; });
  current_ = static_cast<std::size_t>(known - phases_.begin());
  if (known == phases_.end()) {
    phases_.push_back({.name = std::string(phase)});
  }
}

ProgressObserver PhaseProfile::observer(ProgressObserver next) {
  return [this, next = std::move(next)](const Progress& progress) {
    enter(progress.phase);
    if (next) {
      next(progress);
    }
  };
}

std::string PhaseProfile::table() {
  if (phases_.empty()) {
    return {};
  }
  const Clock::time_point now = Clock::now();
  phases_[current_].seconds += std::chrono::duration<double>(now - begin_).count();
  begin_ = now;
  double total = 0.0;
  for (const Phase& phase : phases_) {
    total += phase.seconds;
  }
  std::string text;
  const auto line = [&](double seconds, const std::string& name) {
    std::array<char, 64> numbers{};
    std::snprintf(numbers.data(), numbers.size(), "%10.3f s %5.1f %%  ", seconds,
                  total > 0.0 ? 100.0 * seconds / total : 0.0);
    text += numbers.data() + name + "\n";
  };
  for (const Phase& phase : phases_) {
    line(phase.seconds, phase.name);
  }
  line(total, "in all");
  return text;
}

}  // namespace trammel::program
