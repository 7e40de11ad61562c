// SPDX-License-Identifier: Apache-2.0
// trammel suggest: segment length and acceleration bounds from measured data.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "../io/csv.hpp"
#include "../io/igc.hpp"
#include "../io/json_output.hpp"
#include "../io/measurement_csv.hpp"
#include "../io/scenario_reader.hpp"
#include "../report/report.hpp"
#include "commands.hpp"
#include "terminal_progress.hpp"
#include "trammel/core/error.hpp"
#include "trammel/localise/suggest.hpp"

namespace trammel::program {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct SuggestOptions {
  std::string file;
  std::vector<double> lengths_s;
  double sigma_m = 0.0;  ///< 0: from the track itself
  double quantile = localise::SuggestSettings{}.quantile;
  double margin = localise::SuggestSettings{}.margin;
  bool json = false;
};

/// Noise of one coordinate of a track (m): the median of what each sample is off the cubic through its four
/// neighbours, as of normal noise.
double track_noise_m(const PathSamples& track) {
  constexpr double kMedianOfNormal = 0.6744897501960817;
  std::vector<double> sizes;
  for (std::size_t i = 2; i + 2 < track.times_s.size(); ++i) {
    const std::array<std::size_t, 4> near{i - 2, i - 1, i + 1, i + 2};
    Eigen::Vector3d off = track.positions_m[i];
    double variance = 1.0;
    for (const std::size_t j : near) {
      double weight = 1.0;  // Lagrange
      for (const std::size_t k : near) {
        if (k != j) {
          weight *= (track.times_s[i] - track.times_s[k]) / (track.times_s[j] - track.times_s[k]);
        }
      }
      off -= weight * track.positions_m[j];
      variance += weight * weight;
    }
    for (const double x : off) {
      sizes.push_back(std::abs(x) / std::sqrt(variance));
    }
  }
  require(!sizes.empty(), "track", std::to_string(track.times_s.size()) + " samples",
          "at least 5, or --sigma-m");
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return *middle / kMedianOfNormal;
}

/// A track as position measurements about the line from its first to its last sample.
Scenario track_scenario(const PathSamples& track, double sigma_m) {
  constexpr double kLeast_m = 1e-3;  // a track without noise: rounding of its digits
  const double sigma = std::max(sigma_m > 0.0 ? sigma_m : track_noise_m(track), kLeast_m);
  Scenario scenario;
  scenario.knots_s = {track.times_s.front(), track.times_s.back()};
  scenario.nominal.position_m = track.positions_m.front();
  scenario.nominal.velocity_mps =
      (track.positions_m.back() - track.positions_m.front()) / (track.times_s.back() - track.times_s.front());
  double off_mps = 1.0;
  for (std::size_t i = 1; i < track.times_s.size(); ++i) {
    const Eigen::Vector3d velocity =
        (track.positions_m[i] - track.positions_m[i - 1]) / (track.times_s[i] - track.times_s[i - 1]);
    off_mps = std::max(off_mps, (velocity - scenario.nominal.velocity_mps).norm());
  }
  constexpr double kRoom = 2.0;
  constexpr double kSigmas = 10.0;
  scenario.bounds.position_m.setConstant(kSigmas * sigma);
  scenario.bounds.velocity_mps.setConstant(kRoom * off_mps);
  scenario.bounds.acceleration_mps2.assign(1, Eigen::Vector3d::Ones());  // not used
  Station receiver;
  receiver.name = "track";
  receiver.kind = SensorKind::kPosition;
  receiver.covariance = sigma * sigma * Eigen::Matrix3d::Identity();
  scenario.stations = {receiver};
  for (std::size_t i = 0; i < track.times_s.size(); ++i) {
    const Eigen::Vector3d& x = track.positions_m[i];
    scenario.observations.push_back({.t_s = track.times_s[i],
                                     .station = 0,
                                     .value = Eigen::VectorXd{{x.x(), x.y(), x.z()}},
                                     .covariance = {}});
  }
  return scenario;
}

/// Two digits, not below `value`.
double rounded_up(double value) {
  if (!(value > 0.0) || !std::isfinite(value)) {
    return value;
  }
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1);
  constexpr double kRounding = 1e-12;  // 7.2 stays 7.2
  return std::ceil(value / unit * (1 - kRounding)) * unit;
}

std::string number(double value) { return report::rounded(value, 3); }

std::string number_up(double value) { return number(rounded_up(value)); }

/// The keys of a scenario.
std::string keys(const Scenario& scenario, const localise::Suggestion& suggestion) {
  const localise::LengthTrial& best = suggestion.trials[suggestion.best];
  const Eigen::Vector3d& a = best.acceleration_mps2;
  const double begin = scenario.knots_s.front();
  std::string text = "[model]\nknots_s = [";
  for (std::size_t i = 0; i <= best.segments; ++i) {
    const double t =
        i == best.segments ? scenario.knots_s.back() : begin + best.segment_s * static_cast<double>(i);
    text += (i == 0 ? "" : ", ") + shortest(t);
  }
  return text + "]\n[bounds]\nacceleration_mps2 = [" + number_up(a.x()) + ", " + number_up(a.y()) + ", " +
         number_up(a.z()) + "]\njerk_mps3 = " + number_up(suggestion.jerk_mps3) + "\n";
}

std::string reasons(const localise::Suggestion& suggestion) {
  const localise::LengthTrial& best = suggestion.trials[suggestion.best];
  std::string text = "Segments of " + number(best.segment_s) + " s: ";
  text += best.fits()
              ? "the residuals fit (chi2 " + number(best.chi2) + " where " + number(best.degrees) +
                    " is expected) and the stated error is smallest, " + number(best.stated_rms_m) + " m."
              : "no length fits (chi2 " + number(best.chi2) + " where " + number(best.degrees) +
                    " is expected, the nearest): the noise is larger than stated, or outliers are "
                    "among the data.";
  text += " Accelerations: --margin times their --quantile; " + number(100 * best.noise_share) +
          " % of their mean square is what the data leave open.";
  text += " Jerk: between the segments of " + number(suggestion.trials[suggestion.likeliest].segment_s) +
          " s, the most likely length.";
  const auto dominated =
      std::find_if(suggestion.trials.begin(), suggestion.trials.end(),
                   [](const localise::LengthTrial& trial) { return trial.dominated_by_model_error(); });
  if (dominated == suggestion.trials.end()) {
    text += " The model error dominates at none of the lengths tried.";
  } else {
    text += " From " + number(dominated->segment_s) + " s on the model error dominates (" +
            number(dominated->model_rms_m) + " m beside a linear guarantee of " +
            number(dominated->linear_rms_m) + " m).";
  }
  return text;
}

std::string table(const localise::Suggestion& suggestion) {
  const auto row = [](const std::vector<std::string>& cells) {
    std::string line;
    for (const std::string& cell : cells) {
      constexpr std::size_t kWidth = 11;
      line += std::string(cell.size() < kWidth ? kWidth - cell.size() : 1, ' ') + cell;
    }
    return line + "\n";
  };
  std::string text = row({"length s", "segments", "chi2", "expected", "a_xy mps2", "a_z mps2", "jerk mps3",
                          "error m", "linear m", "curved m", "model m", "stated m"});
  for (std::size_t i = 0; i < suggestion.trials.size(); ++i) {
    const localise::LengthTrial& trial = suggestion.trials[i];
    std::string line =
        row({number(trial.segment_s), std::to_string(trial.segments), number(trial.chi2),
             number(trial.degrees), number(trial.acceleration_mps2.x()), number(trial.acceleration_mps2.z()),
             number(trial.jerk_mps3), number(trial.model_error.position_m), number(trial.linear_rms_m),
             number(trial.curvature_rms_m), number(trial.model_rms_m), number(trial.stated_rms_m)});
    line.pop_back();
    text += line + (i == suggestion.best ? "  <- suggested" : "") + (trial.fits() ? "" : "  (does not fit)") +
            "\n";
  }
  return text;
}

io::Json to_json(const Scenario& scenario, const localise::Suggestion& suggestion) {
  io::Json trials = io::Json::array();
  for (const localise::LengthTrial& trial : suggestion.trials) {
    trials.push_back({{"segment_s", io::to_json(trial.segment_s)},
                      {"segments", trial.segments},
                      {"chi2", io::to_json(trial.chi2)},
                      {"expected_chi2", io::to_json(trial.degrees)},
                      {"fits", trial.fits()},
                      {"minus_twice_log_likelihood", io::to_json(trial.likelihood)},
                      {"acceleration_mps2", io::to_json(trial.acceleration_mps2)},
                      {"open_share", io::to_json(trial.noise_share)},
                      {"jerk_mps3", io::to_json(trial.jerk_mps3)},
                      {"model_error_m", io::to_json(trial.model_error.position_m)},
                      {"linear_guarantee_rms_m", io::to_json(trial.linear_rms_m)},
                      {"curvature_rms_m", io::to_json(trial.curvature_rms_m)},
                      {"model_error_rms_m", io::to_json(trial.model_rms_m)},
                      {"stated_rms_m", io::to_json(trial.stated_rms_m)},
                      {"model_error_dominates", trial.dominated_by_model_error()}});
  }
  const localise::LengthTrial& best = suggestion.trials[suggestion.best];
  return {{"suggested", suggestion.best},
          {"likeliest", suggestion.likeliest},
          {"segment_s", io::to_json(best.segment_s)},
          {"acceleration_mps2", io::to_json(best.acceleration_mps2)},
          {"jerk_mps3", io::to_json(suggestion.jerk_mps3)},
          {"fits", best.fits()},
          {"reasons", reasons(suggestion)},
          {"keys", keys(scenario, suggestion)},
          {"trials", std::move(trials)}};
}

int run(const SuggestOptions& options) {
  localise::SuggestSettings settings{
      .lengths_s = options.lengths_s, .quantile = options.quantile, .margin = options.margin};
  const std::string ending = std::filesystem::path(options.file).extension().string();
  Scenario scenario;
  if (ending == ".csv") {
    scenario = track_scenario(io::read_path(options.file, kInfinity, -kInfinity), options.sigma_m);
  } else if (ending == ".igc") {
    const io::IgcLog log = io::read_igc(options.file);
    const io::IgcPath path = io::local_path(log, LocalFrame(io::default_origin(log)), {});
    scenario = track_scenario({path.times_s, path.positions_m}, options.sigma_m);
  } else {
    io::ScenarioInput input = io::read_scenario(options.file);
    require(!input.scenario.observations.empty(), options.file + ": observations", "none",
            "[observations] with measured values to learn from, or a track (.csv, .igc)");
    settings.minimum_height_m = input.settings.minimum_height_m;
    scenario = std::move(input.scenario);
  }
  localise::Suggestion suggestion;
  {
    TerminalProgress progress;
    suggestion = localise::suggest_segments(scenario, settings, progress.observer());
  }
  if (options.json) {
    std::cout << io::dump(to_json(scenario, suggestion));
  } else {
    std::cout << table(suggestion) << "\n"
              << reasons(suggestion) << "\n\n"
              << keys(scenario, suggestion)
              << "# Learnt from these data: whether they bound other flights is for you to decide.\n";
  }
  std::cout.flush();
  return kSolved;
}

}  // namespace

void add_suggest(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "suggest", "segment length, acceleration and jerk bounds that suit measured data, and why");
  const auto options = std::make_shared<SuggestOptions>();
  command
      ->add_option(
          "file", options->file,
          "scenario with observations (.toml, .json), or a measured track (t_s,x_m,y_m,z_m .csv, .igc)")
      ->required();
  command->add_option("--lengths", options->lengths_s, "segment lengths to try, s (default: a series)")
      ->delimiter(',');
  command->add_option("--sigma-m", options->sigma_m,
                      "noise of a track's coordinates, m (default: from its samples)");
  command->add_option("--quantile", options->quantile, "share of accelerations and jerks to cover")
      ->capture_default_str();
  command->add_option("--margin", options->margin, "bounds over that quantile")->capture_default_str();
  command->add_flag("--json", options->json, "print the numbers as JSON");
  command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace trammel::program
