// SPDX-License-Identifier: Apache-2.0
/// @file
/// Trajectories on the Earth for other programs: CCSDS OEM, KML, CZML and JSON.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "epoch.hpp"
#include "trammel/geodesy/wgs84.hpp"

namespace trammel::io {

/// A trajectory in a local frame as trajectory.csv holds it.
struct TrajectoryTable {
  std::vector<double> times_s;  ///< strictly increasing
  std::vector<Eigen::Vector3d> positions_m;
  std::vector<Eigen::Vector3d> velocities_mps;  ///< one per time, or none
  std::vector<double> guaranteed_rms_m;         ///< one per time (NaN: not computed), or none
};

/// Reads `t_s,x_m,y_m,z_m[,vx_mps,vy_mps,vz_mps][,guaranteed_rms_m]`. Throws Error naming file, line and
/// column.
[[nodiscard]] TrajectoryTable read_trajectory(const std::filesystem::path& file);

/// A place in the units of map formats.
struct PlaceDegrees {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double height_m = 0.0;  ///< above the ellipsoid
};

/// Degrees of a place.
[[nodiscard]] PlaceDegrees to_degrees(const Geodetic& place);

/// Degrees of a frame's origin, without the rounding errors of the conversion to radians: to 1e-12 deg, less
/// than a micrometre.
[[nodiscard]] PlaceDegrees origin_degrees(const Geodetic& origin);

/// "WGS84 latitude 50 deg, longitude 30 deg, height 200 m above the ellipsoid".
[[nodiscard]] std::string origin_text(const Geodetic& origin);

/// Where and when a trajectory is, and what files say about it.
struct ExportSettings {
  Geodetic origin;  ///< of the local frame
  Epoch epoch;      ///< UTC instant of t_s = 0
  double geoid_undulation_m =
      0.0;  ///< height above ellipsoid minus height above mean sea level, at the origin
  std::string object_name = "TRAJECTORY";
  std::string object_id = "UNKNOWN";
  std::string originator = "TRAMMEL";
  Epoch creation;  ///< UTC
};

/// CCSDS Orbit Ephemeris Message (502.0, version 2.0), keyword-value form: Earth-fixed positions (km) and
/// velocities over ground (km/s) in WGS84, named ITRF2000 since the two agree to centimetres; UTC to the
/// nanosecond. Throws Error for a trajectory without velocities: the format demands them.
[[nodiscard]] std::string format_oem(const TrajectoryTable& trajectory, const ExportSettings& settings);

/// KML 2.2 with one gx:Track, altitude mode absolute: altitudes above mean sea level, that is height above
/// the ellipsoid minus the undulation, which the file states. The guaranteed error is an array beside it.
[[nodiscard]] std::string format_kml(const TrajectoryTable& trajectory, const ExportSettings& settings);

/// CZML 1.0: a document packet and a packet with sampled position (longitude, latitude in degrees, height
/// above the ellipsoid in metres), path and the guaranteed error as a sampled property.
[[nodiscard]] std::string format_czml(const TrajectoryTable& trajectory, const ExportSettings& settings);

/// JSON: `{"object", "epoch", "time_system", "origin": {latitude_deg, longitude_deg, height_m},
/// "geoid_undulation_m", "columns": [names], "rows": [[numbers]]}`. The columns are those of trajectory.csv
/// followed by latitude_deg, longitude_deg, height_m (above the ellipsoid).
[[nodiscard]] std::string format_trajectory_json(const TrajectoryTable& trajectory,
                                                 const ExportSettings& settings);

/// The columns of trajectory.csv with `comments`, one per line, above them.
[[nodiscard]] std::string format_trajectory_csv(const TrajectoryTable& trajectory,
                                                const std::vector<std::string>& comments);

}  // namespace trammel::io
