// SPDX-License-Identifier: Apache-2.0
/// @file
/// A scenario: everything a user says about a flight, its bounds and its measurements, as plain data.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/sensor/kind.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// Positions over time.
struct PathSamples {
  std::vector<double> times_s;  ///< strictly increasing, at least two
  std::vector<Eigen::Vector3d> positions_m;
};

/// Semi-axes of the ellipsoid that confines a station's constant errors: 0 none, infinity unbounded.
struct StationBias {
  Eigen::VectorXd components;  ///< one per component, in its unit: what a reading is too large; empty: none
  double time_s = 0.0;         ///< a reading tagged t was made at t + offset
};

/// A measuring station.
struct Station {
  std::string name;
  SensorKind kind = SensorKind::kRange;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< where it stands, unless it has a track
  /// components x components, symmetric positive definite: the covariance of the noise or an upper bound of
  /// it. Everything guaranteed holds for every smaller covariance (in the semidefinite order) as well.
  Eigen::MatrixXd covariance = {};
  std::vector<double> times_s = {};  ///< planned measurement times (used when there are no observations)
  PathSamples track = {};  ///< where it moves: joined as NominalTrajectory::through does; empty: it stands
  StationBias bias = {};
};

/// One measurement of one station.
struct Measurement {
  double t_s = 0.0;
  std::size_t station = 0;                    ///< index into Scenario::stations
  Eigen::VectorXd value;                      ///< components in the order of the station's kind
  std::optional<Eigen::MatrixXd> covariance;  ///< instead of the station's
};

/// The reference path: a straight line from the first knot, or samples joined smoothly.
struct NominalPath {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  std::vector<double> sample_times_s;  ///< strictly increasing; empty: the straight line
  std::vector<Eigen::Vector3d> sample_positions_m;
};

/// Semi-axes of the ellipsoids that confine the deviation from the reference: 0 removes a parameter
/// exactly, infinity leaves it unbounded.
struct MotionBounds {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> acceleration_mps2;  ///< one per segment
};

/// What the mean-square error is averaged over.
enum class CriterionKind { kIntegral, kTimes, kWindow, kFinal };

struct Criterion {
  CriterionKind kind = CriterionKind::kIntegral;
  std::vector<double> times_s;                         ///< kTimes: mean over these times
  Eigen::Vector2d window_s = Eigen::Vector2d::Zero();  ///< kWindow: integral mean over [begin, end]
};

/// Everything together. Times in seconds, lengths in metres, angles in radians, one Cartesian frame.
struct Scenario {
  std::string title;
  std::vector<double> knots_s;  ///< strictly increasing, at least two
  NominalPath nominal;
  MotionBounds bounds;
  Criterion criterion;
  std::vector<Station> stations;
  std::vector<Measurement> observations;  ///< empty: design quantities only

  [[nodiscard]] std::size_t segments() const { return knots_s.size() - 1; }
};

}  // namespace trammel::inline TRAMMEL_ABI
