// SPDX-License-Identifier: Apache-2.0
#include "measurement_wide.hpp"

#include <algorithm>
#include <map>
#include <optional>

#include "trammel/core/error.hpp"
#include "trammel/sensor/kind.hpp"

namespace trammel::io {

std::vector<std::string> component_columns(SensorKind kind) {
  switch (kind) {
    case SensorKind::kDirectionCosinesRange:
      return {"cosine_x", "cosine_y", "range_m"};
    case SensorKind::kAzimuthElevationRange:
      return {"azimuth_rad", "elevation_rad", "range_m"};
    case SensorKind::kRange:
      return {"range_m"};
    case SensorKind::kDirectionCosines:
      return {"cosine_x", "cosine_y"};
    case SensorKind::kAzimuthElevation:
      return {"azimuth_rad", "elevation_rad"};
    case SensorKind::kRangeRate:
      return {"range_rate_mps"};
    case SensorKind::kPosition:
      return {"x_m", "y_m", "z_m"};
  }
  return {};
}

namespace {

/// A station's part of the header: its components and their columns.
struct StationColumns {
  std::string station;
  std::map<std::string, std::size_t> column;  ///< by component
};

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    text += (text.empty() ? "" : ", ") + word;
  }
  return text;
}

/// The header, station by station. The last dot parts name and component: a name may have dots too.
std::vector<StationColumns> split_header(const CsvTable& table) {
  std::vector<StationColumns> all;
  for (std::size_t i = 0; i < table.header.size(); ++i) {
    const std::string& name = table.header[i];
    if (name == "t_s") {
      if (i != table.column("t_s")) {
        throw Error({table.file, "column 't_s' twice", "each column once"});
      }
      continue;
    }
    const auto dot = name.rfind('.');
    if (dot == std::string::npos || dot == 0 || dot + 1 == name.size()) {
      throw Error({table.file, "an unknown column '" + name + "'", "t_s or NAME.COMPONENT"});
    }
    const std::string station = name.substr(0, dot);
    auto found = std::find_if(all.begin(), all.end(),
                              [&](const StationColumns& known) { return known.station == station; });
    if (found == all.end()) {
      all.push_back({station, {}});
      found = all.end() - 1;
    }
    if (!found->column.emplace(name.substr(dot + 1), i).second) {
      throw Error({table.file, "column '" + name + "' twice", "each column once"});
    }
  }
  (void)table.column("t_s");
  return all;
}

/// Columns of a kind's components in their order; nothing if the header has others.
std::optional<std::vector<std::size_t>> columns_of(const StationColumns& header, SensorKind kind) {
  const std::vector<std::string> names = component_columns(kind);
  std::vector<std::size_t> columns;
  for (std::size_t i = 0; i < names.size(); ++i) {
    auto found = header.column.find(names[i]);
    found = found == header.column.end() ? header.column.find("y" + std::to_string(i + 1)) : found;
    if (found == header.column.end()) {
      return std::nullopt;
    }
    columns.push_back(found->second);
  }
  return columns.size() == header.column.size() ? std::optional(columns) : std::nullopt;
}

std::vector<std::string> names_of(const StationColumns& header) {
  std::vector<std::string> names;
  for (const auto& [component, column] : header.column) {
    names.push_back(component);
  }
  return names;
}

}  // namespace

bool is_wide_form(const CsvTable& table) {
  return !table.has_column("station") &&
         std::any_of(table.header.begin(), table.header.end(),
                     [](const std::string& name) { return name.find('.') != std::string::npos; });
}

std::vector<Station> wide_form_stations(const CsvTable& table) {
  std::vector<Station> stations;
  for (const StationColumns& header : split_header(table)) {
    std::optional<SensorKind> kind;
    for (const SensorText& candidate : kSensorTable) {
      const std::vector<std::string> names = component_columns(candidate.kind);
      const bool same = names.size() == header.column.size() &&
                        std::all_of(names.begin(), names.end(),
                                    [&](const std::string& name) { return header.column.count(name) > 0; });
      kind = same ? std::optional(candidate.kind) : kind;
    }
    if (!kind) {
      throw Error({table.file + ": columns of station '" + header.station + "'", joined(names_of(header)),
                   "the components of a kind, as azimuth_rad, elevation_rad, range_m"});
    }
    Station station;
    station.name = header.station;
    station.kind = *kind;
    stations.push_back(std::move(station));
  }
  return stations;
}

std::vector<Measurement> read_wide_form(const CsvTable& table, const std::vector<Station>& stations) {
  struct Known {
    std::size_t station;
    std::vector<std::size_t> columns;
  };
  std::vector<Known> all;
  for (const StationColumns& header : split_header(table)) {
    const auto station = std::find_if(stations.begin(), stations.end(),
                                      [&](const Station& s) { return s.name == header.station; });
    if (station == stations.end()) {
      std::vector<std::string> names;
      for (const Station& known : stations) {
        names.push_back(known.name);
      }
      throw Error({table.file + ": column '" + table.header[header.column.begin()->second] + "'",
                   "station '" + header.station + "'",
                   names.empty() ? "a station, but the scenario has none" : "one of " + joined(names)});
    }
    const auto columns = columns_of(header, station->kind);
    if (!columns) {
      throw Error({table.file + ": columns of station '" + header.station + "'", joined(names_of(header)),
                   joined(component_columns(station->kind)) + ", as it measures " +
                       std::string(describe(station->kind).name)});
    }
    all.push_back({static_cast<std::size_t>(station - stations.begin()), *columns});
  }
  const std::size_t t_column = table.column("t_s");
  std::vector<Measurement> measurements;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const auto is_given = [&](std::size_t column) {
      return column < table.rows[row].size() && !table.rows[row][column].empty();
    };
    const double t_s = table.number(row, t_column);
    for (const Known& known : all) {
      if (std::none_of(known.columns.begin(), known.columns.end(), is_given)) {
        continue;
      }
      Measurement measurement;
      measurement.t_s = t_s;
      measurement.station = known.station;
      measurement.value.resize(static_cast<Eigen::Index>(known.columns.size()));
      for (std::size_t i = 0; i < known.columns.size(); ++i) {
        if (!is_given(known.columns[i])) {
          throw Error({table.where(row) + ": column '" + table.header[known.columns[i]] + "'", "nothing",
                       "a value, as other cells of the station in this row have one"});
        }
        measurement.value[static_cast<Eigen::Index>(i)] = table.number(row, known.columns[i]);
      }
      measurements.push_back(std::move(measurement));
    }
  }
  if (measurements.empty()) {
    throw Error({table.file, "no measurement", "at least one"});
  }
  return measurements;
}

std::string format_wide_form(const std::vector<Measurement>& measurements,
                             const std::vector<Station>& stations) {
  std::string text = "t_s";
  std::vector<std::size_t> first_column;
  std::size_t columns = 0;
  for (const Station& station : stations) {
    if (station.name.empty() || station.name.find_first_of(",\n\r#") != std::string::npos) {
      throw Error({"station", "'" + station.name + "'", "a name without comma, '#' or line break"});
    }
    first_column.push_back(columns);
    for (const std::string& component : component_columns(station.kind)) {
      text += "," + station.name + "." + component;
      ++columns;
    }
  }
  text += "\n";
  std::map<double, std::vector<std::vector<std::string>>> rows;  // of a time, as many as needed
  for (const Measurement& measurement : measurements) {
    const Station& station = stations[measurement.station];
    if (measurement.covariance) {
      throw Error({"station '" + station.name + "'",
                   "a covariance of its own at " + shortest(measurement.t_s) + " s",
                   "none: the wide form has no columns for it, the long form has"});
    }
    const std::size_t first = first_column[measurement.station];
    auto& same_time = rows[measurement.t_s];
    auto row = std::find_if(same_time.begin(), same_time.end(),
                            [&](const std::vector<std::string>& cells) { return cells[first].empty(); });
    if (row == same_time.end()) {
      same_time.emplace_back(columns);
      row = same_time.end() - 1;
    }
    for (Eigen::Index i = 0; i < measurement.value.size(); ++i) {
      (*row)[first + static_cast<std::size_t>(i)] = shortest(measurement.value[i]);
    }
  }
  for (const auto& [t_s, same_time] : rows) {
    for (const std::vector<std::string>& cells : same_time) {
      text += shortest(t_s);
      for (const std::string& cell : cells) {
        text += "," + cell;
      }
      text += "\n";
    }
  }
  return text;
}

}  // namespace trammel::io
