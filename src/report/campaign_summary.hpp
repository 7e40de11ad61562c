// SPDX-License-Identifier: Apache-2.0
/// @file
/// What a campaign found, for programs and for people.
#pragma once

#include <string>

#include "../io/campaign_files.hpp"
#include "../io/csv.hpp"
#include "../io/json_output.hpp"

namespace trammel::report {

/// Summary of a campaign's merged table.
///
/// Always: kind, scenarios, library_version. Monte Carlo: runs, seed, motion, confidence, contradicted (how
/// many scenarios) and `studies`, one per scenario: scenario, runs, guaranteed_rms_m, actual_rms_m,
/// mean_square_m2, standard_error_m2, ratio and ratio_interval (mean square over guaranteed square),
/// largest_rms_m, contradicts; nonlinear_rms_m and nonlinear_ratio: the same where the measurements are not
/// linearised. Archive: `status` (number of flights by status), and of those with a finite
/// guarantee guaranteed_rms_m {smallest, median, largest}, the flight with the largest, largest_relative_gap.
[[nodiscard]] io::Json campaign_json(const io::CampaignManifest& manifest, const io::CsvTable& merged);

/// A few lines for a person, from campaign_json.
[[nodiscard]] std::string campaign_text(const io::Json& summary);

}  // namespace trammel::report
