// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of flight.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/estimate/bias_bound.hpp"
#include "trammel/estimate/observed.hpp"
#include "trammel/estimate/output_grid.hpp"
#include "trammel/linalg/double_double.hpp"
#include "trammel/trajectory/criterion_factor.hpp"
#include "trammel/window/flight.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

namespace flight_detail {

/// Root mean square over the flight of the largest distance from the reference that the bounds allow: reached
/// by moving straight where the bounds are balls.
inline double prior_rms(const trajectory::SplineBasis& basis, const MotionBounds& bounds) {
  double position = bounds.position_m.maxCoeff();
  double velocity = bounds.velocity_mps.maxCoeff();
  const trajectory::GaussRule rule = trajectory::gauss_rule();
  double integral = 0.0;
  for (Eigen::Index i = 0; i < basis.segments(); ++i) {
    const double h = basis.length_s(i);
    const double acceleration = semi_axes(bounds, i + 2).maxCoeff();
    const auto at = [&](double t) { return position + t * (velocity + t * acceleration / 2.0); };
    for (std::size_t q = 0; q < rule.node.size(); ++q) {
      const double x = at(rule.node[q] * h);
      integral += rule.weight[q] * h * x * x;
    }
    position = at(h);
    velocity += h * acceleration;
  }
  return std::sqrt(integral / basis.duration_s());
}

/// sqrt(tr S J^-1).
inline double gauss_markov_rms(const BandedProblem& problem) {
  const linalg::BandedMatrix S = problem.criterion_factor.transpose() * problem.criterion_factor;
  return std::sqrt(linalg::inner_product(S, linalg::inverse_within_band(problem.information_factor)));
}

/// What other results hold of the solver.
inline minimax::Solution summary(const WindowSolution& solution) {
  return {.status = solution.status,
          .claim = solution.certificate.claim,
          .method = minimax::Method::kWindows,
          .upper = solution.certificate.upper,
          .lower = solution.certificate.lower,
          .multipliers = solution.certificate.multipliers,
          .gain = {},
          .prior_factor = {},
          .unbounded_directions = {},
          .iterations = solution.iterations,
          .inner_iterations = 0,
          .solve_time_s = solution.solve_time_s};
}

inline certify::Certificate proof(const WindowSolution& solution, const WindowSettings& settings) {
  const BandedCertificate& proved = solution.certificate;
  certify::Certificate certificate;
  certificate.claim = proved.claim;
  certificate.upper = proved.upper;
  certificate.lower = proved.lower;
  certificate.multipliers = proved.multipliers;
  certificate.inflation = proved.inflation;
  certificate.remark = proved.remark;
  if (solution.status != SolveStatus::kOptimal && proved.claim != Claim::kNone) {
    certificate.remark = "the interval is wider than asked for: raise solver.window_overlap (it was " +
                         std::to_string(settings.overlap) + ")";
    if (solution.nearly_singular > 0) {
      certificate.remark += "; in " + std::to_string(solution.nearly_singular) + " of " +
                            std::to_string(solution.windows) +
                            " windows the noise hides the manoeuvres, which takes more overlap";
    }
  }
  return certificate;
}

}  // namespace flight_detail

TRAMMEL_INLINE BandedPointwise::BandedPointwise(const BandedProblem& problem,
                                                const BandedEstimator& estimator)
    : basis_(problem.trajectory.coordinates.basis()), bias_(estimator.bias) {
  linalg::BandedMatrix bounds = problem.bounds;
  for (Eigen::Index i = 0; i < bias_.size(); ++i) {
    bounds.row(i) *= estimator.root(i);
    for (Eigen::Index j = bias_.first(i); j < bias_.behind(i); ++j) {
      bias_.at(i, j) *= estimator.root(j);
    }
  }
  linalg::BandedMatrix seen = estimator.bias * bounds;  // I + W Sigma D
  for (Eigen::Index i = 0; i < seen.size(); ++i) {
    seen.at(i, i) += 1.0;
  }
  noise_ = seen * linalg::inverse_within_band(problem.information_factor, kInverseReach) *
           problem.information_factor.transpose();
}

TRAMMEL_INLINE double BandedPointwise::rms_m(double t_s) const {
  const trajectory::LocalBasis<double> local = basis_.at(t_s);
  // The same weights apply to the rows of all three axes.
  const auto rows = [&](const linalg::BandedMatrix& band) {
    const Eigen::Index begin = band.first(3 * local.first) / 3 * 3;
    const Eigen::Index end = (band.behind(3 * local.first + 8) + 2) / 3 * 3;
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(3, end - begin);
    for (Eigen::Index k = 0; k < 3; ++k) {
      result += local.value(k) * band.block(3 * (local.first + k), begin, 3, end - begin);
    }
    return result;
  };
  const Eigen::MatrixXd bias = rows(bias_);
  const std::vector<Eigen::Index> blocks(static_cast<std::size_t>(bias.cols() / 3), 3);
  return std::sqrt(rows(noise_).squaredNorm() + estimate::bound_bias(bias, blocks).upper);
}

TRAMMEL_INLINE BandedProblem assemble_about_fit(const Scenario& scenario, const ProgressObserver& observe) {
  constexpr int kMostSteps = 30;
  constexpr double kSettled = 1e-2;  // root mean square change of the path, in standard deviations
  BandedProblem problem = assemble_banded(scenario);
  if (std::all_of(scenario.stations.begin(), scenario.stations.end(),
                  [](const Station& s) { return s.kind == SensorKind::kPosition; })) {
    return problem;
  }
  Eigen::VectorXd about = Eigen::VectorXd::Zero(problem.parameters());
  for (int step = 0; step < kMostSteps; ++step) {
    const Eigen::VectorXd c = least_squares(problem);
    const double change = (problem.information_factor * Eigen::MatrixXd(c - about)).norm() /
                          std::sqrt(static_cast<double>(problem.parameters()));
    about = c;
    const trajectory::QuadraticSpline<double> path = problem.trajectory.coordinates.spline(about);
    problem = assemble_banded(scenario, &path);
    if (observe) {
      observe({.phase = "fitting a path", .fraction = std::min(1.0, kSettled / change)});
    }
    if (change < kSettled) {
      return problem;
    }
  }
  throw Error({"measurements", "a fit that does not settle in " + std::to_string(kMostSteps) + " steps",
               "a reference path near enough to start from, or relinearise = false"});
}

TRAMMEL_INLINE estimate::TrajectoryEstimate estimate_flight(const Scenario& scenario,
                                                            const FlightSettings& settings,
                                                            const ProgressObserver& observe) {
  namespace detail = flight_detail;
  const ProgressObserver tell = steady(observe);
  const bool fit = settings.relinearise && !scenario.observations.empty();
  const BandedProblem problem = fit ? assemble_about_fit(scenario, tell) : assemble_banded(scenario);
  const WindowSolution solution = solve_windows(problem, settings.windows, tell);
  const trajectory::SplineBasis& basis = problem.trajectory.coordinates.basis();
  const std::vector<double> times = estimate::output_grid(basis, settings.output_step_s);

  estimate::TrajectoryEstimate result;
  result.solution = detail::summary(solution);
  result.certificate = detail::proof(solution, settings.windows);
  result.parameters = problem.parameters();
  result.observations = problem.trajectory.observations;
  result.guaranteed_rms_m = linalg::round_up(std::sqrt(solution.certificate.upper));
  result.lower_bound_rms_m = std::max(0.0, linalg::round_down(std::sqrt(solution.certificate.lower)));
  result.gauss_markov_rms_m = detail::gauss_markov_rms(problem);
  result.prior_rms_m = detail::prior_rms(basis, scenario.bounds);
  result.lambda_m2 = solution.certificate.multipliers;
  result.nominal = estimate::nominal_on_grid(problem.trajectory.nominal, times);
  result.guaranteed_rms_at_m =
      estimate::guaranteed_on_grid(BandedPointwise(problem, solution.estimator), times, tell);
  if (!scenario.observations.empty()) {
    const estimate::GaussMarkov unbounded{.rms_m = result.gauss_markov_rms_m, .z = least_squares(problem)};
    result.observed = estimate::compare_with_observations(
        scenario, problem.trajectory, estimate_coefficients(problem, solution.estimator), unbounded, times);
    result.observed->biases_guaranteed_rms.resize(0);
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::window
