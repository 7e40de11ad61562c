// SPDX-License-Identifier: Apache-2.0
/// @file
/// Flight logs in the IGC format of the gliding world (FAI Technical Specification for GNSS Flight Recorders,
/// appendix A), and the path they hold.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "epoch.hpp"
#include "trammel/geodesy/wgs84.hpp"

namespace trammel::io {

/// One B record.
struct IgcFix {
  double t_s = 0.0;  ///< since midnight of the header's date, UTC; grows over later midnights
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double pressure_altitude_m = 0.0;  ///< in the standard atmosphere, above 1013.25 hPa
  double gnss_altitude_m = 0.0;      ///< above the ellipsoid or the geoid: see IgcLog::gnss_reference
  bool valid = true;                 ///< 'A', a three-dimensional fix; false: 'V', no GNSS altitude
  int line = 0;                      ///< in the file, from 1
};

/// What GNSS altitudes of a log are counted from (H record ALG).
enum class AltitudeReference { kUnknown, kEllipsoid, kGeoid };

struct IgcLog {
  Epoch date;  ///< midnight UTC of the header's date
  AltitudeReference gnss_reference = AltitudeReference::kUnknown;
  std::vector<IgcFix> fixes;  ///< in file order
};

/// Reads the date (HFDTE, old and new form), the altitude reference (H record ALG), the extensions LAD, LOD
/// and TDS of B records (further digits) and all B records; other records are passed over. A time of day
/// more than half a day before the one before it is the next day's. Throws Error naming file and line for a
/// malformed record, a missing date or a log without B records.
[[nodiscard]] IgcLog read_igc(const std::filesystem::path& file);
/// The same from text; `name` is used in messages.
[[nodiscard]] IgcLog parse_igc(std::string_view text, const std::string& name);

/// Which altitude a path is made of.
enum class IgcAltitude {
  kGnss,             ///< GNSS altitude; invalid fixes are left out
  kPressure,         ///< pressure altitude, taken as height
  kPressureShifted,  ///< pressure altitude plus the mean of GNSS minus pressure altitude over valid fixes:
                     ///< smooth like the one, unbiased on average like the other
};

/// How to make a path.
struct IgcPathSettings {
  IgcAltitude altitude = IgcAltitude::kGnss;
  double geoid_undulation_m = 0.0;  ///< added to altitudes: height above ellipsoid minus above sea level
};

/// A path in a local frame.
struct IgcPath {
  std::vector<double> times_s;  ///< since the first sample, strictly increasing
  std::vector<Eigen::Vector3d> positions_m;
  Epoch start;                    ///< UTC instant of the first sample
  double altitude_shift_m = 0.0;  ///< what was added to the altitudes read, undulation included
  std::size_t invalid = 0;        ///< fixes left out because they are invalid
  std::size_t out_of_order = 0;   ///< fixes left out because their time does not increase
};

/// East, north, up of the valid fixes of a log about an origin. Throws Error if fewer than two remain.
[[nodiscard]] IgcPath local_path(const IgcLog& log, const LocalFrame& frame, const IgcPathSettings& settings);

/// Place of the first valid fix at height 0, a frame's origin where the user names none; Error if none is
/// valid.
[[nodiscard]] Geodetic default_origin(const IgcLog& log);

}  // namespace trammel::io
