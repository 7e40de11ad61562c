// SPDX-License-Identifier: Apache-2.0
/// @file
/// Input of `trammel region`: what is known of the plant and of the probes, and the method.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "trammel/region/loop_experiment.hpp"
#include "trammel/region/plant.hpp"
#include "trammel/region/residuals.hpp"

namespace trammel::io {

/// How the region is built; names as in the file.
enum class RegionMethod { kFullResidual, kPaper, kSps, kEllipsoid, kSelfNormalised };

[[nodiscard]] std::string_view to_string(RegionMethod method);

/// Contents of a region file.
struct RegionSpec {
  std::string title;
  region::PlantModel model;
  std::optional<Eigen::VectorXd> truth;  ///< unknown coefficients, in the order of the parameters

  // [probe]
  int period = 1;
  int first_time = -1;
  double gain = 1.0;
  int first_probe = 0;
  std::optional<int> probe_count;

  // [columns]
  std::string column_t = "t";
  std::string column_u = "u";
  std::string column_y = "y";
  std::string column_probe = "probe";

  // [method]
  RegionMethod method = RegionMethod::kFullResidual;
  int channels = 1;
  int members = 480;           ///< M
  int excluded = 0;            ///< q, from q or level
  double level = 0.95;         ///< as asked for; used by self_normalised
  std::optional<double> rho2;  ///< default: number of probes
  region::ResidualFilter filter;
  region::KnownTerms known_terms = region::KnownTerms::kOnce;
  std::uint64_t seed = 1;

  // [simulation]
  region::LoopFeedback feedback = region::LoopFeedback::kDeadBeat;
  region::LoopNoise noise = region::LoopNoise::kGaussianBias;
  region::ProbeLaw probe_law = region::ProbeLaw::kSigns;
  int simulated_probes = 480;
  double pole = 0.5;

  /// The loop to simulate; Error if the truth is missing.
  [[nodiscard]] region::LoopExperiment experiment() const;
};

/// Keys of a region file with their meaning, for --help.
[[nodiscard]] const char* region_spec_help();

/// Reads a region file (TOML or JSON). Error naming file, line and key.
[[nodiscard]] RegionSpec read_region_spec(const std::filesystem::path& file);

/// Reads the record of a probed loop: columns t (consecutive integers), u, y, probe. Outputs may be left out
/// before the first group, inputs where no output of the file depends on them; probe must be empty or 0
/// except at times first_time + period n. Error naming file and line.
[[nodiscard]] region::ProbedRecord read_probed_record(const std::filesystem::path& file,
                                                      const RegionSpec& spec);

/// The same columns as text.
[[nodiscard]] std::string format_probed_record(const region::ProbedRecord& record);

}  // namespace trammel::io
