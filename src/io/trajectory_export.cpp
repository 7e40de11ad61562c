// SPDX-License-Identifier: Apache-2.0
#include "trajectory_export.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "csv.hpp"
#include "json_output.hpp"
#include "trammel/core/error.hpp"

namespace trammel::io {

namespace {

constexpr double kMetresPerKilometre = 1000.0;
constexpr std::array<const char*, 3> kPositionColumns{"x_m", "y_m", "z_m"};
constexpr std::array<const char*, 3> kVelocityColumns{"vx_mps", "vy_mps", "vz_mps"};
constexpr const char* kGuaranteedColumn = "guaranteed_rms_m";

std::vector<std::string> column_names(const TrajectoryTable& trajectory) {
  std::vector<std::string> names{"t_s"};
  names.insert(names.end(), kPositionColumns.begin(), kPositionColumns.end());
  if (!trajectory.velocities_mps.empty()) {
    names.insert(names.end(), kVelocityColumns.begin(), kVelocityColumns.end());
  }
  if (!trajectory.guaranteed_rms_m.empty()) {
    names.emplace_back(kGuaranteedColumn);
  }
  return names;
}

std::vector<double> row_of(const TrajectoryTable& trajectory, std::size_t i) {
  std::vector<double> row{trajectory.times_s[i]};
  const auto append = [&](const Eigen::Vector3d& v) { row.insert(row.end(), v.data(), v.data() + v.size()); };
  append(trajectory.positions_m[i]);
  if (!trajectory.velocities_mps.empty()) {
    append(trajectory.velocities_mps[i]);
  }
  if (!trajectory.guaranteed_rms_m.empty()) {
    row.push_back(trajectory.guaranteed_rms_m[i]);
  }
  return row;
}

std::vector<PlaceDegrees> places(const TrajectoryTable& trajectory, const Geodetic& origin) {
  const LocalFrame frame(origin);
  std::vector<PlaceDegrees> all;
  for (const Eigen::Vector3d& p : trajectory.positions_m) {
    all.push_back(to_degrees(frame.geodetic_from_local(p)));
  }
  return all;
}

std::string stamp(const ExportSettings& settings, double t_s) {
  return format_epoch(advance(settings.epoch, t_s, TimeScale::kUtc));
}

void require_rows(const TrajectoryTable& trajectory) {
  require(!trajectory.times_s.empty(), "trajectory", "no rows", "at least one");
}

void require_line(const std::string& text, const std::string& where) {
  const bool blank = text.empty() || text.front() == ' ' || text.back() == ' ';
  if (blank || std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < ' '; })) {
    throw Error({where, "'" + text + "'", "one line of text without blanks at its ends"});
  }
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

}  // namespace

PlaceDegrees to_degrees(const Geodetic& place) {
  return {place.latitude_rad / kRadiansPerDegree, place.longitude_rad / kRadiansPerDegree, place.height_m};
}

PlaceDegrees origin_degrees(const Geodetic& origin) {
  constexpr double kStep = 1e12;
  const PlaceDegrees exact = to_degrees(origin);
  return {std::round(exact.latitude_deg * kStep) / kStep, std::round(exact.longitude_deg * kStep) / kStep,
          exact.height_m};
}

std::string origin_text(const Geodetic& origin) {
  const PlaceDegrees degrees = origin_degrees(origin);
  return "WGS84 latitude " + shortest(degrees.latitude_deg) + " deg, longitude " +
         shortest(degrees.longitude_deg) + " deg, height " + shortest(degrees.height_m) +
         " m above the ellipsoid";
}

TrajectoryTable read_trajectory(const std::filesystem::path& file) {
  const CsvTable table = read_csv(file);
  TrajectoryTable trajectory;
  const bool moving = table.has_column(kVelocityColumns[0]) || table.has_column(kVelocityColumns[1]) ||
                      table.has_column(kVelocityColumns[2]);
  const bool guaranteed = table.has_column(kGuaranteedColumn);
  const auto columns = [&](const std::array<const char*, 3>& names) {
    return std::array<std::size_t, 3>{table.column(names[0]), table.column(names[1]), table.column(names[2])};
  };
  const std::size_t t_column = table.column("t_s");
  const auto position = columns(kPositionColumns);
  const auto velocity = moving ? columns(kVelocityColumns) : position;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const auto vector = [&](const std::array<std::size_t, 3>& c) {
      return Eigen::Vector3d(table.number(row, c[0]), table.number(row, c[1]), table.number(row, c[2]));
    };
    const double t = table.number(row, t_column);
    if (!trajectory.times_s.empty() && !(t > trajectory.times_s.back())) {
      throw Error({table.where(row) + ": column 't_s'",
                   shortest(t) + " after " + shortest(trajectory.times_s.back()),
                   "strictly increasing times"});
    }
    trajectory.times_s.push_back(t);
    trajectory.positions_m.push_back(vector(position));
    if (moving) {
      trajectory.velocities_mps.push_back(vector(velocity));
    }
    if (guaranteed) {
      const std::size_t column = table.column(kGuaranteedColumn);
      const bool computed = column < table.rows[row].size() && !table.rows[row][column].empty() &&
                            table.rows[row][column] != "nan";
      trajectory.guaranteed_rms_m.push_back(computed ? table.number(row, column) : std::nan(""));
    }
  }
  const std::vector<std::string> known = column_names(trajectory);
  for (std::size_t i = 0; i < table.header.size(); ++i) {
    const std::string& name = table.header[i];
    if (!table.rows.empty() && std::find(known.begin(), known.end(), name) == known.end()) {
      throw Error({table.file, "an unknown column '" + name + "'",
                   "t_s,x_m,y_m,z_m[,vx_mps,vy_mps,vz_mps][,guaranteed_rms_m]"});
    }
    if (table.column(name) != i) {
      throw Error({table.file, "column '" + name + "' twice", "each column once"});
    }
  }
  if (table.rows.empty()) {
    throw Error({table.file, "a header and no rows", "at least one sample"});
  }
  return trajectory;
}

std::string format_oem(const TrajectoryTable& trajectory, const ExportSettings& settings) {
  require_rows(trajectory);
  require(!trajectory.velocities_mps.empty(), "trajectory", "no velocities",
          "columns vx_mps,vy_mps,vz_mps: an Orbit Ephemeris Message needs them");
  require_line(settings.originator, "originator");
  require_line(settings.object_name, "object name");
  require_line(settings.object_id, "object id");
  const LocalFrame frame(settings.origin);
  std::string text =
      "CCSDS_OEM_VERS = 2.0\n"
      "COMMENT Earth-fixed WGS84 coordinates, which agree with ITRF2000 to centimetres.\n"
      "COMMENT Velocities are over ground (relative to the rotating frame).\n"
      "COMMENT Computed in east, north, up axes at " +
      origin_text(settings.origin) + ".\nCREATION_DATE = " + format_epoch(settings.creation) +
      "\nORIGINATOR = " + settings.originator + "\nMETA_START\n";
  double largest = -1.0;
  for (const double value : trajectory.guaranteed_rms_m) {
    largest = value > largest ? value : largest;
  }
  if (largest >= 0.0) {
    text += "COMMENT Largest guaranteed rms position error: " + shortest(largest) + " m.\n";
  }
  text += "OBJECT_NAME = " + settings.object_name + "\nOBJECT_ID = " + settings.object_id +
          "\nCENTER_NAME = EARTH\nREF_FRAME = ITRF2000\nTIME_SYSTEM = UTC\nSTART_TIME = " +
          stamp(settings, trajectory.times_s.front()) +
          "\nSTOP_TIME = " + stamp(settings, trajectory.times_s.back()) + "\n";
  if (trajectory.times_s.size() > 1) {
    text += "INTERPOLATION = HERMITE\nINTERPOLATION_DEGREE = 3\n";
  }
  text += "META_STOP\n";
  for (std::size_t i = 0; i < trajectory.times_s.size(); ++i) {
    text += stamp(settings, trajectory.times_s[i]);
    const Eigen::Vector3d position = frame.ecef_from_local(trajectory.positions_m[i]) / kMetresPerKilometre;
    const Eigen::Vector3d velocity = frame.ecef_velocity(trajectory.velocities_mps[i]) / kMetresPerKilometre;
    for (const Eigen::Vector3d& v : {position, velocity}) {
      text += " " + shortest(v[0]) + " " + shortest(v[1]) + " " + shortest(v[2]);
    }
    text += "\n";
  }
  return text;
}

std::string format_kml(const TrajectoryTable& trajectory, const ExportSettings& settings) {
  require_rows(trajectory);
  require_line(settings.object_name, "object name");
  const std::string undulation = shortest(settings.geoid_undulation_m);
  const std::string name = escaped(settings.object_name);
  std::string text =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<kml xmlns=\"http://www.opengis.net/kml/2.2\" xmlns:gx=\"http://www.google.com/kml/ext/2.2\">\n"
      "<Document>\n<name>" +
      name +
      "</name>\n<description>Altitudes are metres above mean sea level: height above the WGS84 ellipsoid "
      "minus a geoid undulation of " +
      undulation + " m. Local frame: " + origin_text(settings.origin) +
      ".</description>\n"
      "<ExtendedData><Data name=\"geoid_undulation_m\"><value>" +
      undulation + "</value></Data></ExtendedData>\n";
  if (!trajectory.guaranteed_rms_m.empty()) {
    text +=
        "<Schema id=\"trajectory\"><gx:SimpleArrayField name=\"guaranteed_rms_m\" type=\"float\">"
        "<displayName>guaranteed rms position error (m)</displayName></gx:SimpleArrayField></Schema>\n";
  }
  text += "<Placemark>\n<name>" + name + "</name>\n<gx:Track>\n<altitudeMode>absolute</altitudeMode>\n";
  for (const double t : trajectory.times_s) {
    text += "<when>" + stamp(settings, t) + "Z</when>\n";
  }
  for (const PlaceDegrees& place : places(trajectory, settings.origin)) {
    text += "<gx:coord>" + shortest(place.longitude_deg) + " " + shortest(place.latitude_deg) + " " +
            shortest(place.height_m - settings.geoid_undulation_m) + "</gx:coord>\n";
  }
  if (!trajectory.guaranteed_rms_m.empty()) {
    text +=
        "<ExtendedData><SchemaData schemaUrl=\"#trajectory\">"
        "<gx:SimpleArrayData name=\"guaranteed_rms_m\">\n";
    for (const double value : trajectory.guaranteed_rms_m) {
      text += "<gx:value>" + (std::isnan(value) ? std::string("NaN") : shortest(value)) + "</gx:value>\n";
    }
    text += "</gx:SimpleArrayData></SchemaData></ExtendedData>\n";
  }
  return text + "</gx:Track>\n</Placemark>\n</Document>\n</kml>\n";
}

std::string format_czml(const TrajectoryTable& trajectory, const ExportSettings& settings) {
  require_rows(trajectory);
  require_line(settings.object_name, "object name");
  const std::string begin = stamp(settings, trajectory.times_s.front()) + "Z";
  const std::string interval = begin + "/" + stamp(settings, trajectory.times_s.back()) + "Z";
  const std::string epoch = format_epoch(settings.epoch) + "Z";
  Json samples = Json::array();
  const std::vector<PlaceDegrees> all = places(trajectory, settings.origin);
  for (std::size_t i = 0; i < all.size(); ++i) {
    samples.push_back(trajectory.times_s[i]);
    samples.push_back(all[i].longitude_deg);
    samples.push_back(all[i].latitude_deg);
    samples.push_back(all[i].height_m);
  }
  constexpr double kSpeedUp = 10.0;  // of the viewer's clock: a minute of flight in six seconds
  Json document;
  document["id"] = "document";
  document["name"] = settings.object_name;
  document["version"] = "1.0";
  document["clock"] = {{"interval", interval},
                       {"currentTime", begin},
                       {"multiplier", kSpeedUp},
                       {"range", "LOOP_STOP"},
                       {"step", "SYSTEM_CLOCK_MULTIPLIER"}};
  Json packet;
  packet["id"] = settings.object_id == "UNKNOWN" ? settings.object_name : settings.object_id;
  packet["name"] = settings.object_name;
  packet["description"] =
      "Heights are metres above the WGS84 ellipsoid. Local frame: " + origin_text(settings.origin) + ".";
  packet["availability"] = interval;
  packet["position"] = {{"epoch", epoch},
                        {"interpolationAlgorithm", "LINEAR"},
                        {"interpolationDegree", 1},
                        {"cartographicDegrees", samples}};
  const Json colour = {{"rgba", {255, 140, 0, 255}}};
  packet["path"] = {{"width", 2}, {"material", {{"solidColor", {{"color", colour}}}}}};
  packet["point"] = {{"pixelSize", 8}, {"color", colour}};
  Json guaranteed = Json::array();
  for (std::size_t i = 0; i < trajectory.guaranteed_rms_m.size(); ++i) {
    if (!std::isnan(trajectory.guaranteed_rms_m[i])) {
      guaranteed.push_back(trajectory.times_s[i]);
      guaranteed.push_back(trajectory.guaranteed_rms_m[i]);
    }
  }
  if (!guaranteed.empty()) {
    packet["properties"] = {{kGuaranteedColumn, {{"epoch", epoch}, {"number", guaranteed}}}};
  }
  return dump(Json::array({document, packet}));
}

std::string format_trajectory_json(const TrajectoryTable& trajectory, const ExportSettings& settings) {
  require_rows(trajectory);
  const PlaceDegrees origin = origin_degrees(settings.origin);
  Json json;
  json["object"] = settings.object_name;
  json["epoch"] = format_epoch(settings.epoch) + "Z";
  json["time_system"] = "UTC";
  json["origin"] = {{"latitude_deg", origin.latitude_deg},
                    {"longitude_deg", origin.longitude_deg},
                    {"height_m", origin.height_m}};
  json["geoid_undulation_m"] = settings.geoid_undulation_m;
  std::vector<std::string> columns = column_names(trajectory);
  columns.insert(columns.end(), {"latitude_deg", "longitude_deg", "height_m"});
  json["columns"] = columns;
  json["rows"] = Json::array();
  const std::vector<PlaceDegrees> all = places(trajectory, settings.origin);
  for (std::size_t i = 0; i < all.size(); ++i) {
    Json row = Json::array();
    for (const double value : row_of(trajectory, i)) {
      row.push_back(to_json(value));
    }
    row.push_back(all[i].latitude_deg);
    row.push_back(all[i].longitude_deg);
    row.push_back(all[i].height_m);
    json["rows"].push_back(row);
  }
  return dump(json);
}

std::string format_trajectory_csv(const TrajectoryTable& trajectory,
                                  const std::vector<std::string>& comments) {
  std::string text;
  for (const std::string& comment : comments) {
    text += "# " + comment + "\n";
  }
  std::vector<std::vector<double>> rows;
  for (std::size_t i = 0; i < trajectory.times_s.size(); ++i) {
    rows.push_back(row_of(trajectory, i));
  }
  return text + format_csv(column_names(trajectory), rows);
}

}  // namespace trammel::io
