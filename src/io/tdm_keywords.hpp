// SPDX-License-Identifier: Apache-2.0
/// @file
/// Keywords of CCSDS Tracking Data Messages.
#pragma once

#include <algorithm>
#include <array>
#include <string_view>

namespace trammel::io {

// Keywords of the tables 3-3 and 3-5; those ending in '_' take an index.
inline constexpr std::array<std::string_view, 41> kTdmMetadataKeywords{"TRACK_ID",
                                                                       "DATA_TYPES",
                                                                       "TIME_SYSTEM",
                                                                       "START_TIME",
                                                                       "STOP_TIME",
                                                                       "PARTICIPANT_",
                                                                       "MODE",
                                                                       "PATH",
                                                                       "PATH_",
                                                                       "EPHEMERIS_NAME_",
                                                                       "TRANSMIT_BAND",
                                                                       "RECEIVE_BAND",
                                                                       "TIMETAG_REF",
                                                                       "TURNAROUND_NUMERATOR",
                                                                       "FREQ_OFFSET",
                                                                       "TURNAROUND_DENOMINATOR",
                                                                       "INTEGRATION_REF",
                                                                       "INTEGRATION_INTERVAL",
                                                                       "RANGE_MODE",
                                                                       "RANGE_MODULUS",
                                                                       "RANGE_UNITS",
                                                                       "ANGLE_TYPE",
                                                                       "REFERENCE_FRAME",
                                                                       "INTERPOLATION",
                                                                       "DOPPLER_COUNT_BIAS",
                                                                       "INTERPOLATION_DEGREE",
                                                                       "TRANSMIT_DELAY_",
                                                                       "DOPPLER_COUNT_SCALE",
                                                                       "RECEIVE_DELAY_",
                                                                       "DOPPLER_COUNT_ROLLOVER",
                                                                       "DATA_QUALITY",
                                                                       "CORRECTION_ANGLE_",
                                                                       "CORRECTION_DOPPLER",
                                                                       "CORRECTION_RANGE",
                                                                       "CORRECTION_RECEIVE",
                                                                       "CORRECTION_TRANSMIT",
                                                                       "CORRECTION_MAG",
                                                                       "CORRECTION_RCS",
                                                                       "CORRECTIONS_APPLIED",
                                                                       "CORRECTION_ABERRATION_YEARLY",
                                                                       "CORRECTION_ABERRATION_DIURNAL"};
inline constexpr std::array<std::string_view, 28> kTdmDataKeywords{"ANGLE_",        "CARRIER_POWER",
                                                                   "CLOCK_BIAS",    "CLOCK_DRIFT",
                                                                   "DOR",           "DOPPLER_COUNT",
                                                                   "MAG",           "DOPPLER_INSTANTANEOUS",
                                                                   "PC_N0",         "DOPPLER_INTEGRATED",
                                                                   "PR_N0",         "PRESSURE",
                                                                   "RANGE",         "RCS",
                                                                   "RECEIVE_FREQ",  "RECEIVE_FREQ_",
                                                                   "RHUMIDITY",     "RECEIVE_PHASE_CT_",
                                                                   "STEC",          "TEMPERATURE",
                                                                   "TROPO_DRY",     "TRANSMIT_FREQ_",
                                                                   "TROPO_WET",     "TRANSMIT_FREQ_RATE_",
                                                                   "VLBI_DELAY",    "TRANSMIT_PHASE_CT_",
                                                                   "TRANSMIT_FREQ", "TRANSMIT_FREQ_RATE"};

/// Whether a keyword is one of those, with an index from 1 to 5 where it takes one.
template <std::size_t size>
[[nodiscard]] bool is_known(std::string_view keyword, const std::array<std::string_view, size>& known) {
  if (std::find(known.begin(), known.end(), keyword) != known.end()) {
    return keyword.back() != '_';
  }
  const bool indexed = keyword.size() > 2 && keyword.back() >= '1' && keyword.back() <= '5';
  return indexed &&
         std::find(known.begin(), known.end(), keyword.substr(0, keyword.size() - 1)) != known.end() &&
         keyword[keyword.size() - 2] == '_';
}

}  // namespace trammel::io
