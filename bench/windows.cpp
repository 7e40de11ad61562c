// SPDX-License-Identifier: Apache-2.0
// Long flights by windows: time and memory per segment, certified gap. Usage: windows [SEGMENTS ...], rising
// (memory is the most the process ever held).
#include <sys/resource.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "trammel/problem/zoo.hpp"
#include "trammel/window/solve.hpp"

namespace {

using namespace trammel;

double peak_megabytes() {
  rusage usage{};
  (void)getrusage(RUSAGE_SELF, &usage);
  constexpr double kKilobytes = 1e-3;
  return kKilobytes * static_cast<double>(usage.ru_maxrss);
}

/// Processor seconds of this process.
double processor_s() {
  rusage usage{};
  (void)getrusage(RUSAGE_SELF, &usage);
  constexpr double kMicroseconds = 1e-6;
  return static_cast<double>(usage.ru_utime.tv_sec) +
         kMicroseconds * static_cast<double>(usage.ru_utime.tv_usec);
}

void measure(int segments) {
  const double before = peak_megabytes();
  const Scenario scenario = zoo::long_flight(segments).scenario;
  const double start = processor_s();
  const BandedProblem problem = assemble_banded(scenario);
  const double assembled = processor_s();
  const window::WindowSolution solution = window::solve_windows(problem);
  const double solved = processor_s();
  const window::BandedCertificate& proved = solution.certificate;
  std::printf("| %d | %td | %.2f | %.2f | %.0f (before %.0f) | %.9f | %.9f | %.1e | %s |\n", segments,
              solution.windows, 1e3 * (assembled - start) / segments, 1e3 * (solved - assembled) / segments,
              peak_megabytes(), before, std::sqrt(proved.lower), std::sqrt(proved.upper),
              (proved.upper - proved.lower) / proved.upper, to_string(proved.claim).data());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<int> counts;
  for (int i = 1; i < argc; ++i) {
    counts.push_back(std::atoi(argv[i]));
  }
  if (counts.empty()) {
    counts = {500, 1000, 2000, 5000};
  }
  std::puts(
      "| segments | windows | assembly ms/segment | solution and proof ms/segment | peak MB | lower m | "
      "upper m | gap | claim |\n|---|---|---|---|---|---|---|---|---|");
  for (const int count : counts) {
    measure(count);
  }
}
