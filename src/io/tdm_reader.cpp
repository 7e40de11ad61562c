// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "csv.hpp"
#include "file.hpp"
#include "kvn.hpp"
#include "tdm.hpp"
#include "tdm_keywords.hpp"
#include "tdm_sightings.hpp"
#include "trammel/core/error.hpp"
#include "trammel/geodesy/wgs84.hpp"

namespace trammel::io {

namespace {

constexpr double kMetresPerKilometre = 1000.0;
constexpr double kLightSpeed_kmps = 299792.458;  // exact, by the definition of the metre

struct Metadata {
  std::map<std::string, KvnLine> entries;
  std::string station;
  std::size_t legs = 0;  ///< of the signal's path, 0 if it is not told
  bool returns = false;  ///< the path ends where it began
};

class TdmReader {
 public:
  TdmReader(std::string_view text, const std::string& name, const TdmSettings& settings)
      : lines_(split_kvn(text, name)), name_(name), settings_(settings) {}

  TrackingData read() {
    read_header();
    while (next_ < lines_.size()) {
      read_metadata();
      read_records();
    }
    if (sightings_.empty()) {
      throw Error({name_, "no RANGE, ANGLE_1, ANGLE_2 or DOPPLER_INSTANTANEOUS", "at least one measurement"});
    }
    assemble(sightings_, name_, settings_.reference, data_);
    return std::move(data_);
  }

 private:
  [[nodiscard]] std::string where(const KvnLine& line) const {
    return name_ + ":" + std::to_string(line.number) + ": " + line.keyword;
  }
  [[noreturn]] void fail(const KvnLine& line, const std::string& expected) const {
    throw Error({where(line), line.has_value ? "'" + line.value + "'" : "no value", expected});
  }
  /// The next line; Error if the file ends.
  const KvnLine& take(std::string_view expected) {
    if (next_ == lines_.size()) {
      throw Error({name_, "the end of the file", std::string(expected)});
    }
    return lines_[next_++];
  }
  void take_bare(std::string_view keyword) {
    const KvnLine& line = take(keyword);
    if (line.keyword != keyword || line.has_value) {
      throw Error({name_ + ":" + std::to_string(line.number), "'" + line.keyword + "'",
                   std::string(keyword) + " on a line of its own"});
    }
  }

  void read_header() {
    const KvnLine& version = take("CCSDS_TDM_VERS = 1.0 or 2.0");
    if (version.keyword != "CCSDS_TDM_VERS") {
      throw Error({name_ + ":" + std::to_string(version.number), "'" + version.keyword + "'",
                   "CCSDS_TDM_VERS = 1.0 or 2.0 as the first line"});
    }
    if (version.value != "1.0" && version.value != "2.0") {
      fail(version, "1.0 or 2.0");
    }
    while (next_ < lines_.size() && lines_[next_].keyword != "META_START") {
      const KvnLine& line = lines_[next_++];
      if (line.keyword == "CREATION_DATE") {
        (void)parse_epoch(line.value, where(line));
      } else if (line.keyword != "ORIGINATOR" && line.keyword != "MESSAGE_ID") {
        throw Error({where(line), "an unknown keyword of the header",
                     "CREATION_DATE, ORIGINATOR, MESSAGE_ID or META_START"});
      }
    }
    if (next_ == lines_.size()) {
      throw Error({name_, "a header and no segment", "META_START"});
    }
  }

  void read_metadata() {
    take_bare("META_START");
    metadata_ = Metadata();
    while (true) {
      const KvnLine& line = take("META_STOP");
      if (line.keyword == "META_STOP") {
        --next_;
        break;
      }
      if (!is_known(line.keyword, kTdmMetadataKeywords)) {
        throw Error(
            {where(line), "an unknown keyword of the metadata", "a keyword of CCSDS 503.0, table 3-3"});
      }
      if (!line.has_value) {
        fail(line, "a value");
      }
      if (!metadata_.entries.emplace(line.keyword, line).second) {
        throw Error({where(line), "the keyword a second time", "each keyword once"});
      }
    }
    take_bare("META_STOP");
    check_metadata();
  }

  [[nodiscard]] const KvnLine* entry(const std::string& keyword) const {
    const auto found = metadata_.entries.find(keyword);
    return found == metadata_.entries.end() ? nullptr : &found->second;
  }
  /// Value of a keyword, one of those named; `otherwise` if it is absent.
  std::string choice(const std::string& keyword, std::initializer_list<std::string_view> names,
                     const std::string& otherwise) const {
    const KvnLine* line = entry(keyword);
    if (line == nullptr) {
      return otherwise;
    }
    std::string list;
    for (const std::string_view name : names) {
      if (line->value == name) {
        return line->value;
      }
      list += (list.empty() ? "" : ", ") + std::string(name);
    }
    fail(*line, "one of " + list);
  }
  [[nodiscard]] double number(const KvnLine& line, std::string_view text) const {
    double value = 0.0;
    if (!parse_number(text, value)) {
      throw Error({where(line), "'" + std::string(text) + "'", "a finite number"});
    }
    return value;
  }

  void check_metadata() {
    const int line = lines_[next_ - 1].number;
    const KvnLine* system = entry("TIME_SYSTEM");
    if (system == nullptr) {
      throw Error({name_ + ":" + std::to_string(line), "no TIME_SYSTEM in the metadata", "one"});
    }
    if (!data_.time_system.empty() && data_.time_system != system->value) {
      fail(*system, data_.time_system + " as in the segment before");
    }
    data_.time_system = system->value;
    const std::string reference = choice("TIMETAG_REF", {"RECEIVE", "TRANSMIT"}, "");
    if (has_segment_ && reference != data_.timetag_ref) {
      throw Error({name_ + ":" + std::to_string(line), "TIMETAG_REF '" + reference + "'",
                   "'" + data_.timetag_ref + "' as in the segment before"});
    }
    data_.timetag_ref = reference;
    has_segment_ = true;
    find_station(line);
  }

  /// Which participant is the station: the last of the path, or the one that is not the target.
  void find_station(int line) {
    std::map<char, std::string> participants;
    for (const auto& [keyword, value] : metadata_.entries) {
      if (keyword.substr(0, keyword.size() - 1) == "PARTICIPANT_") {
        participants[keyword.back()] = value.value;
      }
    }
    const std::string place = name_ + ":" + std::to_string(line);
    if (participants.empty()) {
      throw Error({place, "no PARTICIPANT_n in the metadata", "at least one"});
    }
    const KvnLine* path = entry("PATH");
    std::string indices;
    for (std::size_t i = 0; path != nullptr && i < path->value.size(); ++i) {
      const char c = path->value[i];
      if (i % 2 == 0 ? participants.count(c) == 0 : c != ',') {
        fail(*path, "indices of participants with commas between them, as 1,2,1");
      }
      indices += i % 2 == 0 ? std::string(1, c) : "";
    }
    if (path != nullptr && (indices.size() < 2 || path->value.size() % 2 == 0)) {
      fail(*path, "at least two participants, as 2,1");
    }
    metadata_.legs = indices.empty() ? 0 : indices.size() - 1;
    metadata_.returns = !indices.empty() && indices.front() == indices.back();
    metadata_.station = participants[indices.empty() ? participants.begin()->first : indices.back()];
    if (!settings_.target.empty()) {
      std::vector<std::string> others;
      for (const auto& [index, participant] : participants) {
        const bool on_path = indices.empty() || indices.find(index) != std::string::npos;
        if (participant != settings_.target && on_path) {
          others.push_back(participant);
        }
      }
      if (others.size() != 1) {
        throw Error(
            {place,
             std::to_string(others.size()) + " participants besides the target '" + settings_.target + "'",
             "one, the station"});
      }
      metadata_.station = others.front();
    }
    if (metadata_.station.find_first_of(",#") != std::string::npos) {
      throw Error({place, "the station '" + metadata_.station + "'", "a name without comma and '#'"});
    }
  }

  void read_records() {
    take_bare("DATA_START");
    while (true) {
      const KvnLine& line = take("DATA_STOP");
      if (line.keyword == "DATA_STOP") {
        --next_;
        break;
      }
      if (!is_known(line.keyword, kTdmDataKeywords)) {
        throw Error({where(line), "an unknown keyword of the data", "a keyword of CCSDS 503.0, table 3-5"});
      }
      read_record(line);
    }
    take_bare("DATA_STOP");
  }

  void read_record(const KvnLine& line) {
    const auto blank = line.value.find_first_of(" \t");
    if (blank == std::string::npos) {
      fail(line, "a time tag and a value");
    }
    const std::string_view all = line.value;
    const Epoch epoch = parse_epoch(all.substr(0, blank), where(line));
    const std::string_view text = all.substr(all.find_first_not_of(" \t", blank));
    double Sighting::*slot = nullptr;
    double value = 0.0;
    if (line.keyword == "RANGE") {
      slot = &Sighting::range_m;
      value = range_m(line, number(line, text));
    } else if (line.keyword == "ANGLE_1") {
      slot = &Sighting::azimuth_rad;
      value = angle_rad(line, number(line, text), 360.0);
    } else if (line.keyword == "ANGLE_2") {
      slot = &Sighting::elevation_rad;
      value = angle_rad(line, number(line, text), 90.0);
    } else if (line.keyword == "DOPPLER_INSTANTANEOUS") {
      slot = &Sighting::range_rate_mps;
      require_simple_path(line);
      value = kMetresPerKilometre * one_way(number(line, text) + correction("CORRECTION_DOPPLER"));
    } else {
      ++data_.left_out[line.keyword];
      return;
    }
    Sighting& sighting = sightings_[metadata_.station][{epoch.day, epoch.second_of_day, epoch.nanosecond}];
    sighting.line = sighting.line == 0 ? line.number : sighting.line;
    if (!std::isnan(sighting.*slot)) {
      throw Error({where(line), "a second value of '" + metadata_.station + "' at " + format_epoch(epoch),
                   "one value for each time tag"});
    }
    sighting.*slot = value;
  }

  /// Correction that is still to be added.
  [[nodiscard]] double correction(const std::string& keyword) const {
    const KvnLine* line = entry(keyword);
    if (line == nullptr) {
      return 0.0;
    }
    if (entry("CORRECTIONS_APPLIED") == nullptr) {
      fail(*line, "CORRECTIONS_APPLIED = YES or NO beside it");
    }
    return choice("CORRECTIONS_APPLIED", {"YES", "NO"}, "") == "NO" ? number(*line, line->value) : 0.0;
  }

  [[nodiscard]] double one_way(double value) const {
    const bool halve = metadata_.legs == 2 && settings_.two_way == TwoWayValue::kRoundTrip;
    return halve ? value / 2 : value;
  }

  /// Ranges and their rates must be along one line between the station and the target, and undelayed.
  void require_simple_path(const KvnLine& line) const {
    (void)choice("MODE", {"SEQUENTIAL"}, "");
    if (metadata_.legs > 2 || (metadata_.legs == 2 && !metadata_.returns)) {
      throw Error(
          {where(line), "PATH = " + entry("PATH")->value, "a one-way or two-way path, as 2,1 or 1,2,1"});
    }
    for (const auto& [keyword, delay] : metadata_.entries) {
      if (keyword.find("_DELAY_") != std::string::npos && number(delay, delay.value) != 0.0) {
        fail(delay, "no delay left in the measurements (0, or the keyword absent)");
      }
    }
  }

  [[nodiscard]] double range_m(const KvnLine& line, double value) const {
    require_simple_path(line);
    const KvnLine* modulus = entry("RANGE_MODULUS");
    if (modulus != nullptr && number(*modulus, modulus->value) != 0.0) {
      fail(*modulus, "0: ambiguous ranges are not resolved here");
    }
    value += correction("CORRECTION_RANGE");
    if (choice("RANGE_UNITS", {"km", "s"}, "km") == "s") {
      value *= kLightSpeed_kmps;
    }
    value = kMetresPerKilometre * one_way(value);
    if (!(value > 0.0)) {
      fail(line, "a range above 0");
    }
    return value;
  }

  [[nodiscard]] double angle_rad(const KvnLine& line, double value, double limit_deg) const {
    if (entry("ANGLE_TYPE") == nullptr) {
      throw Error({where(line), "no ANGLE_TYPE in the metadata", "ANGLE_TYPE = AZEL"});
    }
    (void)choice("ANGLE_TYPE", {"AZEL"}, "");
    value += correction("CORRECTION_" + line.keyword);
    if (!(std::abs(value) <= limit_deg)) {
      fail(line, "degrees from " + shortest(-limit_deg) + " to " + shortest(limit_deg));
    }
    return value * kRadiansPerDegree;
  }

  std::vector<KvnLine> lines_;
  std::string name_;
  TdmSettings settings_;
  std::size_t next_ = 0;
  bool has_segment_ = false;
  Metadata metadata_;
  TrackingData data_{{}, {}, {}, "", "", {}};
  Sightings sightings_;
};

}  // namespace

TrackingData parse_tdm(std::string_view text, const std::string& name, const TdmSettings& settings) {
  return TdmReader(text, name, settings).read();
}

TrackingData read_tdm(const std::filesystem::path& file, const TdmSettings& settings) {
  return parse_tdm(read_text(file), file.string(), settings);
}

}  // namespace trammel::io
