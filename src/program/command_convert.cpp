// SPDX-License-Identifier: Apache-2.0
// trammel convert: measurements and trajectories from one file format to another.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "../io/csv.hpp"
#include "../io/file.hpp"
#include "../io/igc.hpp"
#include "../io/json_output.hpp"
#include "../io/measurement_csv.hpp"
#include "../io/measurement_wide.hpp"
#include "../io/tdm.hpp"
#include "../io/trajectory_export.hpp"
#include "commands.hpp"
#include "trammel/core/error.hpp"

namespace trammel::program {

namespace {

constexpr const char* kFooter =
    R"(The endings of IN and OUT choose the conversion; options that it does not use are errors.

measurements
  .tdm -> .csv   CCSDS Tracking Data Message (503.0, keyword-value form) to a table in metres and radians:
                 RANGE -> range, ANGLE_1/2 (AZEL) -> azimuth_elevation, both -> azimuth_elevation_range,
                 DOPPLER_INSTANTANEOUS -> range_rate. The station is the last participant of PATH, or
                 PARTICIPANT_1 without PATH. A station that measures different sets at different times
                 becomes several: the fullest keeps the name, others are NAME:range and so on.
                 t_s = 0 is --epoch, or the earliest time tag (stated in a comment of the table).
                 [--epoch --form --target --two-way]
  .csv -> .tdm   a table in wide form, or in long form with a --kind for every station. Needs --epoch.
                 [--epoch --kind --target --originator]
  wide form: t_s,NAME.COMPONENT,... one row for each time, empty cells where a station measured nothing;
             COMPONENT: azimuth_rad elevation_rad range_m range_rate_mps cosine_x cosine_y x_m y_m z_m
  long form: t_s,station,y1[,y2[,y3]] one row for each measurement

trajectories
  .igc -> .csv   flight log to t_s,x_m,y_m,z_m: x east, y north, z up about --origin (or the first valid
                 fix at height 0), seconds since the first valid fix; both stated in comments. Invalid fixes
                 (V) and fixes whose time does not increase are left out and counted.
                 [--origin --altitude --geoid-undulation]
  .csv -> .oem .kml .czml .json
                 trajectory.csv (t_s,x_m,y_m,z_m[,vx_mps,vy_mps,vz_mps][,guaranteed_rms_m]) to a CCSDS
                 Orbit Ephemeris Message (502.0, Earth-fixed, km; needs velocities), KML (gx:Track,
                 altitudes above mean sea level), CZML or JSON. Needs --origin and --epoch.
                 [--origin --epoch --object-name; .oem: --object-id --originator; .czml: --object-id;
                 .kml .json: --geoid-undulation]
  .igc -> .kml .czml .json
                 the same from a flight log. [--origin --altitude --geoid-undulation --object-name;
                 .czml: --object-id]

With --json the standard output is
{"input", "output", "rows", "epoch", "origin": {latitude_deg, longitude_deg, height_m} | null,
"stations": [{name, kind}], "notes": [text]}; "rows" counts measurements or samples.)";

struct ConvertOptions {
  std::filesystem::path in;
  std::filesystem::path out;
  std::string epoch;
  std::string origin;
  double geoid_undulation_m = 0.0;
  std::string altitude = "gnss";
  std::string form = "wide";
  std::vector<std::string> kinds;
  std::string target;
  std::string two_way = "one-way";
  std::string object_name;
  std::string object_id;
  std::string originator;
  bool json = false;
};

/// What there is to tell about a conversion, and the text to write.
struct Outcome {
  std::string content;
  std::size_t rows = 0;
  io::Epoch epoch;
  std::string time_system = "UTC";
  std::optional<Geodetic> origin;
  std::vector<Station> stations;
  std::vector<std::string> notes;
};

std::string kind_name(SensorKind kind) { return std::string(describe(kind).name); }

/// "LATITUDE,LONGITUDE[,HEIGHT]" in degrees and metres.
Geodetic parse_origin(const std::string& text) {
  constexpr const char* kForm = "LATITUDE,LONGITUDE[,HEIGHT] in degrees and metres above the ellipsoid";
  std::array<double, 3> numbers{};
  std::size_t count = 0;
  std::string_view rest = text;
  for (bool more = true; more; ++count) {
    const auto comma = rest.find(',');
    more = comma != std::string_view::npos;
    if (count == numbers.size() || !io::parse_number(rest.substr(0, comma), numbers[count])) {
      throw Error({"--origin", "'" + text + "'", kForm});
    }
    rest.remove_prefix(more ? comma + 1 : rest.size());
  }
  require(count >= 2, "--origin", "'" + text + "'", kForm);
  return geodetic_from_degrees(numbers[0], numbers[1], numbers[2]);
}

io::Epoch required_epoch(const ConvertOptions& options) {
  require(!options.epoch.empty(), "--epoch", "nothing", "the UTC instant of t_s = 0, as 2024-05-01T12:00:00");
  return io::parse_epoch(options.epoch, "--epoch");
}

/// Stations of a table in long form from "NAME=KIND" texts.
std::vector<Station> parse_kinds(const std::vector<std::string>& texts) {
  std::vector<Station> stations;
  for (const std::string& text : texts) {
    const auto equals = text.rfind('=');
    const auto kind = equals == std::string::npos ? std::nullopt : find_sensor_kind(text.substr(equals + 1));
    if (!kind || equals == 0) {
      std::string names;
      for (const SensorText& known : kSensorTable) {
        names += (names.empty() ? "" : ", ") + std::string(known.name);
      }
      throw Error({"--kind", "'" + text + "'", "STATION=KIND with one of " + names});
    }
    Station station;
    station.name = text.substr(0, equals);
    station.kind = *kind;
    stations.push_back(std::move(station));
  }
  return stations;
}

Outcome tdm_to_csv(const ConvertOptions& options) {
  io::TdmSettings settings;
  if (!options.epoch.empty()) {
    settings.reference = io::parse_epoch(options.epoch, "--epoch");
  }
  settings.target = options.target;
  settings.two_way = options.two_way == "one-way" ? io::TwoWayValue::kOneWay : io::TwoWayValue::kRoundTrip;
  const io::TrackingData data = io::read_tdm(options.in, settings);
  Outcome outcome;
  outcome.rows = data.measurements.size();
  outcome.epoch = data.reference;
  outcome.time_system = data.time_system;
  outcome.stations = data.stations;
  outcome.content =
      "# t_s = 0 at " + io::format_epoch(data.reference) + " " + data.time_system +
      (data.timetag_ref.empty() ? "" : ", time tags: " + data.timetag_ref + " (no light time removed)") +
      "\n";
  for (const Station& station : data.stations) {
    outcome.content += "# station " + station.name + ": " + kind_name(station.kind) + "\n";
  }
  outcome.content += options.form == "wide" ? io::format_wide_form(data.measurements, data.stations)
                                            : io::format_measurements(data.measurements, data.stations);
  for (const auto& [keyword, count] : data.left_out) {
    outcome.notes.push_back("left out " + std::to_string(count) + " records of " + keyword);
  }
  return outcome;
}

Outcome csv_to_tdm(const ConvertOptions& options) {
  const io::CsvTable table = io::read_csv(options.in);
  io::TrackingData data;
  data.reference = required_epoch(options);
  if (io::is_wide_form(table)) {
    require(options.kinds.empty(), "--kind", "a kind", "none: the columns of the wide form tell the kinds");
    data.stations = io::wide_form_stations(table);
    data.measurements = io::read_wide_form(table, data.stations);
  } else {
    Scenario scenario;
    constexpr double kAlways = std::numeric_limits<double>::max();
    scenario.knots_s = {-kAlways, kAlways};
    scenario.stations = parse_kinds(options.kinds);
    if (scenario.stations.empty() && table.has_column("station")) {
      throw Error({"--kind", "nothing", "--kind STATION=KIND for every station of a table in long form"});
    }
    data.measurements = io::read_measurements(options.in, scenario);
    data.stations = scenario.stations;
  }
  io::TdmHeader header;
  header.creation = io::now_utc();
  header.target = options.target.empty() ? header.target : options.target;
  header.originator = options.originator.empty() ? header.originator : options.originator;
  Outcome outcome;
  outcome.rows = data.measurements.size();
  outcome.epoch = data.reference;
  outcome.stations = data.stations;
  outcome.content = io::format_tdm(data, header);
  const bool weighted = std::any_of(data.measurements.begin(), data.measurements.end(),
                                    [](const Measurement& m) { return m.covariance.has_value(); });
  if (weighted) {
    outcome.notes.emplace_back("left out covariances: the format has no place for them");
  }
  return outcome;
}

/// Text of a trajectory in the format of an ending.
std::string exported(const io::TrajectoryTable& trajectory, const ConvertOptions& options, Outcome& outcome) {
  io::ExportSettings settings;
  settings.origin = *outcome.origin;
  settings.epoch = outcome.epoch;
  settings.geoid_undulation_m = options.geoid_undulation_m;
  settings.object_name = options.object_name.empty() ? options.in.stem().string() : options.object_name;
  settings.object_id = options.object_id.empty() ? settings.object_id : options.object_id;
  settings.originator = options.originator.empty() ? settings.originator : options.originator;
  settings.creation = io::now_utc();
  const std::string ending = options.out.extension().string();
  if (ending == ".oem") {
    return io::format_oem(trajectory, settings);
  }
  if (ending == ".czml") {
    return io::format_czml(trajectory, settings);
  }
  if (ending == ".json") {
    return io::format_trajectory_json(trajectory, settings);
  }
  if (options.geoid_undulation_m == 0.0) {
    outcome.notes.emplace_back(
        "altitudes are heights above the ellipsoid: give --geoid-undulation for heights above sea level");
  }
  return io::format_kml(trajectory, settings);
}

Outcome csv_to_map(const ConvertOptions& options) {
  const io::TrajectoryTable trajectory = io::read_trajectory(options.in);
  require(!options.origin.empty(), "--origin", "nothing", "LATITUDE,LONGITUDE[,HEIGHT] of the local frame");
  Outcome outcome;
  outcome.rows = trajectory.times_s.size();
  outcome.origin = parse_origin(options.origin);
  outcome.epoch = required_epoch(options);
  outcome.content = exported(trajectory, options, outcome);
  return outcome;
}

Outcome igc_to_any(const ConvertOptions& options) {
  const io::IgcLog log = io::read_igc(options.in);
  Outcome outcome;
  outcome.origin = options.origin.empty() ? io::default_origin(log) : parse_origin(options.origin);
  io::IgcPathSettings settings;
  settings.geoid_undulation_m = options.geoid_undulation_m;
  settings.altitude = options.altitude == "gnss"       ? io::IgcAltitude::kGnss
                      : options.altitude == "pressure" ? io::IgcAltitude::kPressure
                                                       : io::IgcAltitude::kPressureShifted;
  const io::IgcPath path = io::local_path(log, LocalFrame(*outcome.origin), settings);
  outcome.rows = path.times_s.size();
  outcome.epoch = path.start;
  io::TrajectoryTable trajectory;
  trajectory.times_s = path.times_s;
  trajectory.positions_m = path.positions_m;
  if (options.out.extension() == ".csv") {
    const std::string altitude = options.altitude == "gnss" ? "GNSS" : "pressure";
    outcome.content = io::format_trajectory_csv(
        trajectory, {"origin: " + io::origin_text(*outcome.origin),
                     "axes: x east, y north, z up; t_s = 0 at " + io::format_epoch(path.start) + " UTC",
                     "heights: " + altitude + " altitude + " + shortest(path.altitude_shift_m) + " m"});
  } else {
    outcome.content = exported(trajectory, options, outcome);
  }
  if (path.invalid > 0) {
    outcome.notes.push_back("left out " + std::to_string(path.invalid) + " invalid fixes");
  }
  if (path.out_of_order > 0) {
    outcome.notes.push_back("left out " + std::to_string(path.out_of_order) +
                            " fixes whose time does not increase");
  }
  if (log.gnss_reference == io::AltitudeReference::kGeoid && options.altitude != "pressure" &&
      options.geoid_undulation_m == 0.0) {
    outcome.notes.emplace_back(
        "the log counts GNSS altitudes from the geoid: give --geoid-undulation for heights above the "
        "ellipsoid");
  }
  return outcome;
}

/// One line of the table of conversions.
struct Conversion {
  std::string_view from;
  std::string_view to;
  Outcome (*run)(const ConvertOptions&);
  std::vector<std::string> options;
};

const std::vector<Conversion>& conversions() {
  static const std::vector<Conversion> table{
      {".tdm", ".csv", tdm_to_csv, {"--epoch", "--form", "--target", "--two-way"}},
      {".csv", ".tdm", csv_to_tdm, {"--epoch", "--kind", "--target", "--originator"}},
      {".csv", ".oem", csv_to_map, {"--origin", "--epoch", "--object-name", "--object-id", "--originator"}},
      {".csv", ".kml", csv_to_map, {"--origin", "--epoch", "--object-name", "--geoid-undulation"}},
      {".csv", ".czml", csv_to_map, {"--origin", "--epoch", "--object-name", "--object-id"}},
      {".csv", ".json", csv_to_map, {"--origin", "--epoch", "--object-name", "--geoid-undulation"}},
      {".igc", ".csv", igc_to_any, {"--origin", "--altitude", "--geoid-undulation"}},
      {".igc", ".kml", igc_to_any, {"--origin", "--altitude", "--geoid-undulation", "--object-name"}},
      {".igc",
       ".czml",
       igc_to_any,
       {"--origin", "--altitude", "--geoid-undulation", "--object-name", "--object-id"}},
      {".igc", ".json", igc_to_any, {"--origin", "--altitude", "--geoid-undulation", "--object-name"}},
  };
  return table;
}

const Conversion& find_conversion(const ConvertOptions& options) {
  const std::string from = options.in.extension().string();
  const std::string to = options.out.extension().string();
  std::string known;
  for (const Conversion& conversion : conversions()) {
    if (conversion.from == from && conversion.to == to) {
      return conversion;
    }
    known += (known.empty() ? "" : ", ") + std::string(conversion.from) + " to " + std::string(conversion.to);
  }
  throw Error({"convert", "'" + from + "' to '" + to + "'", "one of " + known});
}

void require_used(const CLI::App& command, const Conversion& conversion) {
  for (const CLI::Option* option : command.get_options()) {
    const std::string name = option->get_name();
    const bool general = name.substr(0, 2) != "--" || name == "--json" || name == "--help";
    if (!general && option->count() > 0 &&
        std::find(conversion.options.begin(), conversion.options.end(), name) == conversion.options.end()) {
      throw Error({name,
                   "an option that " + std::string(conversion.from) + " to " + std::string(conversion.to) +
                       " does not use",
                   "it left out"});
    }
  }
}

io::Json to_json(const ConvertOptions& options, const Outcome& outcome) {
  io::Json json;
  json["input"] = options.in.string();
  json["output"] = options.out.string();
  json["rows"] = outcome.rows;
  json["epoch"] = io::format_epoch(outcome.epoch) + (outcome.time_system == "UTC" ? "Z" : "");
  json["origin"] = nullptr;
  if (outcome.origin) {
    const io::PlaceDegrees origin = io::origin_degrees(*outcome.origin);
    json["origin"] = {{"latitude_deg", origin.latitude_deg},
                      {"longitude_deg", origin.longitude_deg},
                      {"height_m", origin.height_m}};
  }
  json["stations"] = io::Json::array();
  for (const Station& station : outcome.stations) {
    json["stations"].push_back({{"name", station.name}, {"kind", kind_name(station.kind)}});
  }
  json["notes"] = outcome.notes;
  return json;
}

int run(const CLI::App& command, const ConvertOptions& options) {
  const Conversion& conversion = find_conversion(options);
  require_used(command, conversion);
  constexpr double kLargestUndulation_m = 150.0;  // those of the Earth are within -107 and 86 m
  if (!(std::abs(options.geoid_undulation_m) <= kLargestUndulation_m)) {
    throw Error({"--geoid-undulation", shortest(options.geoid_undulation_m), "metres from -150 to 150"});
  }
  const Outcome outcome = conversion.run(options);
  io::write_atomically(options.out, outcome.content);
  if (options.json) {
    std::cout << io::dump(to_json(options, outcome));
    return kSolved;
  }
  std::cout << options.out.string() << ": " << outcome.rows << " rows, t_s = 0 at "
            << io::format_epoch(outcome.epoch) << " " << outcome.time_system << "\n";
  if (outcome.origin) {
    std::cout << "origin: " + io::origin_text(*outcome.origin) << "\n";
  }
  for (const Station& station : outcome.stations) {
    std::cout << "station " << station.name << ": " << kind_name(station.kind) << "\n";
  }
  for (const std::string& note : outcome.notes) {
    std::cout << "note: " << note << "\n";
  }
  return kSolved;
}

}  // namespace

void add_convert(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("convert", "measurements and trajectories between file formats");
  const auto options = std::make_shared<ConvertOptions>();
  command->footer(kFooter);
  command->add_option("in", options->in, "file to read (.csv .tdm .igc)")->required();
  command->add_option("out", options->out, "file to write (.csv .tdm .oem .kml .czml .json)")->required();
  command->add_option("--epoch", options->epoch, "instant of t_s = 0, as 2024-05-01T12:00:00[.d] (UTC)");
  command->add_option("--origin", options->origin,
                      "LATITUDE,LONGITUDE[,HEIGHT] of the local frame: degrees, metres above the ellipsoid");
  command->add_option("--geoid-undulation", options->geoid_undulation_m,
                      "height above the ellipsoid minus height above sea level, m; added to altitudes read, "
                      "taken off altitudes written to KML");
  command
      ->add_option("--altitude", options->altitude,
                   "altitude of a flight log: gnss, pressure, or pressure-shifted by the mean difference")
      ->check(CLI::IsMember({"gnss", "pressure", "pressure-shifted"}));
  command->add_option("--form", options->form, "form of a measurement table: wide or long")
      ->check(CLI::IsMember({"wide", "long"}));
  command->add_option("--kind", options->kinds, "STATION=KIND, once for each station of a table in long form")
      ->expected(1)
      ->take_all();
  command->add_option("--target", options->target, "participant of a message that is observed");
  command
      ->add_option("--two-way", options->two_way,
                   "what two-way ranges of a message are: one-way (half the round trip) or round-trip")
      ->check(CLI::IsMember({"one-way", "round-trip"}));
  command->add_option("--object-name", options->object_name,
                      "name of the object (the input file's otherwise)");
  command->add_option("--object-id", options->object_id, "designator of the object");
  command->add_option("--originator", options->originator, "who made the message");
  command->add_flag("--json", options->json, "print a summary as JSON");
  command->callback(
      [command, options, &action] { action = [command, options] { return run(*command, *options); }; });
}

}  // namespace trammel::program
