// SPDX-License-Identifier: Apache-2.0
/// @file
/// From a scenario to the guaranteed problem.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/problem/guaranteed_problem.hpp"
#include "trammel/problem/motion_coordinates.hpp"
#include "trammel/problem/scenario.hpp"
#include "trammel/trajectory/nominal_trajectory.hpp"
#include "trammel/trajectory/quadratic_spline.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// The guaranteed problem of a trajectory, with what is needed to read its answer.
struct TrajectoryProblem {
  MotionCoordinates coordinates;
  trajectory::NominalTrajectory nominal;
  GuaranteedProblem problem;  ///< in the coordinates z
  /// With observations: the whitened deviations from the reference, reduced with information_factor (F'y is
  /// information_factor' information_rhs). Empty without.
  Eigen::VectorXd information_rhs;
  /// |y - F z|^2 = |information_factor z - information_rhs|^2 + information_residual.
  double information_residual = 0.0;
  /// Place in problem.ellipsoids of the bounds position, velocity, segments in order; kNoEllipsoid for a
  /// bound that removes or leaves free all three axes.
  std::vector<Eigen::Index> ellipsoid_of_bound;
  std::size_t observations = 0;  ///< measurements used
  /// The deviation from the reference that measurements are linearised about; absent: the reference itself.
  std::optional<trajectory::QuadraticSpline<double>> linearised_about;

  static constexpr Eigen::Index kNoEllipsoid = -1;
};

/// Where one measurement is made and linearised; passed to for_each_measurement.
struct MeasurementSite {
  std::size_t station = 0;  ///< index into Scenario::stations
  double t_s = 0.0;
  std::size_t index = 0;                     ///< among the observations, or among the station's planned times
  const Measurement* observation = nullptr;  ///< null for a planned measurement
};

/// Calls `visit` for every observation, or for every planned measurement when there are none.
void for_each_measurement(const Scenario& scenario, const std::function<void(const MeasurementSite&)>& visit);

/// "station 'west', measurement 3 at 12.000000 s": for messages.
[[nodiscard]] std::string describe(const Scenario& scenario, const MeasurementSite& site);

/// Throws Error for a scenario that breaks its own rules: knots, bounds, criterion, stations, covariances,
/// measurements; names the key, what was found and what was expected.
void check(const Scenario& scenario);

/// The reference path of a scenario. Throws Error unless it covers all knots.
[[nodiscard]] trajectory::NominalTrajectory make_nominal(const Scenario& scenario);

/// Writes the guaranteed problem of a scenario: linearises the measurements about the reference, whitens
/// them, and reduces them to a triangle.
///
/// | symbol | meaning                                                                         |
/// |--------|---------------------------------------------------------------------------------|
/// | F      | rows L_k^-1 H_k B(t_k), W_k = L_k L_k' covariance, H_k Jacobian of the sensor   |
/// | C      | |C z|^2 = mean square of the deviation over the criterion, m^2                  |
/// | a_l    | rows of theta in bound l over their semi-axes                                   |
///
/// Cost: O(n) time for n measurements in any order, O(p^2) memory besides the scenario.
/// Throws Error as `check` does, and where a measurement cannot be linearised (aircraft at the station).
///
/// `about`: a deviation from the reference to linearise about instead of zero (a spline with the scenario's
/// knots); parameters and bounds remain deviations from the reference.
[[nodiscard]] TrajectoryProblem assemble(const Scenario& scenario,
                                         const trajectory::QuadraticSpline<double>* about = nullptr);

}  // namespace trammel::inline TRAMMEL_ABI

#ifndef TRAMMEL_COMPILED
#include "trammel/problem/assemble_impl.hpp"
#endif
