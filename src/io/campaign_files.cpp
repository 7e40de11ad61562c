// SPDX-License-Identifier: Apache-2.0
#include "campaign_files.hpp"

#include <algorithm>
#include <array>

#include "document.hpp"
#include "file.hpp"
#include "json_output.hpp"
#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"

namespace trammel::io {

namespace {

constexpr const char* kManifestFile = "manifest.json";
constexpr const char* kPartsFolder = "parts";
constexpr std::string_view kEnd = "# sha256 ";

std::string manifest_text(const CampaignManifest& manifest) {
  Json json;
  json["kind"] = manifest.kind == CampaignKind::kMonteCarlo ? "monte-carlo" : "archive";
  json["parts"] = manifest.parts;
  if (manifest.kind == CampaignKind::kMonteCarlo) {
    json["runs"] = manifest.runs;
    json["seed"] = std::to_string(manifest.seed);  // text: 64 bits do not pass through every JSON reader
    json["motion"] = name_of(manifest.motion);
  }
  json["library_version"] = kVersion;
  json["scenarios"] = Json::array();
  for (const CampaignScenario& scenario : manifest.scenarios) {
    Json entry;
    entry["file"] = scenario.file;
    if (manifest.kind == CampaignKind::kMonteCarlo) {
      entry["guaranteed_rms_m"] = scenario.guaranteed_rms_m;
      entry["estimator_sha256"] = scenario.estimator_sha256;
    }
    entry["inputs"] = Json::array();
    for (const InputFile& input : scenario.inputs) {
      entry["inputs"].push_back({{"name", input.name}, {"sha256", input.sha256}});
    }
    json["scenarios"].push_back(std::move(entry));
  }
  return dump(json);
}

std::size_t count_of(const Node& node) {
  const std::int64_t count = node.integer();
  if (count < 1) {
    node.fail(std::to_string(count), "at least 1");
  }
  return static_cast<std::size_t>(count);
}

CampaignManifest parse_manifest(const std::filesystem::path& file, const std::string& text) {
  const Document document = Document::parse_json(text, file.string());
  const Node& root = document.root();
  const Node& version = root.at("library_version");
  if (version.text() != kVersion) {
    version.fail(version.describe(), std::string(kVersion) + ", as this program: plan the campaign anew");
  }
  CampaignManifest manifest;
  manifest.kind = root.at("kind").choice({"monte-carlo", "archive"}) == "archive" ? CampaignKind::kArchive
                                                                                  : CampaignKind::kMonteCarlo;
  const bool monte_carlo = manifest.kind == CampaignKind::kMonteCarlo;
  manifest.parts = count_of(root.at("parts"));
  if (monte_carlo) {
    manifest.runs = count_of(root.at("runs"));
    manifest.seed = std::stoull(root.at("seed").text());
    manifest.motion = motion_of(root.at("motion").text());
  }
  for (const Node& node : root.at("scenarios").items()) {
    CampaignScenario scenario;
    scenario.file = node.at("file").text();
    if (monte_carlo) {
      scenario.guaranteed_rms_m = node.at("guaranteed_rms_m").number();
      scenario.estimator_sha256 = node.at("estimator_sha256").text();
    }
    for (const Node& input : node.at("inputs").items()) {
      scenario.inputs.push_back({input.at("name").text(), input.at("sha256").text()});
    }
    manifest.scenarios.push_back(std::move(scenario));
  }
  document.reject_unknown();
  return manifest;
}

std::filesystem::path gain_file(const std::filesystem::path& folder, std::size_t index) {
  return folder / ("estimator_" + std::to_string(index + 1) + ".json");
}

constexpr std::array<std::pair<campaign::RandomMotion, const char*>, 2> kMotionNames{
    {{campaign::RandomMotion::kWithin, "uniform"}, {campaign::RandomMotion::kOnBoundary, "boundary"}}};

}  // namespace

std::string name_of(campaign::RandomMotion motion) {
  return kMotionNames[motion == kMotionNames[0].first ? 0 : 1].second;
}

campaign::RandomMotion motion_of(const std::string& name) {
  for (const auto& [motion, known] : kMotionNames) {
    if (name == known) {
      return motion;
    }
  }
  throw Error({"motion", name, "uniform or boundary"});
}

CampaignFolder::CampaignFolder(std::filesystem::path folder, CampaignManifest manifest,
                               const std::string& text)
    : folder_(std::move(folder)), manifest_(std::move(manifest)), digest_(sha256(text)) {}

CampaignFolder CampaignFolder::create(const std::filesystem::path& folder, const CampaignManifest& manifest) {
  const std::filesystem::path file = folder / kManifestFile;
  const std::string text = manifest_text(manifest);
  create_folder(folder / kPartsFolder);
  if (std::filesystem::exists(file)) {
    require(read_text(file) == text, file.string(), "another campaign",
            "an empty folder, or the same plan again");
  } else {
    write_atomically(file, text);
  }
  return {folder, manifest, text};
}

CampaignFolder CampaignFolder::open(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / kManifestFile;
  const std::string text = read_text(file);
  return {folder, parse_manifest(file, text), text};
}

ScenarioInput CampaignFolder::scenario(std::size_t index) const {
  const CampaignScenario& planned = manifest_.scenarios[index];
  ScenarioInput input = read_scenario(folder_ / planned.file, manifest_.kind == CampaignKind::kMonteCarlo
                                                                  ? Observations::kIfUnplanned
                                                                  : Observations::kRead);
  const auto same = [](const InputFile& a, const InputFile& b) {
    return a.name == b.name && a.sha256 == b.sha256;
  };
  require(std::equal(planned.inputs.begin(), planned.inputs.end(), input.inputs.begin(), input.inputs.end(),
                     same),
          (folder_ / planned.file).string(), "a scenario changed since the campaign was planned",
          "the scenario and all files it names as they were");
  return input;
}

std::string CampaignFolder::write_gain(const std::filesystem::path& folder, std::size_t index,
                                       const Eigen::MatrixXd& gain) {
  const std::string text = Json{{"gain", matrix_to_json(gain)}}.dump() + "\n";
  write_atomically(gain_file(folder, index), text);
  return sha256(text);
}

Eigen::MatrixXd CampaignFolder::gain(std::size_t index) const {
  const std::filesystem::path file = gain_file(folder_, index);
  const std::string text = read_text(file);
  require(sha256(text) == manifest_.scenarios[index].estimator_sha256, file.string(),
          "a file changed since the campaign was planned", "the estimator as planned");
  return Document::parse_json(text, file.string()).root().at("gain").matrix();
}

std::filesystem::path CampaignFolder::part_file(std::size_t part) const {
  return folder_ / kPartsFolder / (std::to_string(part + 1) + ".csv");
}

std::string CampaignFolder::first_line(std::size_t part) const {
  return "# part " + std::to_string(part + 1) + " of " + std::to_string(manifest_.parts) + ", campaign " +
         digest_ + "\n";
}

void CampaignFolder::write_part(std::size_t part, const std::vector<std::string>& rows) const {
  std::string text = first_line(part);
  for (const std::string& row : rows) {
    text += row + "\n";
  }
  text += std::string(kEnd) + sha256(text) + "\n";
  write_atomically(part_file(part), text, Durability::kKill);
}

std::string CampaignFolder::part_rows(std::size_t part) const {
  const std::filesystem::path file = part_file(part);
  if (!std::filesystem::exists(file)) {
    return {};
  }
  std::string text = read_text(file);
  const std::string begin = first_line(part);
  const std::size_t end = text.rfind(kEnd);
  if (!text.starts_with(begin) || end == std::string::npos || end < begin.size() ||
      text.substr(end) != std::string(kEnd) + sha256(std::string_view(text).substr(0, end)) + "\n") {
    return {};
  }
  return text.substr(begin.size(), end - begin.size());
}

std::vector<std::size_t> CampaignFolder::missing_parts() const {
  std::vector<std::size_t> missing;
  for (std::size_t part = 0; part < manifest_.parts; ++part) {
    if (!has_part(part)) {
      missing.push_back(part);
    }
  }
  return missing;
}

std::string CampaignFolder::merge() const {
  std::string text = header() + "\n";
  std::string missing;
  for (std::size_t part = 0; part < manifest_.parts; ++part) {
    const std::string rows = part_rows(part);
    if (rows.empty()) {
      missing += (missing.empty() ? "" : ", ") + std::to_string(part + 1);
    }
    text += rows;
  }
  require(missing.empty(), [&] {
    return ErrorDetail{folder_.string(), "no complete result of parts " + missing,
                       "all " + std::to_string(manifest_.parts) + " parts: run the campaign again"};
  });
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / kPartsFolder)) {
    if (entry.path().filename().string().find(".unfinished.") != std::string::npos) {
      std::error_code ignored;  // another merge may have been faster
      std::filesystem::remove(entry.path(), ignored);
    }
  }
  return text;
}

std::string CampaignFolder::header() const {
  return manifest_.kind == CampaignKind::kMonteCarlo
             ? "scenario,run,actual_rms_error_m,guaranteed_rms_m,ratio,nonlinear_rms_error_m"
             : "scenario,status,claim,parameters,observations,guaranteed_rms_m,lower_bound_rms_m,"
               "relative_gap,gauss_markov_rms_m,chi2,message";
}

}  // namespace trammel::io
