// SPDX-License-Identifier: Apache-2.0
#include "epoch.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "csv.hpp"
#include "trammel/core/error.hpp"

namespace trammel::io {

namespace {

namespace chrono = std::chrono;

constexpr std::int64_t kDay_s = 86400;
constexpr std::int64_t kNanoseconds = 1'000'000'000;

constexpr std::int64_t day_number(int year, unsigned month, unsigned day) {
  const chrono::year_month_day date{chrono::year{year}, chrono::month{month}, chrono::day{day}};
  return chrono::sys_days{date}.time_since_epoch().count();
}

// Days that ended with a leap second (IERS Bulletin C).
constexpr std::array<std::int64_t, 27> kLeapDays{
    day_number(1972, 6, 30),  day_number(1972, 12, 31), day_number(1973, 12, 31), day_number(1974, 12, 31),
    day_number(1975, 12, 31), day_number(1976, 12, 31), day_number(1977, 12, 31), day_number(1978, 12, 31),
    day_number(1979, 12, 31), day_number(1981, 6, 30),  day_number(1982, 6, 30),  day_number(1983, 6, 30),
    day_number(1985, 6, 30),  day_number(1987, 12, 31), day_number(1989, 12, 31), day_number(1990, 12, 31),
    day_number(1992, 6, 30),  day_number(1993, 6, 30),  day_number(1994, 6, 30),  day_number(1995, 12, 31),
    day_number(1997, 6, 30),  day_number(1998, 12, 31), day_number(2005, 12, 31), day_number(2008, 12, 31),
    day_number(2012, 6, 30),  day_number(2015, 6, 30),  day_number(2016, 12, 31)};

/// Seconds from 1970-01-01 to the beginning of a day.
std::int64_t seconds_at(std::int64_t day, TimeScale scale) {
  std::int64_t seconds = day * kDay_s;
  if (scale == TimeScale::kUtc) {
    seconds += std::lower_bound(kLeapDays.begin(), kLeapDays.end(), day) - kLeapDays.begin();
  }
  return seconds;
}

/// Reads the digits of an epoch one group after the other.
struct EpochScanner {
  std::string_view rest;
  bool good = true;

  int digits(std::size_t count) {
    int value = 0;
    good = good && rest.size() >= count;
    for (std::size_t i = 0; good && i < count; ++i) {
      good = rest[i] >= '0' && rest[i] <= '9';
      value = 10 * value + (rest[i] - '0');
    }
    rest.remove_prefix(good ? count : 0);
    return value;
  }
  bool accept(char character) {
    const bool found = !rest.empty() && rest.front() == character;
    rest.remove_prefix(found ? 1 : 0);
    return found;
  }
  void expect(char character) { good = accept(character) && good; }
};

}  // namespace

Epoch parse_epoch(std::string_view text, const std::string& where) {
  const auto fail = [&](const char* expected) {
    throw Error({where, "'" + std::string(text) + "'", expected});
  };
  constexpr const char* kForm =
      "an epoch YYYY-MM-DDThh:mm:ss[.d...][Z] or YYYY-DDDThh:mm:ss[.d...][Z] that exists";
  EpochScanner scanner{text};
  const int year = scanner.digits(4);
  scanner.expect('-');
  Epoch epoch;
  const bool ordinal = scanner.good && scanner.rest.size() > 3 && scanner.rest[3] == 'T';
  if (ordinal) {
    const int day_of_year = scanner.digits(3);
    const int length = chrono::year{year}.is_leap() ? 366 : 365;
    scanner.good = scanner.good && year >= 1 && day_of_year >= 1 && day_of_year <= length;
    epoch.day = day_number(year, 1, 1) + day_of_year - 1;
  } else {
    const int month = scanner.digits(2);
    scanner.expect('-');
    const int day = scanner.digits(2);
    const chrono::year_month_day date{chrono::year{year}, chrono::month(static_cast<unsigned>(month)),
                                      chrono::day(static_cast<unsigned>(day))};
    scanner.good = scanner.good && year >= 1 && date.ok();
    epoch.day = scanner.good ? chrono::sys_days{date}.time_since_epoch().count() : 0;
  }
  scanner.expect('T');
  const int hour = scanner.digits(2);
  scanner.expect(':');
  const int minute = scanner.digits(2);
  scanner.expect(':');
  const int second = scanner.digits(2);
  if (!scanner.good || hour > 23 || minute > 59 || second > 60) {
    fail(kForm);
  }
  epoch.second_of_day = 3600 * hour + 60 * minute + second;
  if (second == 60 &&
      (epoch.second_of_day != kDay_s || !std::binary_search(kLeapDays.begin(), kLeapDays.end(), epoch.day))) {
    fail("a second below 60, or a leap second that UTC had");
  }
  if (scanner.accept('.')) {
    std::int64_t scale = kNanoseconds;
    bool round_up = false;
    const std::size_t before = scanner.rest.size();
    while (!scanner.rest.empty() && scanner.rest.front() >= '0' && scanner.rest.front() <= '9') {
      const int digit = scanner.digits(1);
      round_up = scale == 1 ? digit >= 5 : round_up;
      scale /= 10;
      epoch.nanosecond += scale * digit;
    }
    scanner.good = scanner.rest.size() < before;
    epoch.nanosecond += round_up ? 1 : 0;
  }
  (void)scanner.accept('Z');
  if (!scanner.good || !scanner.rest.empty()) {
    fail(kForm);
  }
  if (epoch.nanosecond == kNanoseconds) {
    epoch.nanosecond = 0;
    return advance(epoch, 1.0, TimeScale::kUtc);
  }
  return epoch;
}

std::string format_epoch(const Epoch& epoch) {
  const chrono::year_month_day date{chrono::sys_days{chrono::days{epoch.day}}};
  const std::int64_t leap = epoch.second_of_day / kDay_s;  // 1 within a leap second
  const std::int64_t second_of_day = epoch.second_of_day - leap;
  std::array<char, 64> buffer{};
  const int size = std::snprintf(
      buffer.data(), buffer.size(), "%04d-%02u-%02uT%02d:%02d:%02d.%09lld", static_cast<int>(date.year()),
      static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
      static_cast<int>(second_of_day / 3600), static_cast<int>(second_of_day / 60 % 60),
      static_cast<int>(second_of_day % 60 + leap), static_cast<long long>(epoch.nanosecond));
  std::string text(buffer.data(), static_cast<std::size_t>(size));
  text.erase(text.find_last_not_of('0') + 1);
  const std::size_t whole = text.find('.');
  if (text.size() == whole + 1) {
    text.pop_back();
  }
  return text;
}

double seconds_between(const Epoch& from, const Epoch& to, TimeScale scale) {
  const std::int64_t seconds =
      seconds_at(to.day, scale) + to.second_of_day - seconds_at(from.day, scale) - from.second_of_day;
  const std::int64_t nanoseconds = to.nanosecond - from.nanosecond;
  // In extended precision, so that decimal fractions come back as the nearest double.
  return static_cast<double>(static_cast<long double>(seconds) +
                             static_cast<long double>(nanoseconds) / static_cast<long double>(kNanoseconds));
}

Epoch advance(const Epoch& epoch, double seconds, TimeScale scale) {
  constexpr double kLongest_s = 4e11;  // above 9999 years, and far from overflow
  require(std::abs(seconds) < kLongest_s, "seconds after an epoch", shortest(seconds),
          "a finite time that stays within the years 1 to 9999");
  const double whole = std::floor(seconds);
  std::int64_t nanosecond =
      epoch.nanosecond + std::llround((seconds - whole) * static_cast<double>(kNanoseconds));
  std::int64_t total = seconds_at(epoch.day, scale) + epoch.second_of_day + static_cast<std::int64_t>(whole);
  total += nanosecond / kNanoseconds;
  nanosecond %= kNanoseconds;
  std::int64_t day = total / kDay_s;
  while (seconds_at(day, scale) > total) {
    --day;
  }
  while (seconds_at(day + 1, scale) <= total) {
    ++day;
  }
  require(day >= day_number(1, 1, 1) && day <= day_number(9999, 12, 31), "seconds after an epoch",
          shortest(seconds), "a time that stays within the years 1 to 9999");
  return {day, total - seconds_at(day, scale), nanosecond};
}

Epoch epoch_from_date(int year, unsigned month, unsigned day, const std::string& where) {
  const chrono::year_month_day date{chrono::year{year}, chrono::month{month}, chrono::day{day}};
  if (!date.ok()) {
    throw Error(
        {where,
         "day " + std::to_string(day) + ", month " + std::to_string(month) + ", year " + std::to_string(year),
         "a date that exists"});
  }
  return {chrono::sys_days{date}.time_since_epoch().count(), 0, 0};
}

Epoch now_utc() {
  const std::int64_t seconds =
      chrono::floor<chrono::seconds>(chrono::system_clock::now()).time_since_epoch().count();
  return {seconds / kDay_s, seconds % kDay_s, 0};
}

}  // namespace trammel::io
