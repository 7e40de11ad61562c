// SPDX-License-Identifier: Apache-2.0
#include "terminal_progress.hpp"

#include <cmath>
#include <cstdio>

#include <unistd.h>

namespace trammel::program {

namespace {

constexpr std::chrono::milliseconds kBeforeFirst{500};
constexpr std::chrono::milliseconds kBetween{100};
constexpr const char* kClearLine = "\r\033[K";

}  // namespace

std::string describe_duration(double seconds) {
  constexpr long kMinute = 60;
  constexpr long kHour = 3600;
  const long whole = std::lround(std::ceil(seconds));
  if (whole >= kHour) {
    return std::to_string(whole / kHour) + " h " + std::to_string(whole % kHour / kMinute) + " min";
  }
  return (whole >= kMinute ? std::to_string(whole / kMinute) + " min " : "") +
         std::to_string(whole % kMinute) + " s";
}

TerminalProgress::TerminalProgress()
    : on_terminal_(::isatty(STDERR_FILENO) == 1), phase_begin_(Clock::now()), last_drawn_(phase_begin_) {}

TerminalProgress::~TerminalProgress() {
  if (drawn_) {
    std::fputs(kClearLine, stderr);
  }
}

ProgressObserver TerminalProgress::observer() {
  if (!on_terminal_) {
    return {};
  }
  return [this](const Progress& progress) { show(progress); };
}

void TerminalProgress::show(const Progress& progress) {
  const Clock::time_point now = Clock::now();
  if (progress.phase != phase_) {
    phase_ = progress.phase;
    phase_begin_ = now;
  }
  if (now - last_drawn_ < (drawn_ ? kBetween : kBeforeFirst)) {
    return;
  }
  last_drawn_ = now;
  drawn_ = true;
  std::string line = phase_ + "  " + std::to_string(std::lround(100 * progress.fraction)) + " %";
  if (progress.fraction > 0.0 && progress.fraction < 1.0) {
    const double passed = std::chrono::duration<double>(now - phase_begin_).count();
    line += ", about " + describe_duration(passed * (1.0 - progress.fraction) / progress.fraction) + " left";
  }
  std::fprintf(stderr, "%s%s", kClearLine, line.c_str());
  std::fflush(stderr);
}

}  // namespace trammel::program
