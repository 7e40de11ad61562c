// SPDX-License-Identifier: Apache-2.0
/// @file
/// A made-up estimate with every field filled, for tests of what is written about estimates.
#pragma once

#include <cmath>
#include <limits>

#include "io/measurement_csv.hpp"
#include "io/scenario_reader.hpp"
#include "trammel/estimate/trajectory_estimate.hpp"
#include "trammel/localise/flight_estimate.hpp"

namespace trammel::test {

inline constexpr int kSampleSegments = 8;
inline constexpr double kSampleEnd_s = 80.0;

inline io::ScenarioInput sample_scenario() {
  io::ScenarioInput input;
  Scenario& scenario = input.scenario;
  scenario.title = "a <b>turn</b> </script> & \"climb\"";
  for (int i = 0; i <= kSampleSegments; ++i) {
    scenario.knots_s.push_back(kSampleEnd_s * i / kSampleSegments);
  }
  scenario.bounds.position_m = Eigen::Vector3d(50, 50, 50);
  scenario.bounds.velocity_mps = Eigen::Vector3d(5, 5, 1);
  scenario.bounds.acceleration_mps2.assign(kSampleSegments, Eigen::Vector3d(2, 2, 1));
  Station radar;
  radar.name = "radar";
  radar.kind = SensorKind::kAzimuthElevationRange;
  radar.position_m = Eigen::Vector3d(-400, 200, 0);
  Station ranger;
  ranger.name = "ranger";
  ranger.position_m = Eigen::Vector3d(9000, 9000, 0);
  scenario.stations = {radar, ranger};
  input.inputs = {{"sample.toml", std::string(64, 'a')}};
  return input;
}

/// A climbing turn, shifted by `offset` metres to the east.
inline estimate::PathTable sample_path(double offset) {
  constexpr int kRows = 161;
  constexpr double kRadius_m = 300.0;
  constexpr double kRate = 0.05;
  estimate::PathTable path;
  path.position_m.resize(kRows, 3);
  path.velocity_mps.resize(kRows, 3);
  for (int i = 0; i < kRows; ++i) {
    const double t = kSampleEnd_s * i / (kRows - 1);
    path.times_s.push_back(t);
    path.position_m.row(i) << kRadius_m * std::sin(kRate * t) + offset, kRadius_m * std::cos(kRate * t),
        500 + t;
    path.velocity_mps.row(i) << kRadius_m * kRate * std::cos(kRate * t),
        -kRadius_m * kRate * std::sin(kRate * t), 1.0;
  }
  return path;
}

inline estimate::TrajectoryEstimate sample_estimate() {
  estimate::TrajectoryEstimate result;
  result.solution.status = SolveStatus::kOptimal;
  result.solution.claim = Claim::kApproximate;
  result.solution.upper = 16.0;
  result.solution.lower = 16.0 - 1e-7;
  result.solution.iterations = 21;
  result.solution.solve_time_s = 0.25;
  result.parameters = 3 * (kSampleSegments + 2);
  result.observations = 120;
  result.guaranteed_rms_m = std::sqrt(result.solution.upper);
  result.lower_bound_rms_m = std::sqrt(result.solution.lower);
  result.gauss_markov_rms_m = 5.0;
  result.prior_rms_m = 800.0;
  result.lambda_m2 = Eigen::VectorXd::Constant(kSampleSegments + 2, 0.5);
  result.nominal = sample_path(10.0);
  for (const double t : result.nominal.times_s) {
    result.guaranteed_rms_at_m.push_back(4.0 + std::pow(t / kSampleEnd_s - 0.5, 2));
  }
  result.worst_case_motion = sample_path(0.0);
  result.worst_case_motion.position_m *= 0.01;
  result.worst_case_theta = Eigen::VectorXd::LinSpaced(3 * (kSampleSegments + 2), -0.5, 0.5);
  result.certificate.claim = result.solution.claim;
  result.certificate.inflation = 0x1p-40;
  certify::NearOptimality near;
  near.attained = result.solution.upper;
  near.attained_fraction = 1.0;
  near.any_estimator = 12.25;
  near.kind = certify::AnyEstimatorBound::kCoherentGroups;
  result.near_optimality = near;
  estimate::ObservationResult observed;
  observed.chi2 = 250.0;
  observed.theta = Eigen::VectorXd::LinSpaced(3 * (kSampleSegments + 2), -1.0, 1.0);
  observed.knot_position_m = Eigen::MatrixXd::Ones(kSampleSegments + 1, 3);
  observed.knot_velocity_mps = Eigen::MatrixXd::Ones(kSampleSegments + 1, 3);
  observed.path = sample_path(3.0);
  observed.gauss_markov_path = sample_path(-4.0);
  observed.linearisation.ratio = 0.02;
  for (int i = 0; i < 80; ++i) {
    const bool first = i % 2 == 0;
    estimate::Residual residual;
    residual.t_s = i;
    residual.station = first ? 0 : 1;
    residual.value = Eigen::VectorXd::Constant(first ? 3 : 1, std::sin(3.0 * i));
    residual.whitened = 2.0 * residual.value;
    observed.residuals.push_back(residual);
  }
  result.observed = observed;
  return result;
}

/// What a flight with bent measurements states.
inline localise::Statement sample_statement() {
  localise::Statement statement;
  statement.independence = localise::Independence::kSameData;
  statement.consistency = localise::Consistency::kSelfConsistent;
  statement.stated_rms_m = statement.conditional_rms_m = 4.75;
  statement.linear_guarantee_rms_m = 4.0;
  statement.curvature_rms_m = 0.5;
  statement.curvature_lower_rms_m = 0.375;
  statement.model_error_rms_m = 0.25;
  statement.kappa = 0.125;
  statement.fixed_point_rms_m = 4.75;
  statement.starts = 18;
  statement.systems = 300;
  statement.reference_chi2 = 200.0;
  statement.tube_m = {1.0, 2.0};
  return statement;
}

/// The same where two motions explain the data.
inline localise::Statement ambiguous_statement() {
  localise::Statement statement = sample_statement();
  statement.ambiguous = true;
  statement.stated_rms_m = std::numeric_limits<double>::quiet_NaN();
  statement.competing.push_back({.excess_cost = 3.5,
                                 .distance_m = 900.0,
                                 .from_floor_test = false,
                                 .chi2 = 203.0,
                                 .stated_rms_m = 8.0,
                                 .linear_guarantee_rms_m = 6.0,
                                 .path = sample_path(900.0)});
  return statement;
}

/// Samples of `sample_path(0)`.
inline io::PathSamples sample_truth() {
  const estimate::PathTable path = sample_path(0.0);
  io::PathSamples truth;
  truth.times_s = path.times_s;
  for (Eigen::Index i = 0; i < path.position_m.rows(); ++i) {
    truth.positions_m.emplace_back(path.position_m.row(i));
  }
  return truth;
}

}  // namespace trammel::test
