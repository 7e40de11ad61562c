// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of flight_estimate.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/estimate/observed.hpp"
#include "trammel/localise/flight_estimate.hpp"
#include "trammel/localise/interior_motion.hpp"
#include "trammel/minimax/methods.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

namespace detail {

inline LocateSettings locate_settings(const FlightSettings& settings) {
  return {.minimum_height_m = settings.minimum_height_m,
          .model_error = settings.model_error,
          .fit = settings.fit,
          .minimise = settings.minimise,
          .solver = settings.estimate.solver,
          .method = settings.estimate.method};
}

/// The numbers of one stated value.
inline void take_over(const StatedValue& stated, Statement& statement) {
  statement.consistency = stated.consistency;
  statement.conditional_rms_m = stated.stated_rms_m;
  statement.linear_guarantee_rms_m = stated.linear_guarantee_rms_m;
  statement.curvature_rms_m = stated.curvature_rms_m;
  statement.curvature_lower_rms_m = stated.curvature_lower_rms_m;
  statement.model_error_rms_m = stated.model_error_rms_m;
  statement.kappa = stated.kappa;
  statement.fixed_point_rms_m = stated.fixed_point_rms_m;
}

inline void add_competing(const Location& location, const std::vector<double>& times_s,
                          std::vector<CompetingSolution>& competing) {
  for (std::size_t k = 1; k < location.branches.size(); ++k) {
    const Branch& branch = location.branches[k];
    competing.push_back({.excess_cost = branch.excess_cost,
                         .distance_m = branch.distance_m,
                         .from_floor_test = branch.from_floor_test,
                         .chi2 = branch.minimum.chi2,
                         .stated_rms_m = branch.stated->stated_rms_m,
                         .linear_guarantee_rms_m = branch.stated->linear_guarantee_rms_m,
                         .path = {}});
    if (branch.stated->z.size() > 0) {
      competing.back().path = estimate::path_on_grid(branch.stated->problem, branch.stated->z, times_s);
    }
  }
}

/// What both kinds of fit leave in the statement.
inline void add_search(const Location& location, Statement& statement) {
  const Branch& best = location.branches.front();
  const auto add = [](double& sum, double value) { sum = std::isnan(sum) ? value : sum + value; };
  statement.ambiguous = statement.ambiguous || location.status == LocateStatus::kAmbiguous;
  statement.floor_tests.insert(statement.floor_tests.end(), location.floor_tests.begin(),
                               location.floor_tests.end());
  add(statement.reference_cost, best.reference.cost);
  add(statement.reference_chi2, best.reference.chi2);
  statement.starts += location.starts;
  statement.systems += location.systems;
}

inline void require_located(const Location& location, const FlightSettings& settings) {
  if (location.status == LocateStatus::kInfeasibleStart) {
    refuse_floor(*settings.minimum_height_m, location.lowest_height_m);
  }
}

/// Estimate from one stated value.
inline estimate::TrajectoryEstimate evaluate(const Scenario& scenario, const StatedValue& stated,
                                             const FlightSettings& settings,
                                             const ProgressObserver& observe) {
  return estimate::evaluate_verified(scenario, stated.problem, stated.solution, stated.certificate,
                                     settings.estimate, observe);
}

inline FlightEstimate from_one_fit(const Scenario& scenario, const FlightSettings& settings,
                                   const ProgressObserver& observe) {
  const Location location = locate(scenario, locate_settings(settings), observe);
  require_located(location, settings);
  const StatedValue& stated = *location.branches.front().stated;
  FlightEstimate result{.estimate = evaluate(scenario, stated, settings, observe), .statement = Statement()};
  Statement& statement = *result.statement;
  statement.independence = Independence::kSameData;
  const std::vector<double>& times = result.estimate.nominal.times_s;
  take_over(stated, statement);
  add_search(location, statement);
  add_competing(location, times, statement.competing);
  statement.reference = estimate::path_on_grid(stated.problem, stated.reference, times);
  statement.tube_m = stated.tube_m;
  statement.tube_widening = stated.tube_widening;
  return result;
}

/// The reference path itself as what measurements are linearised about.
inline FlightEstimate from_fixed_reference(const Scenario& scenario, const FlightSettings& settings,
                                           const ProgressObserver& observe) {
  const FitProblem fit(scenario);
  const StatedValue stated = state(fit, Eigen::VectorXd::Zero(fit.parameters()), settings.model_error,
                                   settings.estimate.solver, settings.estimate.method);
  FlightEstimate result{.estimate = evaluate(scenario, stated, settings, observe), .statement = Statement()};
  Statement& statement = *result.statement;
  take_over(stated, statement);
  statement.reference = result.estimate.nominal;
  if (result.estimate.observed) {
    result.estimate.observed->linearisation.iterations = 0;
    result.estimate.observed->linearisation.converged = false;
  }
  statement.tube_m = stated.tube_m;
  statement.tube_widening = stated.tube_widening;
  return result;
}

/// The scenario with every second observation of each station, beginning with the first or the second, and
/// the places of those observations.
struct Half {
  Scenario scenario;
  std::vector<std::size_t> places;
};

inline std::array<Half, 2> split(const Scenario& scenario) {
  std::vector<std::size_t> order(scenario.observations.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    order[k] = k;
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return scenario.observations[a].t_s < scenario.observations[b].t_s;
  });
  std::array<Half, 2> halves{Half{scenario, {}}, Half{scenario, {}}};
  std::vector<std::size_t> seen(scenario.stations.size(), 0);
  for (const std::size_t k : order) {
    halves[seen[scenario.observations[k].station]++ % 2].places.push_back(k);
  }
  for (Half& half : halves) {
    std::sort(half.places.begin(), half.places.end());
    half.scenario.observations.clear();
    for (const std::size_t k : half.places) {
      half.scenario.observations.push_back(scenario.observations[k]);
    }
  }
  return halves;
}

inline double mean(double a, double b) { return a / 2 + b / 2; }

inline estimate::PathTable mean(const estimate::PathTable& a, const estimate::PathTable& b) {
  return {.times_s = a.times_s,
          .position_m = (a.position_m + b.position_m) / 2,
          .velocity_mps = (a.velocity_mps + b.velocity_mps) / 2};
}

/// Means of two statements: the rms of a mean is at most the mean of the rms.
inline void combine(const std::array<Statement, 2>& halves, Statement& statement) {
  const auto [a, b] = std::pair(halves[0], halves[1]);
  statement.consistency = std::max(a.consistency, b.consistency);  // the weaker
  for (double Statement::*const member :
       {&Statement::conditional_rms_m, &Statement::linear_guarantee_rms_m, &Statement::curvature_rms_m,
        &Statement::curvature_lower_rms_m, &Statement::model_error_rms_m, &Statement::kappa}) {
    statement.*member = mean(a.*member, b.*member);
  }
  if (a.fixed_point_rms_m && b.fixed_point_rms_m) {
    statement.fixed_point_rms_m = mean(*a.fixed_point_rms_m, *b.fixed_point_rms_m);
  }
}

inline FlightEstimate from_cross_fit(const Scenario& scenario, const FlightSettings& settings,
                                     const ProgressObserver& observe) {
  const std::array<Half, 2> halves = split(scenario);
  require(!halves[1].places.empty(), "observations", "no station with two of them",
          "two halves to fit and to estimate from");
  const std::array<FitProblem, 2> fits{FitProblem(halves[0].scenario, settings.minimum_height_m),
                                       FitProblem(halves[1].scenario, settings.minimum_height_m)};
  std::array<Location, 2> locations;  // [i]: value stated for half i about the path fitted to the other
  std::array<Statement, 2> statements;
  std::array<estimate::TrajectoryEstimate, 2> estimates;
  FlightSettings half_settings = settings;
  half_settings.estimate.near_optimality.reset();  // the mean of two estimators is neither of them
  FlightEstimate result;
  Statement& statement = result.statement.emplace();
  statement.independence = Independence::kCrossFit;
  statement.tube_m.assign(scenario.observations.size(), std::numeric_limits<double>::quiet_NaN());
  for (const std::size_t i : {0U, 1U}) {
    locations[i] = locate(fits[1 - i], fits[i], locate_settings(settings), observe);
    require_located(locations[i], settings);
    const StatedValue& stated = *locations[i].branches.front().stated;
    estimates[i] = evaluate(halves[i].scenario, stated, half_settings, observe);
    take_over(stated, statements[i]);
    add_search(locations[i], statement);
    add_competing(locations[i], estimates[i].nominal.times_s, statement.competing);
    statement.tube_widening = std::max(statement.tube_widening, stated.tube_widening);
    for (std::size_t k = 0; k < stated.tube_m.size(); ++k) {
      statement.tube_m[halves[i].places[k]] = stated.tube_m[k];
    }
  }
  combine(statements, statement);
  const MotionCoordinates& coordinates = fits[0].trajectory().coordinates;
  const auto reference = [&](const Location& location) -> Eigen::VectorXd {
    const StatedValue& stated = *location.branches.front().stated;
    return coordinates.moved_from(stated.problem.coordinates, stated.reference);
  };
  const Eigen::VectorXd about = (reference(locations[0]) + reference(locations[1])) / 2;
  const trajectory::QuadraticSpline<double> middle = coordinates.spline(about);
  const TrajectoryProblem whole =
      assemble(scenario, &middle, coordinates.time_offsets_s(about, scenario.stations.size()));

  estimate::TrajectoryEstimate& mean_estimate = result.estimate;
  const auto& [a, b] = estimates;
  mean_estimate = a;
  mean_estimate.observations = whole.observations;
  mean_estimate.guaranteed_rms_m = mean(a.guaranteed_rms_m, b.guaranteed_rms_m);
  mean_estimate.lower_bound_rms_m = mean(a.lower_bound_rms_m, b.lower_bound_rms_m);
  mean_estimate.solution.upper = mean_estimate.guaranteed_rms_m * mean_estimate.guaranteed_rms_m;
  mean_estimate.solution.lower = mean_estimate.lower_bound_rms_m * mean_estimate.lower_bound_rms_m;
  mean_estimate.solution.status = std::max(a.solution.status, b.solution.status);
  mean_estimate.solution.claim = std::min(a.solution.claim, b.solution.claim);
  mean_estimate.solution.iterations += b.solution.iterations;
  mean_estimate.solution.solve_time_s += b.solution.solve_time_s;
  mean_estimate.certificate.inflation = std::max(a.certificate.inflation, b.certificate.inflation);
  mean_estimate.lambda_m2 = (a.lambda_m2 + b.lambda_m2) / 2;
  mean_estimate.lambda_stations_m2 = (a.lambda_stations_m2 + b.lambda_stations_m2) / 2;
  for (std::size_t k = 0; k < a.guaranteed_rms_at_m.size(); ++k) {
    mean_estimate.guaranteed_rms_at_m[k] = mean(a.guaranteed_rms_at_m[k], b.guaranteed_rms_at_m[k]);
  }
  const std::optional<estimate::GaussMarkov> unbounded_estimate = estimate::gauss_markov(whole);
  mean_estimate.gauss_markov_rms_m =
      unbounded_estimate ? unbounded_estimate->rms_m : std::numeric_limits<double>::quiet_NaN();
  if (a.observed && b.observed) {
    const Eigen::VectorXd theta = (a.observed->theta + b.observed->theta) / 2;
    const Eigen::VectorXd biases = (a.observed->biases + b.observed->biases) / 2;
    mean_estimate.observed =
        estimate::compare_with_observations(scenario, whole, whole.coordinates.from_motion(theta, biases),
                                            unbounded_estimate, mean_estimate.nominal.times_s);
    mean_estimate.observed->biases_guaranteed_rms =
        (a.observed->biases_guaranteed_rms + b.observed->biases_guaranteed_rms) / 2;
  }
  statement.reference = estimate::path_on_grid(whole, whole.coordinates.moved_from(coordinates, about),
                                               mean_estimate.nominal.times_s);
  return result;
}

/// Whether a motion that no bound limits is not seen by the measurements either.
inline bool unbounded(const Scenario& scenario, const FlightSettings& settings) {
  const auto limited = [](const Eigen::Vector3d& axes) { return axes.allFinite(); };
  const MotionBounds& bounds = scenario.bounds;
  if (limited(bounds.position_m) && limited(bounds.velocity_mps) &&
      std::all_of(bounds.acceleration_mps2.begin(), bounds.acceleration_mps2.end(), limited)) {
    return false;
  }
  minimax::SolverSettings one_look = settings.estimate.solver;
  one_look.max_iterations = 1;
  return minimax::solve(assemble(scenario).problem, one_look).status == SolveStatus::kUnbounded;
}

}  // namespace detail

TRAMMEL_INLINE FlightEstimate estimate_flight(const Scenario& scenario, const FlightSettings& settings,
                                              const ProgressObserver& observe) {
  const ProgressObserver tell = steady(observe);
  if (scenario.observations.empty() || detail::unbounded(scenario, settings)) {
    return {.estimate = estimate::estimate_trajectory(scenario, settings.estimate, tell), .statement = {}};
  }
  const bool linear = std::all_of(scenario.stations.begin(), scenario.stations.end(), [](const Station& s) {
    return s.kind == SensorKind::kPosition && s.bias.time_s == 0.0;
  });
  FlightEstimate result = !settings.relinearise || linear
                              ? detail::from_fixed_reference(scenario, settings, tell)
                          : settings.cross_fit ? detail::from_cross_fit(scenario, settings, tell)
                                               : detail::from_one_fit(scenario, settings, tell);
  if (!result.statement->ambiguous) {
    result.statement->stated_rms_m = result.statement->conditional_rms_m;
  }
  return result;
}

TRAMMEL_INLINE std::string describe_proved(const Statement& statement) {
  if (statement.consistency == Consistency::kNoBound) {
    return "Nothing is proved about the nonlinear measurements: a remainder of the linearisation could not "
           "be bounded.";
  }
  std::string text =
      "For every motion within the bounds whose distance from the path linearised about stays, at every "
      "measurement, below 3^(1/4) times the tube listed (in fourth mean), the root mean square error over "
      "the measurement noise is at most the linear guarantee plus the curvature term plus the model error's "
      "term";
  switch (statement.independence) {
    case Independence::kFixedReference:
      return text + ".";
    case Independence::kCrossFit:
      return text + "; each half of the scans is linearised about a path fitted to the other half.";
    case Independence::kSameData:
      break;
  }
  return text + ", if that path did not depend on the noise of the same measurements.";
}

TRAMMEL_INLINE std::vector<std::string> describe_assumed(const Statement& statement,
                                                         const ModelError& model_error) {
  std::vector<std::string> list;
  if (statement.consistency != Consistency::kNoBound) {
    list.emplace_back(
        statement.consistency == Consistency::kSelfConsistent
            ? "The true path is within that tube of the path linearised about: widening the tube by the "
              "stated value settles, which supports this but does not prove it."
            : "The true path is within that tube of the path linearised about: the curvature term is too "
              "large for the tube to confirm itself.");
  }
  if (statement.consistency != Consistency::kNoBound && statement.tube_widening > 1.0) {
    list.emplace_back("The estimate lies " + shortest(std::round(10 * statement.tube_widening) / 10) +
                      " times as far from the path linearised about as its own error bound; the tube is "
                      "widened to contain it.");
  }
  if (statement.independence != Independence::kFixedReference) {
    list.emplace_back("The search found every motion that explains the data about as well as the best one (" +
                      std::to_string(statement.starts) + " starts, not exhaustive).");
  }
  if (statement.independence == Independence::kSameData) {
    list.emplace_back(
        "The path linearised about is fitted to the same measurements; its dependence on their noise is "
        "neglected (cross-fit removes this assumption).");
  }
  list.emplace_back(model_error.position_m > 0.0
                        ? "The true motion is within the model error stated of a motion within the bounds."
                        : "The true motion is itself within the bounds: no model error is allowed for "
                          "(bounds.jerk_mps3 adds one).");
  return list;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
