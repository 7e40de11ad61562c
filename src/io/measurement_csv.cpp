// SPDX-License-Identifier: Apache-2.0
#include "measurement_csv.hpp"

#include <algorithm>
#include <array>

#include "csv.hpp"
#include "measurement_wide.hpp"
#include "trammel/core/error.hpp"
#include "trammel/problem/noise.hpp"

namespace trammel::io {

namespace {

std::string numbered(char letter, Eigen::Index i) { return letter + std::to_string(i + 1); }

std::string entry_name(Eigen::Index i, Eigen::Index j) { return numbered('c', i) + std::to_string(j + 1); }

constexpr Eigen::Index kMostComponents = 3;

/// Columns of a measurement file; -1 where absent.
struct MeasurementColumns {
  std::size_t t = 0;
  std::size_t station = 0;
  std::array<int, 3> value{-1, -1, -1};
  std::array<std::array<int, 3>, 3> covariance{{{-1, -1, -1}, {-1, -1, -1}, {-1, -1, -1}}};
};

MeasurementColumns find_columns(const CsvTable& table) {
  MeasurementColumns columns;
  std::vector<std::string> known{"t_s", "station"};
  const auto optional_column = [&](const std::string& name) {
    known.push_back(name);
    return table.has_column(name) ? static_cast<int>(table.column(name)) : -1;
  };
  columns.t = table.column("t_s");
  columns.station = table.column("station");
  for (Eigen::Index i = 0; i < kMostComponents; ++i) {
    columns.value[static_cast<std::size_t>(i)] = optional_column(numbered('y', i));
    for (Eigen::Index j = i; j < kMostComponents; ++j) {
      columns.covariance[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] =
          optional_column(entry_name(i, j));
    }
  }
  (void)table.column("y1");
  for (std::size_t i = 0; i < table.header.size(); ++i) {
    const std::string& name = table.header[i];
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      throw Error({table.file, "an unknown column '" + name + "'",
                   "t_s,station,y1[,y2[,y3]] and optionally c11,c12,c13,c22,c23,c33"});
    }
    if (std::find(table.header.begin(), table.header.begin() + static_cast<std::ptrdiff_t>(i), name) !=
        table.header.begin() + static_cast<std::ptrdiff_t>(i)) {
      throw Error({table.file, "column '" + name + "' twice", "each column once"});
    }
  }
  return columns;
}

bool is_given(const CsvTable& table, std::size_t row, int column) {
  return column >= 0 && static_cast<std::size_t>(column) < table.rows[row].size() &&
         !table.rows[row][static_cast<std::size_t>(column)].empty();
}

Eigen::VectorXd read_value(const CsvTable& table, std::size_t row, const MeasurementColumns& columns,
                           const Station& station) {
  const Eigen::Index size = components(station.kind);
  const std::string expected = std::to_string(size) + " values, as '" + station.name + "' measures " +
                               std::string(describe(station.kind).name);
  Eigen::VectorXd value(size);
  for (Eigen::Index i = 0; i < kMostComponents; ++i) {
    const int column = columns.value[static_cast<std::size_t>(i)];
    const bool given = is_given(table, row, column);
    if (given != (i < size)) {
      throw Error({table.where(row) + ": column '" + numbered('y', i) + "'",
                   given ? "a value" : (column < 0 ? "no such column" : "nothing"), expected});
    }
    if (given) {
      value[i] = table.number(row, static_cast<std::size_t>(column));
    }
  }
  return value;
}

std::optional<Eigen::MatrixXd> read_row_covariance(const CsvTable& table, std::size_t row,
                                                   const MeasurementColumns& columns,
                                                   const Station& station) {
  const Eigen::Index size = components(station.kind);
  Eigen::MatrixXd covariance(size, size);
  std::string missing;
  bool any = false;
  for (Eigen::Index i = 0; i < kMostComponents; ++i) {
    for (Eigen::Index j = i; j < kMostComponents; ++j) {
      const int column = columns.covariance[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
      const bool given = is_given(table, row, column);
      any = any || given;
      if (given && j >= size) {
        throw Error({table.where(row) + ": column '" + entry_name(i, j) + "'", "a value",
                     "a covariance of " + std::to_string(size) + " by " + std::to_string(size) + ", as '" +
                         station.name + "' measures " + std::string(describe(station.kind).name)});
      }
      if (given) {
        covariance(i, j) = covariance(j, i) = table.number(row, static_cast<std::size_t>(column));
      } else if (j < size) {
        missing += (missing.empty() ? "" : ",") + entry_name(i, j);
      }
    }
  }
  if (!any) {
    return std::nullopt;
  }
  if (!missing.empty()) {
    throw Error({table.where(row) + ": covariance", "no value in " + missing,
                 "all entries of the upper triangle, or none"});
  }
  (void)noise_factor(covariance, size, table.where(row) + ":");
  return covariance;
}

}  // namespace

void require_within_knots(double t_s, const std::vector<double>& knots_s, const std::string& where) {
  if (!(t_s >= knots_s.front() && t_s <= knots_s.back())) {
    throw Error(
        {where, "time " + shortest(t_s) + " s",
         "a time within the knots, " + shortest(knots_s.front()) + " to " + shortest(knots_s.back()) + " s"});
  }
}

std::vector<Measurement> read_measurements(const std::filesystem::path& file, const Scenario& scenario) {
  const CsvTable table = read_csv(file);
  if (is_wide_form(table)) {
    const std::size_t t_column = table.column("t_s");
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
      require_within_knots(table.number(row, t_column), scenario.knots_s,
                           table.where(row) + ": column 't_s'");
    }
    return read_wide_form(table, scenario.stations);
  }
  const MeasurementColumns columns = find_columns(table);
  if (table.rows.empty()) {
    throw Error({table.file, "a header and no rows", "at least one measurement"});
  }
  std::vector<Measurement> measurements;
  measurements.reserve(table.rows.size());
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    Measurement measurement;
    measurement.t_s = table.number(row, columns.t);
    require_within_knots(measurement.t_s, scenario.knots_s, table.where(row) + ": column 't_s'");
    const std::string name =
        is_given(table, row, static_cast<int>(columns.station)) ? table.rows[row][columns.station] : "";
    const auto station = std::find_if(scenario.stations.begin(), scenario.stations.end(),
                                      [&](const Station& s) { return s.name == name; });
    if (station == scenario.stations.end()) {
      std::string names;
      for (const Station& known : scenario.stations) {
        names += (names.empty() ? "" : ", ") + known.name;
      }
      throw Error({table.where(row) + ": column 'station'", "'" + name + "'",
                   names.empty() ? "a station, but the scenario has none" : "one of " + names});
    }
    measurement.station = static_cast<std::size_t>(station - scenario.stations.begin());
    measurement.value = read_value(table, row, columns, *station);
    measurement.covariance = read_row_covariance(table, row, columns, *station);
    measurements.push_back(std::move(measurement));
  }
  return measurements;
}

std::string format_measurements(const std::vector<Measurement>& measurements,
                                const std::vector<Station>& stations) {
  Eigen::Index columns = 1;
  Eigen::Index covariance_size = 0;
  for (const Measurement& measurement : measurements) {
    columns = std::max(columns, measurement.value.size());
    covariance_size =
        std::max(covariance_size, measurement.covariance ? measurement.covariance->rows() : Eigen::Index{0});
  }
  std::string text = "t_s,station";
  for (Eigen::Index i = 0; i < columns; ++i) {
    text += "," + numbered('y', i);
  }
  for (Eigen::Index i = 0; i < covariance_size; ++i) {
    for (Eigen::Index j = i; j < covariance_size; ++j) {
      text += "," + entry_name(i, j);
    }
  }
  text += "\n";
  for (const Measurement& measurement : measurements) {
    text += shortest(measurement.t_s) + "," + stations[measurement.station].name;
    for (Eigen::Index i = 0; i < columns; ++i) {
      text += "," + (i < measurement.value.size() ? shortest(measurement.value[i]) : std::string());
    }
    for (Eigen::Index i = 0; i < covariance_size; ++i) {
      for (Eigen::Index j = i; j < covariance_size; ++j) {
        const bool has = measurement.covariance && j < measurement.covariance->rows();
        text += "," + (has ? shortest((*measurement.covariance)(i, j)) : std::string());
      }
    }
    text += "\n";
  }
  return text;
}

PathSamples read_path(const std::filesystem::path& file, double begin_s, double end_s) {
  const CsvTable table = read_csv(file);
  const std::array<std::size_t, 4> columns{table.column("t_s"), table.column("x_m"), table.column("y_m"),
                                           table.column("z_m")};
  constexpr std::array<std::string_view, 10> kKnown{
      "t_s", "x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps", "guaranteed_rms_m", "u1_mps", "u2_mps"};
  for (const std::string& name : table.header) {
    if (std::find(kKnown.begin(), kKnown.end(), name) == kKnown.end()) {
      throw Error({table.file, "an unknown column '" + name + "'", "t_s,x_m,y_m,z_m"});
    }
  }
  PathSamples path;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const double t = table.number(row, columns[0]);
    if (!path.times_s.empty() && !(t > path.times_s.back())) {
      throw Error({table.where(row) + ": column 't_s'",
                   shortest(t) + " after " + shortest(path.times_s.back()), "strictly increasing times"});
    }
    path.times_s.push_back(t);
    path.positions_m.emplace_back(table.number(row, columns[1]), table.number(row, columns[2]),
                                  table.number(row, columns[3]));
  }
  if (path.times_s.size() < 2) {
    throw Error({table.file, std::to_string(path.times_s.size()) + " rows", "at least two samples"});
  }
  if (!(path.times_s.front() <= begin_s && path.times_s.back() >= end_s)) {
    throw Error(
        {table.file,
         "samples from " + shortest(path.times_s.front()) + " to " + shortest(path.times_s.back()) + " s",
         "samples that cover the knots, " + shortest(begin_s) + " to " + shortest(end_s) +
             " s (a path is never extrapolated)"});
  }
  return path;
}

}  // namespace trammel::io
