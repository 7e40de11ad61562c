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
#include "trammel/sensor/any_sensor.hpp"
#include "trammel/trajectory/nominal_trajectory.hpp"
#include "trammel/trajectory/quadratic_spline.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// The guaranteed problem of a trajectory, with what is needed to read its answer.
struct TrajectoryProblem {
  MotionCoordinates coordinates;
  trajectory::NominalTrajectory nominal;
  std::vector<trajectory::NominalTrajectory> stations;  ///< where each is
  GuaranteedProblem problem;                            ///< in the coordinates z
  /// With observations: the whitened deviations from the reference, reduced with information_factor (F'y is
  /// information_factor' information_rhs). Empty without.
  Eigen::VectorXd information_rhs;
  /// |y - F z|^2 = |information_factor z - information_rhs|^2 + information_residual.
  double information_residual = 0.0;
  /// Place in problem.ellipsoids of the bounds position, velocity, segments in order; kNoEllipsoid for a
  /// bound that removes or leaves free all three axes.
  std::vector<Eigen::Index> ellipsoid_of_bound;
  /// The same for the biases of each station, behind those of the motion.
  std::vector<Eigen::Index> ellipsoid_of_station;
  std::size_t observations = 0;  ///< measurements used
  /// The deviation from the reference that measurements are linearised about; absent: the reference itself.
  std::optional<trajectory::QuadraticSpline<double>> linearised_about;
  std::vector<double> time_offsets_s;  ///< linearised about, one per station

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

/// Where each station of a scenario is over time. Throws Error for a track that is not one.
[[nodiscard]] std::vector<trajectory::NominalTrajectory> station_paths(const Scenario& scenario);

/// Something that moves, as a station sees it that may move itself.
struct RelativeMotion {
  Eigen::Vector3d position_m;
  Eigen::Vector3d velocity_mps;
  Eigen::Vector3d acceleration_mps2;
};

/// The motion of `path` minus that of `station` at a time.
[[nodiscard]] inline RelativeMotion relative_motion(const trajectory::NominalTrajectory& path,
                                                    const trajectory::NominalTrajectory& station,
                                                    double t_s) {
  return {.position_m = path.position(t_s) - station.position(t_s),
          .velocity_mps = path.velocity(t_s) - station.velocity(t_s),
          .acceleration_mps2 = path.acceleration(t_s) - station.acceleration(t_s)};
}

/// What a measurement tagged t of a station is linearised about: the reference plus linearised_about, at the
/// station's linearised time.
[[nodiscard]] RelativeMotion linearised_motion(const TrajectoryProblem& problem, std::size_t station,
                                               double t_s);

/// Derivative of a measurement by the time at which it is made, of something that moves so.
[[nodiscard]] inline sensor::Padded time_rate(const sensor::Linearised& model, const RelativeMotion& motion) {
  return model.J_value_position * motion.velocity_mps + model.J_value_velocity * motion.acceleration_mps2;
}

/// Derivative of a station's measurement by all biases, 3 x q: zero for those of other stations. `rate`: by
/// the time offset.
[[nodiscard]] inline Eigen::Matrix<double, 3, Eigen::Dynamic> bias_columns(
    const std::vector<BiasParameter>& biases, std::size_t station, const sensor::Padded& rate) {
  Eigen::Matrix<double, 3, Eigen::Dynamic> result =
      Eigen::Matrix<double, 3, Eigen::Dynamic>::Zero(3, static_cast<Eigen::Index>(biases.size()));
  for (std::size_t k = 0; k < biases.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    if (biases[k].station != station) {
      continue;
    }
    if (biases[k].component == BiasParameter::kTimeOffset) {
      result.col(column) = rate;
    } else {
      result(biases[k].component, column) = 1.0;
    }
  }
  return result;
}

/// One component of a measurement, linearised and whitened; passed to for_each_whitened_row.
struct WhitenedRow {
  Eigen::Index segment = 0;                  ///< which the measurement belongs to
  Eigen::Matrix<double, 1, 9> coefficients;  ///< entries of the spline coefficients 3 segment ..
  Eigen::RowVectorXd biases;                 ///< entries of the stations' biases
  double deviation = 0.0;                    ///< from the reference; 0 where only planned
};

/// Calls `visit` for every component of every measurement, linearised as `problem` says. Throws Error where a
/// measurement cannot be linearised.
void for_each_whitened_row(const Scenario& scenario, const TrajectoryProblem& problem,
                           const std::function<void(const WhitenedRow&)>& visit);

/// What `assemble` returns without its matrices: coordinates, paths, what the measurements are linearised
/// about. O(n + r) time and memory for n measurements and r segments. Throws Error as `check` does.
[[nodiscard]] TrajectoryProblem describe_problem(const Scenario& scenario,
                                                 const trajectory::QuadraticSpline<double>* about = nullptr,
                                                 const std::vector<double>& time_offsets_s = {});

/// Writes the guaranteed problem of a scenario: linearises the measurements about the reference, whitens
/// them, and reduces them to a triangle.
///
/// | symbol | meaning                                                                         |
/// |--------|---------------------------------------------------------------------------------|
/// | F      | rows L_k^-1 [H_k B(t_k), E_k], W_k = L_k L_k' covariance, H_k Jacobian of the   |
/// |        | sensor                                                                          |
/// | E_k    | derivative by the biases of the measurement's station: 1 for its components,    |
/// |        | the rate of the measurement along the path for its time offset                  |
/// | C      | |C z|^2 = mean square of the deviation over the criterion, m^2; 0 for biases    |
/// | a_l    | rows of theta in bound l over their semi-axes; one more per station with biases |
///
/// Cost: O(n) time for n measurements in any order, O(p^2) memory besides the scenario.
/// Throws Error as `check` does, and where a measurement cannot be linearised (aircraft at the station).
///
/// `about`: a deviation from the reference to linearise about instead of zero (a spline with the scenario's
/// knots), `time_offsets_s` the same for the stations' clocks (one per station, or none: zero); parameters
/// and bounds remain deviations from the reference. (Measurements are linear in the other biases.)
[[nodiscard]] TrajectoryProblem assemble(const Scenario& scenario,
                                         const trajectory::QuadraticSpline<double>* about = nullptr,
                                         const std::vector<double>& time_offsets_s = {});

}  // namespace trammel::inline TRAMMEL_ABI

#ifndef TRAMMEL_COMPILED
#include "trammel/problem/assemble_impl.hpp"
#endif
