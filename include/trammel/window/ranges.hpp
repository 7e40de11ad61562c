// SPDX-License-Identifier: Apache-2.0
/// @file
/// How a long flight is divided into windows.
#pragma once

#include <algorithm>
#include <concepts>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/settings.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

/// Settings of solve_windows.
struct WindowSettings {
  int core = 20;               ///< segments a window answers for
  int overlap = 16;            ///< segments it looks at on either side of them
  double relative_gap = 1e-4;  ///< of the certified interval, asked for
};

template <class Settings, class Visitor>
requires std::same_as<std::remove_const_t<Settings>, WindowSettings>
void visit_fields(Settings& settings, Visitor&& visit) {
  visit(FieldDoc{.name = "window_segments",
                 .unit = "",
                 .meaning = "segments each window answers for; more are slower and need fewer windows",
                 .minimum = 1.0,
                 .maximum = 1000.0},
        settings.core);
  visit(FieldDoc{.name = "window_overlap",
                 .unit = "",
                 .meaning = "segments each window looks at before and behind these; more make the certified "
                            "interval narrower, by a factor of about two per segment",
                 .minimum = 1.0,
                 .maximum = 1000.0},
        settings.overlap);
  visit(FieldDoc{.name = "relative_gap",
                 .unit = "",
                 .meaning =
                     "(upper - lower)/upper of the squared error up to which the result counts as optimal",
                 .minimum = 0.0,
                 .maximum = 1.0},
        settings.relative_gap);
}

/// Neighbours blend over this part of their overlap on either side of the border between them.
inline constexpr int kBlendShare = 3;

/// Segments of one window and those it contributes to, counted from the first of the flight. Neighbours
/// contribute to `blend` segments in common on either side of the border between them, with weights that sum
/// to one.
struct WindowRange {
  Eigen::Index first = 0, behind = 0;
  Eigen::Index core_first = 0, core_behind = 0;
  Eigen::Index blend = 0;
  Eigen::Index segments = 0;  ///< of the flight

  /// Share of the window in what a segment of its core gets.
  [[nodiscard]] double weight(Eigen::Index segment) const {
    if (blend == 0) {
      return 1.0;
    }
    const auto ramp = [this](Eigen::Index inside) {
      return std::clamp((static_cast<double>(inside) + 0.5) / (2.0 * static_cast<double>(blend)), 0.0, 1.0);
    };
    return (core_first > 0 ? ramp(segment - core_first) : 1.0) *
           (core_behind < segments ? ramp(core_behind - 1 - segment) : 1.0);
  }
};

/// Windows whose cores cover `segments` segments in order.
[[nodiscard]] inline std::vector<WindowRange> make_windows(Eigen::Index segments,
                                                           const WindowSettings& settings) {
  std::vector<WindowRange> result;
  const Eigen::Index count = std::max<Eigen::Index>(1, (segments + settings.core - 1) / settings.core);
  const Eigen::Index blend = std::min<Eigen::Index>(settings.overlap / kBlendShare, segments / count / 2);
  for (Eigen::Index w = 0; w < count; ++w) {
    const Eigen::Index first = w * segments / count;
    const Eigen::Index behind = (w + 1) * segments / count;
    result.push_back({.first = std::max<Eigen::Index>(0, first - settings.overlap),
                      .behind = std::min(segments, behind + settings.overlap),
                      .core_first = w == 0 ? 0 : first - blend,
                      .core_behind = w + 1 == count ? segments : behind + blend,
                      .blend = blend,
                      .segments = segments});
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::window
