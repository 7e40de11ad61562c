// SPDX-License-Identifier: Apache-2.0
/// @file
/// Writes the whitened matrix inequality of the manoeuvre with a number of segments for other solvers, solves
/// the same problem with the structured method five times, and prints parameters, median seconds, both
/// bounds:
///   ./whitened_program SEGMENTS FILE.dat-s
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "trammel/minimax/matrix_inequality.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/zoo.hpp"
#include "trammel/sdp/sdpa_format.hpp"

int main(int count, char** words) {
  if (count != 3) {
    std::fprintf(stderr, "usage: whitened_program SEGMENTS FILE.dat-s\n");
    return 2;
  }
  const int segments = std::atoi(words[1]);
  const trammel::GuaranteedProblem problem =
      trammel::assemble(trammel::zoo::manoeuvre_scenario(segments, 1.0)).problem;
  const auto inequality = trammel::minimax::whitened_inequality(trammel::minimax::reduce(problem));
  std::ofstream(words[2]) << trammel::sdp::to_sdpa(inequality.program);
  std::array<double, 5> seconds{};
  trammel::minimax::Solution solution;
  for (double& one : seconds) {
    solution = trammel::minimax::solve(problem);
    one = solution.solve_time_s;
  }
  std::nth_element(seconds.begin(), seconds.begin() + 2, seconds.end());
  std::printf("%td %.6f %.12g %.12g\n", problem.parameters(), seconds[2], solution.lower, solution.upper);
  return 0;
}
