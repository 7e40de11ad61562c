// SPDX-License-Identifier: Apache-2.0
// How time and memory grow with the number of parameters: long flights solved and proved whole.
//   ./scaling [--threads N] SEGMENTS...          rows of a table; the last line is the slope of log time
// A number like 98x100 has the covariances times 100. Products are those of Eigen, p x p, one thread,
// measured before each solution. Run one size per process where the memory matters: it is the peak of the
// process.
#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trammel/certify/certificate.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Of the processor, by all threads of this process.
double seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  constexpr double kNano = 1e-9;
  return static_cast<double>(time.tv_sec) + kNano * static_cast<double>(time.tv_nsec);
}

/// Fastest of several products.
double product_seconds(Eigen::Index p) {
  constexpr int kTimes = 7;
  const Eigen::MatrixXd a = Eigen::MatrixXd::Random(p, p);
  const Eigen::MatrixXd b = Eigen::MatrixXd::Random(p, p);
  Eigen::MatrixXd c(p, p);
  double fastest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kTimes; ++i) {
    const double start = seconds();
    c.noalias() = a * b;
    fastest = std::min(fastest, seconds() - start);
  }
  return fastest;
}

struct Point {
  double parameters = 0.0;
  double solve_s = 0.0;
};

Point measure(int segments, double noise, int threads) {
  trammel::Scenario scenario = trammel::zoo::long_flight(segments).scenario;
  for (trammel::Station& station : scenario.stations) {
    station.covariance *= noise;
  }
  const trammel::GuaranteedProblem problem = trammel::assemble(scenario).problem;
  const Eigen::Index p = problem.parameters();
  const double product = product_seconds(p);
  const double wall = wall_seconds();
  const double start = seconds();
  const trammel::minimax::Solution solution = trammel::minimax::solve(problem, {.threads = threads});
  const double solved = seconds();
  const double passed = wall_seconds() - wall;
  const trammel::certify::Certificate certificate = trammel::certify::verify(problem, solution);
  const double proved = seconds();
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  std::printf("| %td | %g | %s | %d, %d | %.3f | %.3f | %.0f | %.3f | %.0f | %.1e | %.0f |\n", p, noise,
              std::string(to_string(solution.method)).c_str(), solution.iterations, solution.inner_iterations,
              passed, solved - start, (solved - start) / product, proved - solved,
              (proved - solved) / product, certificate.relative_gap(),
              static_cast<double>(usage.ru_maxrss) / 1024.0);
  std::fflush(stdout);
  return {static_cast<double>(p), solved - start};
}

struct Size {
  int segments = 0;
  double noise = 1.0;
};

/// SEGMENTS or SEGMENTSxNOISE, both positive.
std::optional<Size> parse(const char* text) {
  Size size;
  char* rest = nullptr;
  size.segments = static_cast<int>(std::strtol(text, &rest, 10));
  if (*rest == 'x') {
    size.noise = std::strtod(rest + 1, &rest);
  }
  const bool valid = *rest == '\0' && size.segments > 0 && size.noise > 0.0;
  return valid ? std::optional(size) : std::nullopt;
}

}  // namespace

int main(int argc, char** argv) {
  int threads = 1;
  int first = 1;
  if (argc > 2 && std::string_view(argv[1]) == "--threads") {
    threads = std::atoi(argv[2]);
    first = 3;
  }
  std::vector<Size> sizes;
  for (int i = first; i < argc; ++i) {
    const std::optional<Size> size = parse(argv[i]);
    if (!size) {
      sizes.clear();
      break;
    }
    sizes.push_back(*size);
  }
  if (sizes.empty() || threads < 0) {
    std::fputs("usage: scaling [--threads N] SEGMENTS[xNOISE]..., like 40 98 98x100\n", stderr);
    return 2;
  }
  std::puts(
      "| p | noise | method | steps, inner | wall s | solve s | products | prove s | products | proved gap | "
      "peak MB |");
  std::puts("|---|---|---|---|---|---|---|---|---|---|---|");
  Point smallest;
  Point largest;
  for (const Size& size : sizes) {
    largest = measure(size.segments, size.noise, threads);
    if (&size == &sizes.front()) {
      smallest = largest;
    }
  }
  if (largest.parameters > smallest.parameters) {
    std::printf(
        "slope of log time over log p: %.2f\n",
        std::log(largest.solve_s / smallest.solve_s) / std::log(largest.parameters / smallest.parameters));
  }
}
