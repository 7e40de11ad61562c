// SPDX-License-Identifier: Apache-2.0
/// @file
/// A scenario with everything it names, from TOML or JSON and the CSV files beside it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "trammel/localise/flight_estimate.hpp"
#include "trammel/problem/scenario.hpp"
#include "trammel/window/ranges.hpp"

namespace trammel::io {

class Document;

/// An input file as results name it.
struct InputFile {
  std::string name;    ///< as written by the user; for the scenario its file name
  std::string sha256;  ///< lower-case hexadecimal
};

/// A scenario and what its file says about how to solve it.
struct ScenarioInput {
  Scenario scenario;
  localise::FlightSettings settings;
  bool reject_outliers = false;                   ///< observations.reject_outliers
  std::optional<window::WindowSettings> windows;  ///< with solver.method = "windows"
  std::vector<InputFile> inputs;
};

/// What to do with the observations a scenario names.
enum class Observations {
  kRead,
  kIfUnplanned,  ///< read them only where no station has times_s (a design needs times, not values)
  kIgnore,       ///< every station needs times_s (to draw measurements that do not exist yet)
};

/// Reads a scenario and the nominal and observation files it names.
///
/// ```
/// title = "text"                                         # optional
/// [model]        knots_s = [..] | {start, stop, step}    # strictly increasing, at least two
/// [nominal]      position_m = [3], velocity_mps = [3] | file = "path.csv"
/// [bounds]       position_m, velocity_mps, acceleration_mps2 = radius | [3 semi-axes]
///                acceleration_mps2 also one of these per segment; three numbers are semi-axes
///                minimum_height_m = the path stays above; jerk_mps3 = bound on the true motion's jerk, or
///                model_error_m, model_error_mps = how far it may be from a motion within the bounds, with
///                model_error_kind = "ellipsoid" (root mean square) | "box" (at every time)
/// [criterion]    kind = "integral" | "times" | "window" | "final", times_s = [..], window_s = [begin, end]
/// [[station]]    name, kind, covariance = [[..]], times_s = [..] | {start, stop, step},
///                position_m = [3] | file = "path.csv" | track = [[t_s, x_m, y_m, z_m], ..]
///                bias = {range_m = .., time_s = ..}      # semi-axes by component and of the clock
/// [observations] file = "measurements.csv", reject_outliers = false | true      # optional
/// [solver]       method = "structured" | "sdp" | "conditional-gradient" | "windows", relative_gap,
///                max_iterations, threads = 1, relinearise = true | false, cross_fit = false | true;
///                with "windows" also window_segments, window_overlap
/// ```
/// Files are relative to the scenario's folder. A station needs times_s unless there are observations, and
/// a place unless its kind is "position" (where it is the origin of the coordinates it reports). A track
/// must cover the station's measurements (checked when the problem is assembled).
/// Throws Error naming file, line or key, what was found and what was expected.
[[nodiscard]] ScenarioInput read_scenario(const std::filesystem::path& file,
                                          Observations observations = Observations::kRead);

/// The same from a parsed document; `inputs` is left to name the files the document refers to.
[[nodiscard]] ScenarioInput read_scenario(const Document& document,
                                          Observations observations = Observations::kRead);

}  // namespace trammel::io
