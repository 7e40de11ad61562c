// SPDX-License-Identifier: Apache-2.0
#include "igc.hpp"

#include <algorithm>

#include "file.hpp"
#include "trammel/core/error.hpp"

namespace trammel::io {

namespace {

constexpr double kDay_s = 86400.0;
constexpr std::size_t kFixLength = 35;  // of a B record without extensions

std::string_view without_end(std::string_view line) {
  const auto last = line.find_last_not_of(" \t\r");
  return line.substr(0, last == std::string_view::npos ? 0 : last + 1);
}

/// Columns of further digits in B records, from 0; length 0: not there.
struct Extension {
  std::size_t first = 0;
  std::size_t length = 0;
};

std::size_t end_of(const Extension& extension) { return extension.first + extension.length; }

class IgcReader {
 public:
  IgcReader(std::string_view text, const std::string& name) : rest_(text), name_(name) {}

  IgcLog read() {
    while (!rest_.empty()) {
      const auto end = rest_.find('\n');
      line_ = without_end(rest_.substr(0, end));
      rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
      ++number_;
      read_record();
    }
    if (log_.fixes.empty()) {
      throw Error({name_, "no B record", "at least one fix"});
    }
    return std::move(log_);
  }

 private:
  [[noreturn]] void fail(const std::string& field, std::string_view found,
                         const std::string& expected) const {
    throw Error(
        {name_ + ":" + std::to_string(number_) + ": " + field, "'" + std::string(found) + "'", expected});
  }

  void read_record() {
    if (line_.empty()) {
      return;
    }
    if (line_.front() == 'B') {
      read_fix();
    } else if (line_.front() == 'I') {
      read_extensions();
    } else if (subtype() == "DTE") {
      read_date();
    } else if (subtype() == "ALG") {
      const bool geoid =
          line_.find("GEO") != std::string_view::npos || line_.find("MSL") != std::string_view::npos;
      const bool ellipsoid = line_.find("ELL") != std::string_view::npos;
      log_.gnss_reference = geoid       ? AltitudeReference::kGeoid
                            : ellipsoid ? AltitudeReference::kEllipsoid
                                        : AltitudeReference::kUnknown;
    }
  }

  /// Letters 3 to 5 of an H record.
  [[nodiscard]] std::string_view subtype() const {
    constexpr std::size_t kFirst = 2;
    constexpr std::size_t kLength = 3;
    return line_.front() == 'H' && line_.size() >= kFirst + kLength ? line_.substr(kFirst, kLength)
                                                                    : std::string_view();
  }

  /// `count` digits from `first`.
  [[nodiscard]] int digits(std::string_view text, std::size_t first, std::size_t count,
                           const std::string& field) const {
    const std::string_view part = first < text.size() ? text.substr(first, count) : std::string_view();
    if (part.size() != count || part.find_first_not_of("0123456789") != std::string_view::npos) {
      fail(field, part, std::to_string(count) + " digits");
    }
    int value = 0;
    for (const char c : part) {
      value = 10 * value + (c - '0');
    }
    return value;
  }

  /// HFDTEDDMMYY or HFDTEDATE:DDMMYY[,NN]. Recorders may repeat it later in the log: the first one counts.
  void read_date() {
    std::string_view text = line_.substr(std::min<std::size_t>(5, line_.size()));
    const auto first = text.find_first_of("0123456789");
    if (first == std::string_view::npos) {
      fail("date", line_, "HFDTE with a date DDMMYY");
    }
    const int day = digits(text, first, 2, "date");
    const int month = digits(text, first + 2, 2, "date");
    const int year = digits(text, first + 4, 2, "date");
    constexpr int kFirstYear = 80;  // no GNSS before: 80 to 99 are the last century's
    const Epoch date =
        epoch_from_date(year + (year >= kFirstYear ? 1900 : 2000), static_cast<unsigned>(month),
                        static_cast<unsigned>(day), name_ + ":" + std::to_string(number_) + ": date");
    if (!has_date_) {
      log_.date = date;
      has_date_ = true;
    }
  }

  /// IccSSFFTTTSSFFTTT...: columns SS to FF of B records, counted from 1, hold what TTT says.
  void read_extensions() {
    const int count = digits(line_, 1, 2, "extensions");
    for (int i = 0; i < count; ++i) {
      const std::size_t at = 3 + 7 * static_cast<std::size_t>(i);
      const int first = digits(line_, at, 2, "extensions");
      const int last = digits(line_, at + 2, 2, "extensions");
      const std::string_view kind = at + 4 < line_.size() ? line_.substr(at + 4, 3) : std::string_view();
      if (kind.size() != 3 || first <= static_cast<int>(kFixLength) || last < first) {
        fail("extensions", line_, std::to_string(count) + " entries SSFFTTT with columns from 36 on");
      }
      const Extension extension{static_cast<std::size_t>(first - 1),
                                static_cast<std::size_t>(last - first + 1)};
      if (kind == "LAD") {
        latitude_digits_ = extension;
      } else if (kind == "LOD") {
        longitude_digits_ = extension;
      } else if (kind == "TDS") {
        second_digits_ = extension;
      }
    }
  }

  /// Decimal fraction of one unit of the last digit, 0 where there is no such extension.
  [[nodiscard]] double fraction(const Extension& extension, const std::string& field) const {
    if (extension.length == 0) {
      return 0.0;
    }
    double value = digits(line_, extension.first, extension.length, field);
    for (std::size_t i = 0; i < extension.length; ++i) {
      value /= 10;
    }
    return value;
  }

  [[nodiscard]] char letter(std::size_t at, std::string_view allowed, const std::string& field) const {
    if (at >= line_.size() || allowed.find(line_[at]) == std::string_view::npos) {
      fail(field, at < line_.size() ? line_.substr(at, 1) : std::string_view(),
           std::string(1, allowed[0]) + " or " + allowed[1]);
    }
    return line_[at];
  }

  /// Degrees from the columns DDMMmmmN or DDDMMmmmE.
  [[nodiscard]] double angle(std::size_t first, std::size_t degree_digits, int limit, std::string_view signs,
                             const Extension& further, const std::string& field) const {
    const int degrees = digits(line_, first, degree_digits, field);
    const double thousandths = digits(line_, first + degree_digits, 5, field) + fraction(further, field);
    constexpr double kThousandths = 60000.0;  // thousandths of a minute in a degree
    const double value = degrees + thousandths / kThousandths;
    if (thousandths >= kThousandths || value > limit) {
      fail(field, line_.substr(first, degree_digits + 5),
           "minutes below 60 and at most " + std::to_string(limit) + " degrees");
    }
    return letter(first + degree_digits + 5, signs, field) == signs[1] ? -value : value;
  }

  /// Metres in five columns, the first of which may be a minus sign.
  [[nodiscard]] double altitude(std::size_t first, const std::string& field) const {
    if (first < line_.size() && line_[first] == '-') {
      return -digits(line_, first + 1, 4, field);
    }
    return digits(line_, first, 5, field);
  }

  /// BHHMMSSDDMMmmmNDDDMMmmmEVPPPPPGGGGG.
  void read_fix() {
    if (!has_date_) {
      fail("B record", line_.substr(0, 7), "a header with the date (HFDTE) before the first fix");
    }
    const std::size_t length =
        std::max({kFixLength, end_of(latitude_digits_), end_of(longitude_digits_), end_of(second_digits_)});
    if (line_.size() < length) {
      fail("B record", line_, "at least " + std::to_string(length) + " characters");
    }
    const int hour = digits(line_, 1, 2, "time");
    const int minute = digits(line_, 3, 2, "time");
    const int second = digits(line_, 5, 2, "time");
    if (hour > 23 || minute > 59 || second > 59) {
      fail("time", line_.substr(1, 6), "HHMMSS of a day");
    }
    IgcFix fix;
    fix.line = number_;
    fix.latitude_deg = angle(7, 2, 90, "NS", latitude_digits_, "latitude");
    fix.longitude_deg = angle(15, 3, 180, "EW", longitude_digits_, "longitude");
    fix.valid = letter(24, "AV", "validity") == 'A';
    fix.pressure_altitude_m = altitude(25, "pressure altitude");
    fix.gnss_altitude_m = altitude(30, "GNSS altitude");
    fix.t_s = midnight_s_ + hour * 3600.0 + minute * 60.0 + second + fraction(second_digits_, "time");
    if (!log_.fixes.empty()) {
      const double step = fix.t_s - log_.fixes.back().t_s;  // half a day back or more: over midnight
      const double turn = step < -kDay_s / 2                       ? kDay_s
                          : step > kDay_s / 2 && midnight_s_ > 0.0 ? -kDay_s
                                                                   : 0.0;
      midnight_s_ += turn;
      fix.t_s += turn;
    }
    log_.fixes.push_back(fix);
  }

  std::string_view rest_;
  std::string name_;
  std::string_view line_;
  int number_ = 0;
  bool has_date_ = false;
  double midnight_s_ = 0.0;
  Extension latitude_digits_;
  Extension longitude_digits_;
  Extension second_digits_;
  IgcLog log_;
};

/// Mean of GNSS minus pressure altitude over valid fixes.
double mean_difference(const IgcLog& log) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const IgcFix& fix : log.fixes) {
    sum += fix.valid ? fix.gnss_altitude_m - fix.pressure_altitude_m : 0.0;
    count += fix.valid ? 1 : 0;
  }
  return count == 0 ? 0.0 : sum / static_cast<double>(count);
}

}  // namespace

IgcLog parse_igc(std::string_view text, const std::string& name) { return IgcReader(text, name).read(); }

IgcLog read_igc(const std::filesystem::path& file) { return parse_igc(read_text(file), file.string()); }

IgcPath local_path(const IgcLog& log, const LocalFrame& frame, const IgcPathSettings& settings) {
  IgcPath path;
  path.altitude_shift_m = settings.geoid_undulation_m;
  if (settings.altitude == IgcAltitude::kPressureShifted) {
    path.altitude_shift_m += mean_difference(log);
  }
  double first_s = 0.0;
  for (const IgcFix& fix : log.fixes) {
    if (!fix.valid) {
      ++path.invalid;
      continue;
    }
    const double t = path.times_s.empty() ? 0.0 : fix.t_s - first_s;
    if (!path.times_s.empty() && !(t > path.times_s.back())) {
      ++path.out_of_order;
      continue;
    }
    if (path.times_s.empty()) {
      first_s = fix.t_s;
      path.start = advance(log.date, fix.t_s, TimeScale::kUniform);  // recorders count no leap seconds
    }
    const double altitude =
        settings.altitude == IgcAltitude::kGnss ? fix.gnss_altitude_m : fix.pressure_altitude_m;
    path.times_s.push_back(t);
    path.positions_m.push_back(frame.local_from_geodetic(
        geodetic_from_degrees(fix.latitude_deg, fix.longitude_deg, altitude + path.altitude_shift_m)));
  }
  if (path.times_s.size() < 2) {
    throw Error({"flight log", std::to_string(path.times_s.size()) + " valid fixes with increasing times",
                 "at least two"});
  }
  return path;
}

Geodetic default_origin(const IgcLog& log) {
  const auto fix = std::find_if(log.fixes.begin(), log.fixes.end(), [](const IgcFix& f) { return f.valid; });
  if (fix == log.fixes.end()) {
    throw Error({"flight log", "no valid fix", "at least two"});
  }
  return geodetic_from_degrees(fix->latitude_deg, fix->longitude_deg, 0.0);
}

}  // namespace trammel::io
