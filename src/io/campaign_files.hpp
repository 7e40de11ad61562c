// SPDX-License-Identifier: Apache-2.0
/// @file
/// The folder of a campaign: manifest, estimators, one file per part, and the merged table.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "scenario_reader.hpp"
#include "trammel/campaign/motion_study.hpp"

namespace trammel::io {

/// What a campaign does with its scenarios.
enum class CampaignKind {
  kMonteCarlo,  ///< `runs` random motions of each scenario
  kArchive,     ///< one estimate of each scenario with its own measurements
};

/// One scenario of a campaign.
struct CampaignScenario {
  std::string file;               ///< relative to the campaign's folder
  std::vector<InputFile> inputs;  ///< the scenario and all it names, as they were when planned
  double guaranteed_rms_m = 0.0;  ///< Monte Carlo only
  std::string estimator_sha256;   ///< Monte Carlo only: of the file with the gain
};

/// Everything that determines the results of a campaign. Its work is a list of items: run k of scenario 1, 2,
/// ..., or scenario 1, 2, ... Parts are equal stretches of the list; each has a file that appears whole.
struct CampaignManifest {
  CampaignKind kind = CampaignKind::kArchive;
  std::vector<CampaignScenario> scenarios;
  std::size_t parts = 1;
  std::size_t runs = 1;                                                 ///< per scenario; archive: 1
  std::uint64_t seed = 0;                                               ///< Monte Carlo only
  campaign::RandomMotion motion = campaign::RandomMotion::kOnBoundary;  ///< Monte Carlo only

  [[nodiscard]] std::size_t items() const { return scenarios.size() * runs; }
  /// First item of a part and the first beyond it; parts count from 0.
  [[nodiscard]] std::pair<std::size_t, std::size_t> items_of(std::size_t part) const {
    return {part * items() / parts, (part + 1) * items() / parts};
  }
  /// Scenario and run of an item.
  [[nodiscard]] std::pair<std::size_t, std::size_t> place_of(std::size_t item) const {
    return {item / runs, item % runs};
  }
};

/// "uniform" or "boundary", as in manifests and options.
[[nodiscard]] std::string name_of(campaign::RandomMotion motion);
/// Throws Error for a name that is none.
[[nodiscard]] campaign::RandomMotion motion_of(const std::string& name);

/// A campaign's folder. Files in it: `manifest.json`; `estimator_K.json`, the gain of scenario K = 1, 2, ...
/// of a Monte Carlo study; `parts/K.csv`, K = 1, 2, ...; `merged.csv`; `report.json`.
class CampaignFolder {
 public:
  /// Makes the folder and writes the manifest, the estimators being there. Planning the same again changes
  /// nothing; Error if the folder holds another campaign.
  static CampaignFolder create(const std::filesystem::path& folder, const CampaignManifest& manifest);
  /// Error unless the folder holds a campaign planned by this version of the library.
  static CampaignFolder open(const std::filesystem::path& folder);

  [[nodiscard]] const CampaignManifest& manifest() const { return manifest_; }
  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }

  /// The scenario, read again. Error if it or a file it names has changed since the campaign was planned.
  [[nodiscard]] ScenarioInput scenario(std::size_t index) const;
  /// p x p gain of a scenario's estimator; Error unless the file is as planned.
  [[nodiscard]] Eigen::MatrixXd gain(std::size_t index) const;
  /// Writes a gain to the folder of a campaign to be created; returns the file's digest.
  static std::string write_gain(const std::filesystem::path& folder, std::size_t index,
                                const Eigen::MatrixXd& gain);

  /// Writes the rows of a part, one line per item without line break.
  void write_part(std::size_t part, const std::vector<std::string>& rows) const;
  /// Whether the file of a part is there, of this campaign and whole.
  [[nodiscard]] bool has_part(std::size_t part) const { return !part_rows(part).empty(); }
  /// Numbers of the parts that are missing, from 0.
  [[nodiscard]] std::vector<std::size_t> missing_parts() const;
  /// Joins all parts to a table in order of the items, and removes what killed processes left. Error naming
  /// the parts that are missing.
  [[nodiscard]] std::string merge() const;

  /// First line of the table.
  [[nodiscard]] std::string header() const;

 private:
  CampaignFolder(std::filesystem::path folder, CampaignManifest manifest, const std::string& text);

  [[nodiscard]] std::filesystem::path part_file(std::size_t part) const;
  /// The rows of a part, each with its line break; empty if it is missing or not whole.
  [[nodiscard]] std::string part_rows(std::size_t part) const;
  [[nodiscard]] std::string first_line(std::size_t part) const;

  std::filesystem::path folder_;
  CampaignManifest manifest_;
  std::string digest_;  ///< of the manifest's text
};

}  // namespace trammel::io
