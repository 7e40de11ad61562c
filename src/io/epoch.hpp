// SPDX-License-Identifier: Apache-2.0
/// @file
/// Instants as tracking and orbit messages write them, and seconds between them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace trammel::io {

/// How a clock counts days.
enum class TimeScale {
  kUtc,      ///< leap seconds are counted: a second between two epochs is an SI second
  kUniform,  ///< every day has 86400 seconds (TAI, TT, GPS and the like)
};

/// An instant to the nanosecond.
struct Epoch {
  std::int64_t day = 0;            ///< days since 1970-01-01, Gregorian
  std::int64_t second_of_day = 0;  ///< 0 to 86399, 86400 within a leap second
  std::int64_t nanosecond = 0;     ///< 0 to 999999999
};

/// Reads `YYYY-MM-DDThh:mm:ss[.d..][Z]` or `YYYY-DDDThh:mm:ss[.d..][Z]` (ISO 8601 as in CCSDS 301.0, ASCII
/// time codes A and B; digits below the nanosecond are rounded). Second 60 only where UTC had a leap second.
/// Error at `where` otherwise.
[[nodiscard]] Epoch parse_epoch(std::string_view text, const std::string& where);

/// `YYYY-MM-DDThh:mm:ss[.d..]` with as many decimals as needed, up to nine.
[[nodiscard]] std::string format_epoch(const Epoch& epoch);

/// Seconds from `from` to `to`. Leap seconds known: those announced up to the one of 2016-12-31.
[[nodiscard]] double seconds_between(const Epoch& from, const Epoch& to, TimeScale scale);

/// The instant `seconds` after `epoch`, to the nearest nanosecond; Error unless the year is 1 to 9999.
[[nodiscard]] Epoch advance(const Epoch& epoch, double seconds, TimeScale scale);

/// An instant from a date (year, month 1-12, day 1-31) and seconds after its midnight; Error at `where`
/// unless the date exists.
[[nodiscard]] Epoch epoch_from_date(int year, unsigned month, unsigned day, const std::string& where);

/// The present, UTC, to the second.
[[nodiscard]] Epoch now_utc();

}  // namespace trammel::io
