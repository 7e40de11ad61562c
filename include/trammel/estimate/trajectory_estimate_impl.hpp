// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of trajectory_estimate.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/estimate/bias_bound.hpp"
#include "trammel/estimate/bounded_motion.hpp"
#include "trammel/estimate/observed.hpp"
#include "trammel/estimate/output_grid.hpp"
#include "trammel/estimate/pointwise_guarantee.hpp"
#include "trammel/estimate/trajectory_estimate.hpp"
#include "trammel/linalg/double_double.hpp"
#include "trammel/linalg/svd.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

namespace detail {

/// Certified rms error without measurements, where the bounds alone limit it.
inline double prior_rms(const TrajectoryProblem& problem, const MotionBounds& bounds) {
  const BoundedMotion motion = bounded_motion(problem.coordinates, bounds);
  const Eigen::MatrixXd& C = problem.problem.criterion_factor;
  // Motions that the criterion sees by rounding errors only do not count.
  constexpr double kRounding = 1e-12;
  for (Eigen::Index j = 0; j < motion.free.cols(); ++j) {
    const Eigen::VectorXd z = motion.free.col(j);
    if ((C * z).norm() > kRounding * C.norm() * z.norm()) {
      return std::numeric_limits<double>::infinity();
    }
  }
  return std::sqrt(bound_bias(C * motion.bounded, motion.block_sizes).upper);
}

inline std::string parameter_words(Eigen::Index place) {
  constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
  const std::string axis = std::string(" ") + kAxes[static_cast<std::size_t>(place % 3)];
  const Eigen::Index bound = place / 3;
  return bound == 0   ? "position" + axis
         : bound == 1 ? "velocity" + axis
                      : "acceleration of segment " + std::to_string(bound - 1) + axis;
}

/// The unbounded parameters that take part in directions z (columns), by the displacement each causes until
/// the end.
inline std::vector<std::string> direction_words(const MotionCoordinates& coordinates,
                                                const MotionBounds& bounds, const Eigen::MatrixXd& z) {
  constexpr double kShare = 0.01;  // of the largest displacement: smaller parts are not worth a word
  Eigen::MatrixXd theta = coordinates.motion(z);
  const trajectory::SplineBasis& basis = coordinates.basis();
  for (Eigen::Index place = 0; place < theta.rows(); ++place) {
    const Eigen::Index bound = place / 3;
    if (std::isfinite(semi_axes(bounds, bound)(place % 3))) {
      theta.row(place).setZero();  // what is bounded takes part by rounding errors only
      continue;
    }
    const double length = bound < 2 ? 1.0 : basis.length_s(bound - 2);
    theta.row(place) *= bound == 0   ? 1.0
                        : bound == 1 ? basis.duration_s()
                                     : length * (basis.end_s() - basis.knot(bound - 2) - length / 2);
  }
  theta.colwise().normalize();
  std::vector<std::string> words;
  for (Eigen::Index place = 0; place < theta.rows(); ++place) {
    if (theta.row(place).cwiseAbs().maxCoeff() > kShare) {
      words.push_back(parameter_words(place));
    }
  }
  return words;
}

}  // namespace detail

TRAMMEL_INLINE TrajectoryEstimate evaluate_solution(const Scenario& scenario,
                                                    const TrajectoryProblem& problem,
                                                    minimax::Solution solution,
                                                    const EstimateSettings& settings,
                                                    const ProgressObserver& observe) {
  if (observe) {
    observe({.phase = "proving the bounds", .fraction = 0.0});
  }
  certify::Certificate certificate = certify::certify(problem.problem, settings.solver, solution);
  return evaluate_verified(scenario, problem, std::move(solution), std::move(certificate), settings, observe);
}

TRAMMEL_INLINE TrajectoryEstimate evaluate_verified(
    const Scenario& scenario, const TrajectoryProblem& problem, minimax::Solution solution,
    certify::Certificate certificate, const EstimateSettings& settings, const ProgressObserver& observe) {
  const MotionCoordinates& coordinates = problem.coordinates;
  const std::vector<double> times = output_grid(coordinates.basis(), settings.output_step_s);
  TrajectoryEstimate result;
  result.parameters = coordinates.parameters();
  result.observations = problem.observations;
  if (observe) {
    observe({.phase = "bounds alone, measurements alone", .fraction = 0.0});
  }
  result.certificate = std::move(certificate);
  result.guaranteed_rms_m = linalg::round_up(std::sqrt(solution.upper));
  result.lower_bound_rms_m = std::max(0.0, linalg::round_down(std::sqrt(std::max(0.0, solution.lower))));
  result.prior_rms_m = detail::prior_rms(problem, scenario.bounds);
  result.nominal = nominal_on_grid(problem.nominal, times);
  const std::optional<GaussMarkov> unbounded_estimate = gauss_markov(problem);
  if (unbounded_estimate) {
    result.gauss_markov_rms_m = unbounded_estimate->rms_m;
  }
  if (solution.unbounded_directions.cols() > 0) {
    result.unbounded_directions =
        detail::direction_words(coordinates, scenario.bounds, solution.unbounded_directions);
  }
  result.lambda_m2 = Eigen::VectorXd::Zero(coordinates.basis().coefficients());
  const bool biased = !coordinates.bias_parameters().empty();
  result.lambda_stations_m2 =
      Eigen::VectorXd::Zero(biased ? static_cast<Eigen::Index>(scenario.stations.size()) : 0);
  if (solution.status == SolveStatus::kUnbounded) {
    result.lambda_m2.setConstant(std::numeric_limits<double>::quiet_NaN());
    result.lambda_stations_m2.setConstant(std::numeric_limits<double>::quiet_NaN());
    result.guaranteed_rms_at_m.assign(times.size(), std::numeric_limits<double>::infinity());
    result.solution = std::move(solution);
    return result;
  }
  const auto collect = [&](const std::vector<Eigen::Index>& ellipsoids, Eigen::VectorXd& lambda) {
    for (Eigen::Index l = 0; l < lambda.size(); ++l) {
      const Eigen::Index at = ellipsoids[static_cast<std::size_t>(l)];
      if (at != TrajectoryProblem::kNoEllipsoid) {
        lambda(l) = solution.multipliers(at);
      }
    }
  };
  collect(problem.ellipsoid_of_bound, result.lambda_m2);
  collect(problem.ellipsoid_of_station, result.lambda_stations_m2);
  if (observe) {
    observe({.phase = "bounds per time", .fraction = 0.0});
  }
  result.guaranteed_rms_at_m =
      guaranteed_on_grid(PointwiseGuarantee(problem, scenario.bounds, solution.gain), times, observe);
  if (settings.near_optimality) {
    result.near_optimality =
        certify::assess_near_optimality(problem.problem, solution, *settings.near_optimality, observe);
    const Eigen::VectorXd& worst = result.near_optimality->worst_case;
    if (worst.size() > 0) {
      result.worst_case_theta = coordinates.motion(worst);
      result.worst_case_motion = path_on_grid(problem, worst, times);
      result.worst_case_motion.position_m -= result.nominal.position_m;
      result.worst_case_motion.velocity_mps -= result.nominal.velocity_mps;
    }
  }
  if (!scenario.observations.empty()) {
    if (observe) {
      observe({.phase = "residuals", .fraction = 0.0});
    }
    Eigen::VectorXd z =
        solution.gain * (problem.problem.information_factor.transpose() * problem.information_rhs);
    const BiasEstimate biases = estimate_biases(problem, scenario.bounds, solution.gain);
    z.tail(biases.z.size()) = biases.z;
    result.observed = compare_with_observations(scenario, problem, z, unbounded_estimate, times);
    result.observed->biases_guaranteed_rms = biases.guaranteed_rms;
  }
  result.solution = std::move(solution);
  return result;
}

TRAMMEL_INLINE TrajectoryEstimate estimate_trajectory(const Scenario& scenario,
                                                      const EstimateSettings& settings,
                                                      const ProgressObserver& observe) {
  if (!(settings.output_step_s >= 0.0) || !std::isfinite(settings.output_step_s)) {
    throw Error({"settings.output_step_s", shortest(settings.output_step_s) + " s",
                 "a positive spacing, or 0 to have it chosen"});
  }
  const ProgressObserver tell = steady(observe);
  if (tell) {
    tell({.phase = "reading measurements", .fraction = 0.0});
  }
  const TrajectoryProblem problem = assemble(scenario);
  if (tell) {
    tell({.phase = "solving", .fraction = 0.0});
  }
  return evaluate_solution(scenario, problem,
                           minimax::solve_with(settings.method, problem.problem, settings.solver, tell),
                           settings, tell);
}

}  // namespace trammel::inline TRAMMEL_ABI::estimate
