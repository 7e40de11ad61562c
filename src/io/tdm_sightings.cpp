// SPDX-License-Identifier: Apache-2.0
#include "tdm_sightings.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/sensor/kind.hpp"

namespace trammel::io {

namespace {

// A station keeps its name for the first of these that it measures.
constexpr std::array<SensorKind, 4> kFullestFirst{SensorKind::kAzimuthElevationRange,
                                                  SensorKind::kAzimuthElevation, SensorKind::kRange,
                                                  SensorKind::kRangeRate};

std::size_t rank_of(SensorKind kind) {
  return static_cast<std::size_t>(std::find(kFullestFirst.begin(), kFullestFirst.end(), kind) -
                                  kFullestFirst.begin());
}

Epoch epoch_of(const Tag& tag) { return {std::get<0>(tag), std::get<1>(tag), std::get<2>(tag)}; }

using Parts = std::vector<std::pair<SensorKind, Eigen::VectorXd>>;

/// A sighting as measurements of the kinds there are.
Parts parts_of(const Sighting& sighting, const std::string& station, const std::string& file) {
  const bool azimuth = !std::isnan(sighting.azimuth_rad);
  const bool range = !std::isnan(sighting.range_m);
  if (azimuth != !std::isnan(sighting.elevation_rad)) {
    throw Error({file + ":" + std::to_string(sighting.line),
                 std::string("only ANGLE_") + (azimuth ? "1" : "2") + " of '" + station + "' at this time",
                 "both angles"});
  }
  Parts parts;
  if (azimuth && range) {
    parts.emplace_back(SensorKind::kAzimuthElevationRange,
                       Eigen::Vector3d(sighting.azimuth_rad, sighting.elevation_rad, sighting.range_m));
  } else if (azimuth) {
    parts.emplace_back(SensorKind::kAzimuthElevation,
                       Eigen::Vector2d(sighting.azimuth_rad, sighting.elevation_rad));
  } else if (range) {
    parts.emplace_back(SensorKind::kRange, Eigen::VectorXd::Constant(1, sighting.range_m));
  }
  if (!std::isnan(sighting.range_rate_mps)) {
    parts.emplace_back(SensorKind::kRangeRate, Eigen::VectorXd::Constant(1, sighting.range_rate_mps));
  }
  return parts;
}

/// Index of the station of that name in `data`, added when new.
std::size_t station_index(const std::string& name, SensorKind kind, TrackingData& data) {
  const auto found = std::find_if(data.stations.begin(), data.stations.end(),
                                  [&](const Station& station) { return station.name == name; });
  if (found != data.stations.end()) {
    return static_cast<std::size_t>(found - data.stations.begin());
  }
  Station added;
  added.name = name;
  added.kind = kind;
  data.stations.push_back(std::move(added));
  return data.stations.size() - 1;
}

}  // namespace

void assemble(const Sightings& sightings, const std::string& file, const std::optional<Epoch>& reference,
              TrackingData& data) {
  const TimeScale scale = time_scale(data.time_system);
  Tag first = sightings.begin()->second.begin()->first;
  for (const auto& [station, tags] : sightings) {
    first = std::min(first, tags.begin()->first);
  }
  data.reference = reference.value_or(epoch_of(first));
  for (const auto& [station, tags] : sightings) {
    std::vector<std::pair<double, Parts>> timed;
    std::size_t fullest = kFullestFirst.size();
    for (const auto& [tag, sighting] : tags) {
      timed.emplace_back(seconds_between(data.reference, epoch_of(tag), scale),
                         parts_of(sighting, station, file));
      for (const auto& [kind, value] : timed.back().second) {
        fullest = std::min(fullest, rank_of(kind));
      }
    }
    for (const auto& [t_s, parts] : timed) {
      for (const auto& [kind, value] : parts) {
        const std::string ending = rank_of(kind) == fullest ? "" : ":" + std::string(describe(kind).name);
        data.measurements.push_back({t_s, station_index(station + ending, kind, data), value, std::nullopt});
      }
    }
  }
  std::stable_sort(data.measurements.begin(), data.measurements.end(),
                   [](const Measurement& a, const Measurement& b) { return a.t_s < b.t_s; });
}

TimeScale time_scale(std::string_view time_system) {
  return time_system == "UTC" ? TimeScale::kUtc : TimeScale::kUniform;
}

}  // namespace trammel::io
