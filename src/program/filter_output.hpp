// SPDX-License-Identifier: Apache-2.0
/// @file
/// Results of `trammel filter design` as JSON and as text.
#pragma once

#include <string>

#include "../io/filter_file.hpp"
#include "../io/json_output.hpp"
#include "trammel/filter/analysis.hpp"
#include "trammel/filter/design.hpp"

namespace trammel::program {

/// A design with its analysis and, where a bound was given, its guarantees.
struct FilterReport {
  io::FilterFile file;
  filter::FilterDesign design;
  filter::FilterAnalysis analysis;
};

[[nodiscard]] FilterReport make_filter_report(io::FilterFile file);
[[nodiscard]] io::Json filter_report_json(const FilterReport& report);
/// The JSON report for people.
[[nodiscard]] std::string filter_report_text(const FilterReport& report);

}  // namespace trammel::program
