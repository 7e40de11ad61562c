// A certified bound through the installed library; ends with 0 if it is right.
#include <cmath>
#include <cstdio>

#include <trammel/minimax/solve.hpp>

int main() {
  // One number, |theta| <= 2, one measurement of unit variance: the guaranteed squared error is 4/(1 + 4).
  trammel::GuaranteedProblem problem;
  problem.information_factor = Eigen::MatrixXd::Ones(1, 1);
  problem.criterion_factor = Eigen::MatrixXd::Ones(1, 1);
  problem.ellipsoids = {Eigen::MatrixXd::Constant(1, 1, 0.5)};
  const auto solution = trammel::minimax::solve(problem);
  std::printf("trammel %s: guaranteed squared error %.9f\n", trammel::kVersion, solution.upper);
  return solution.status == trammel::SolveStatus::kOptimal && std::abs(solution.upper - 0.8) < 1e-7 ? 0 : 1;
}
