// SPDX-License-Identifier: Apache-2.0
/// @file
/// `trammel filter run`: a table of coordinates through a designed filter.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "../io/csv.hpp"
#include "filter_output.hpp"

namespace trammel::program {

/// Estimates of one column.
struct FilteredColumn {
  std::string name;
  std::vector<std::vector<double>> estimates;  ///< per row of the table: x, x', ..
  std::vector<double> innovations;             ///< NaN where there is none
  std::vector<filter::SampleUse> use;
};

/// Filters every column but t_s on its own. Empty cells are missing samples; gaps of whole intervals are
/// bridged by prediction. Times must be multiples of the sampling interval after the first one, unless the
/// filter has a fading memory. Error with file and line otherwise.
[[nodiscard]] std::vector<FilteredColumn> run_filter(const FilterReport& report, const io::CsvTable& table);

/// Columns t_s and, per coordinate, estimate, derivatives, innovation and use (start_up, used, ..).
[[nodiscard]] std::string format_filtered(const io::CsvTable& table,
                                          const std::vector<FilteredColumn>& columns);

}  // namespace trammel::program
