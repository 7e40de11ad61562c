// SPDX-License-Identifier: Apache-2.0
/// @file
/// Measurements as CSV in wide form: one row for each time, columns for the components of all stations.
#pragma once

#include <string>
#include <vector>

#include "csv.hpp"
#include "trammel/problem/scenario.hpp"

namespace trammel::io {

/// Names of a kind's components with their units, in their order (the table at read_wide_form).
[[nodiscard]] std::vector<std::string> component_columns(SensorKind kind);

/// Whether a table is in wide form: columns NAME.COMPONENT and no column `station`.
[[nodiscard]] bool is_wide_form(const CsvTable& table);

/// The stations that the columns of a table in wide form name, in the order of the columns, with the kinds
/// that their components tell (name and kind only). Throws Error naming the file and the column where they
/// tell none.
[[nodiscard]] std::vector<Station> wide_form_stations(const CsvTable& table);

/// Reads a table in wide form, `t_s,NAME.COMPONENT,...`, rows in any order, a time in as many rows as need
/// be. NAME is a station's; COMPONENT is one of its kind's,
///
/// | kind                    | components                           |
/// |-------------------------|--------------------------------------|
/// | direction_cosines_range | cosine_x, cosine_y, range_m          |
/// | azimuth_elevation_range | azimuth_rad, elevation_rad, range_m  |
/// | range                   | range_m                              |
/// | direction_cosines       | cosine_x, cosine_y                   |
/// | azimuth_elevation       | azimuth_rad, elevation_rad           |
/// | range_rate              | range_rate_mps                       |
/// | position                | x_m, y_m, z_m                        |
///
/// or y1, y2, y3 as in the long form. Empty cells: no measurement of that station at that time; all or none
/// of a station's cells in a row are empty. Measurements come out in the order of rows, then of columns.
/// Throws Error naming file, line and column.
[[nodiscard]] std::vector<Measurement> read_wide_form(const CsvTable& table,
                                                      const std::vector<Station>& stations);

/// Measurements in wide form, times increasing, in as many rows for a time as its busiest station needs. A
/// measurement's own covariance has no column here and is an Error, as is a station whose name has a comma.
[[nodiscard]] std::string format_wide_form(const std::vector<Measurement>& measurements,
                                           const std::vector<Station>& stations);

}  // namespace trammel::io
