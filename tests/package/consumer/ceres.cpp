// A fit by the Ceres Solver through the installed library; ends with 0 if it is that of the built-in method.
#include <cmath>
#include <cstdio>

#include <trammel/ceres/fit.hpp>
#include <trammel/localise/levenberg_marquardt.hpp>

int main() {
  // A position measured twice at a distance of 2 m, between bounds of 10 m.
  trammel::Scenario scenario;
  scenario.knots_s = {0, 1};
  scenario.bounds.position_m.setConstant(10);
  scenario.bounds.velocity_mps.setConstant(1);
  scenario.bounds.acceleration_mps2 = {Eigen::Vector3d::Ones()};
  scenario.stations = {{.name = "fix",
                        .kind = trammel::SensorKind::kPosition,
                        .covariance = Eigen::Matrix3d::Identity(),
                        .times_s = {}}};
  for (const double x_m : {4.0, 6.0}) {
    scenario.observations.push_back(
        {.t_s = 0.5, .station = 0, .value = Eigen::Vector3d(x_m, 0, 0), .covariance = {}});
  }
  const trammel::localise::FitProblem problem(scenario);
  const Eigen::VectorXd start = Eigen::VectorXd::Zero(problem.parameters());
  const trammel::localise::Fit ceres = trammel::localise::fit_ceres(problem, start, 1.0);
  const trammel::localise::Fit built_in = trammel::localise::fit_levenberg_marquardt(problem, start, 1.0);
  std::printf("trammel %s: %.9f, built in %.9f\n", trammel::kVersion, ceres.cost, built_in.cost);
  return ceres.converged && std::abs(ceres.cost - built_in.cost) < 1e-6 ? 0 : 1;
}
