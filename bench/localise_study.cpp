// SPDX-License-Identifier: Apache-2.0
// How honest the stated values are: draws of the published manoeuvre, windows of flights beside other
// estimators, and what a search costs.
//
//   localise_study manoeuvre [draws]
//   localise_study flights DIRECTORY [windows per flight] [set-up]: bounds from the flight's statistics
//   localise_study suggested DIRECTORY [windows per flight] [set-up]: bounds from the measurements
//   localise_study cost
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <malloc.h>

#include "localise_peers.hpp"
#include "localise_truth.hpp"
#include "trammel/certify/certificate.hpp"
#include "trammel/core/random.hpp"
#include "trammel/estimate/simulate_measurements.hpp"
#include "trammel/localise/locate.hpp"
#include "trammel/localise/suggest.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/problem/zoo.hpp"

namespace {

using namespace trammel;
using study::quantile;

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Root mean square distance of positions from a path.
template <class Path>
double rms_error(const std::vector<Eigen::Vector3d>& positions, const Path& truth,
                 const std::vector<double>& times_s) {
  double sum = 0.0;
  for (std::size_t k = 0; k < times_s.size(); ++k) {
    sum += (positions[k] - truth.position(times_s[k])).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(times_s.size()));
}

std::vector<double> equally_spaced(double begin, double end, double step) {
  std::vector<double> times;
  const auto count = static_cast<int>(std::lround((end - begin) / step));
  for (int i = 0; i <= count; ++i) {
    times.push_back(begin + i * (end - begin) / count);
  }
  return times;
}

/// Actual errors beside stated ones.
class Tally {
 public:
  void add(double actual, double stated) {
    actual_.push_back(actual);
    stated_.push_back(stated);
    looseness_.push_back(stated / actual);
    squares_ += actual * actual;
    ratios_ += actual * actual / (stated * stated);
    covered_ += actual <= stated ? 1 : 0;
    worst_ = std::max(worst_, actual / stated);
  }
  [[nodiscard]] std::size_t count() const { return actual_.size(); }
  [[nodiscard]] double rms() const { return std::sqrt(squares_ / size()); }
  [[nodiscard]] double actual() const { return quantile(actual_, 0.5); }
  [[nodiscard]] double stated() const { return quantile(stated_, 0.5); }
  [[nodiscard]] double looseness() const { return quantile(looseness_, 0.5); }
  /// Root of the mean of (actual/stated)^2: at most 1 for an honest root mean square.
  [[nodiscard]] double Q() const { return std::sqrt(ratios_ / size()); }
  [[nodiscard]] double cover() const { return covered_ / size(); }
  [[nodiscard]] double worst() const { return worst_; }

 private:
  [[nodiscard]] double size() const { return static_cast<double>(actual_.size()); }

  std::vector<double> actual_, stated_, looseness_;
  double squares_ = 0.0;
  double ratios_ = 0.0;
  double covered_ = 0.0;
  double worst_ = 0.0;
};

/// The manoeuvre as the publication's figure has it: level, then down 3 km along a half cosine, level again.
struct Descent {
  [[nodiscard]] static Eigen::Vector3d position(double t) {
    const double share = t < 30.0   ? 0.0
                         : t > 50.0 ? 1.0
                                    : (1 - std::cos(std::numbers::pi * (t - 30) / 20)) / 2;
    return {1000 + 212 * t, 1000 + 212 * t, 5000 - 3000 * share};
  }
  [[nodiscard]] static Eigen::Vector3d velocity(double t) {
    const double rate =
        t < 30.0 || t > 50.0 ? 0.0 : std::numbers::pi / 40 * std::sin(std::numbers::pi * (t - 30) / 20);
    return {212, 212, -3000 * rate};
  }
  [[nodiscard]] static bool covers(double /*t*/) { return true; }
};

void study_manoeuvre(int draws) {
  std::printf(
      "| noise, floor | draws | actual rms, median m | g_lin, stated, medians m | Q of g_lin, Q | cover, "
      "worst | "
      "stated/actual: median, median stated over rms actual | ambiguous | over 800 m, unflagged | systems |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n");
  struct Row {
    const char* name;
    double covariance;
    std::optional<double> floor_m;
    int draws;
  };
  constexpr double kGross_m = 800.0;
  const std::vector<double> times = equally_spaced(0, 70, 0.1);
  for (const Row& row : {Row{"W, 0 m", 1.0, 0.0, draws}, Row{"5 W, 0 m", 5.0, 0.0, draws},
                         Row{"W, none", 1.0, std::nullopt, draws / 5}}) {
    Tally all;
    Tally linear;
    int ambiguous = 0;
    int gross = 0;
    int unflagged = 0;
    long systems = 0;
    for (int draw = 0; draw < row.draws; ++draw) {
      Scenario scenario = zoo::manoeuvre_scenario(7, row.covariance);
      scenario.observations =
          estimate::simulate_measurements(scenario, Descent{}, static_cast<std::uint64_t>(draw));
      localise::LocateSettings settings;
      settings.minimum_height_m = row.floor_m;
      const localise::Location found = localise::locate(scenario, settings);
      const localise::StatedValue& stated = *found.branches.front().stated;
      const double actual = rms_error(study::positions(stated.problem, stated.z, times), Descent{}, times);
      const bool flagged = found.status == localise::LocateStatus::kAmbiguous;
      all.add(actual, stated.stated_rms_m);
      linear.add(actual, stated.linear_guarantee_rms_m);
      ambiguous += flagged ? 1 : 0;
      gross += actual > kGross_m ? 1 : 0;
      unflagged += actual > kGross_m && !flagged ? 1 : 0;
      systems += found.systems;
    }
    std::printf(
        "| %s | %d | %.0f, %.0f | %.0f, %.0f | %.2f, %.2f | %.3f, %.2f | %.2f, %.2f | %.1f %% | "
        "%d, %d | %.0f |\n",
        row.name, row.draws, all.rms(), all.actual(), linear.stated(), all.stated(), linear.Q(), all.Q(),
        all.cover(), all.worst(), all.looseness(), all.stated() / all.rms(), 100.0 * ambiguous / row.draws,
        gross, unflagged, static_cast<double>(systems) / row.draws);
    std::fflush(stdout);
  }
}

/// What one station of a set-up measures.
struct Instrument {
  SensorKind kind;
  double range_sigma_m;
  double angle_sigma_rad;
};

struct SetUp {
  const char* name;
  std::vector<Instrument> stations;
  bool angles;
};

/// Without angles the stations' plane is a floor: the path mirrored in it has the same ranges.
std::optional<double> floor_of(const SetUp& set_up) {
  return set_up.angles ? std::nullopt : std::optional<double>(0.0);
}

std::vector<SetUp> set_ups() {
  const Instrument coarse{SensorKind::kAzimuthElevationRange, 15, 1.5e-3};
  const Instrument fine{SensorKind::kAzimuthElevationRange, 3, 2e-4};
  const Instrument coarse_range{SensorKind::kRange, 15, 0};
  const Instrument fine_range{SensorKind::kRange, 3, 0};
  return {{"1 radar, 15 m, 1.5 mrad", {coarse}, true},
          {"1 radar, 3 m, 0.2 mrad", {fine}, true},
          {"2 radars, 15 m, 1.5 mrad", {coarse, coarse}, true},
          {"2 radars, 3 m, 0.2 mrad", {fine, fine}, true},
          {"3 radars, 15 m, 1.5 mrad", {coarse, coarse, coarse}, true},
          {"3 radars, 3 m, 0.2 mrad", {fine, fine, fine}, true},
          {"1 radar and 1 range, 15 m, 1.5 mrad", {coarse, coarse_range}, true},
          {"1 radar and 2 ranges, 3 m, 0.2 mrad", {fine, fine_range, fine_range}, true},
          {"1 range, 15 m", {coarse_range}, false},
          {"2 ranges, 15 m", {coarse_range, coarse_range}, false},
          {"3 ranges, 15 m", {coarse_range, coarse_range, coarse_range}, false},
          {"3 ranges, 3 m", {fine_range, fine_range, fine_range}, false}};
}

/// A window of a flight seen by a set-up; the times count from its beginning.
struct Window {
  const study::Flight* flight = nullptr;
  double begin_s = 0.0;
  double duration_s = 0.0;

  [[nodiscard]] Eigen::Vector3d position(double t) const { return flight->path.position(begin_s + t); }
  [[nodiscard]] Eigen::Vector3d velocity(double t) const { return flight->path.velocity(begin_s + t); }
  [[nodiscard]] bool covers(double t) const { return t >= 0.0 && t <= duration_s; }
};

Scenario make_scenario(const Window& window, const SetUp& set_up, double segment_s, RandomStream& stream) {
  constexpr double kNearest_m = 10000.0;
  constexpr double kFarthest_m = 40000.0;
  constexpr double kPositionSigma_m = 100.0;
  constexpr double kVelocitySigma_mps = 7.0;
  const auto normal3 = [&stream] {
    return Eigen::Vector3d(stream.normal(), stream.normal(), stream.normal());
  };
  Scenario scenario;
  scenario.knots_s = equally_spaced(0.0, window.duration_s, segment_s);
  scenario.nominal.position_m = window.position(0.0) + kPositionSigma_m * normal3();
  scenario.nominal.velocity_mps = window.velocity(0.0) + kVelocitySigma_mps * normal3();
  scenario.bounds = {.position_m = Eigen::Vector3d::Constant(3 * kPositionSigma_m),
                     .velocity_mps = Eigen::Vector3d::Constant(20.0),
                     .acceleration_mps2 =
                         std::vector<Eigen::Vector3d>(scenario.segments(), window.flight->acceleration_mps2)};
  const Eigen::Vector3d middle = window.position(window.duration_s / 2);
  for (std::size_t i = 0; i < set_up.stations.size(); ++i) {
    const Instrument& instrument = set_up.stations[i];
    const double bearing = 2 * std::numbers::pi * stream.uniform();
    const double distance = kNearest_m + (kFarthest_m - kNearest_m) * stream.uniform();
    Station station{.name = std::to_string(i), .kind = instrument.kind, .covariance = {}, .times_s = {}};
    station.position_m = {middle.x() + distance * std::sin(bearing),
                          middle.y() + distance * std::cos(bearing), 0.0};
    Eigen::VectorXd variances = Eigen::VectorXd::Constant(
        components(instrument.kind), instrument.angle_sigma_rad * instrument.angle_sigma_rad);
    variances(variances.size() - 1) = instrument.range_sigma_m * instrument.range_sigma_m;
    station.covariance = variances.asDiagonal();
    constexpr double kOffset_s = 0.37;  // stations do not measure at the same times
    for (double t = kOffset_s * static_cast<double>(i); t <= window.duration_s; t += 1.0) {
      station.times_s.push_back(t);
    }
    scenario.stations.push_back(std::move(station));
  }
  return scenario;
}

/// The lengths tried for segments.
constexpr std::array kSegments_s{10.0, 5.0, 4.0, 3.0, 2.0, 1.0};

/// Shorter segments than that many in a window gain little and cost much.
constexpr double kMostSegments = 150.0;

/// The length whose linear guarantee plus model error, before any measurement, is least: what a user can
/// know.
double choose_segment(const Window& window, const SetUp& set_up, const RandomStream& stream) {
  constexpr double kSmall = 0.05;  // of the guarantee: shorter segments cannot gain more
  double best = std::numeric_limits<double>::infinity();
  double chosen = kSegments_s.front();
  for (const double T : kSegments_s) {
    if (window.duration_s / T > kMostSegments) {
      break;
    }
    RandomStream same = stream;
    Scenario scenario = make_scenario(window, set_up, T, same);
    scenario.observations = estimate::simulate_measurements(scenario, window, 0);
    const localise::FitProblem problem(scenario);
    const localise::StatedValue stated =
        localise::state(problem, Eigen::VectorXd::Zero(problem.parameters()),
                        localise::model_error_from_jerk(window.flight->jerk_mps3, T), {.relative_gap = 1e-4});
    const double value = stated.linear_guarantee_rms_m + stated.model_error_rms_m;
    if (value < best) {
      best = value;
      chosen = T;
    }
    if (stated.model_error_rms_m < kSmall * stated.linear_guarantee_rms_m) {
      break;
    }
  }
  return chosen;
}

/// Where a user takes bounds and segment length from.
enum class Knowledge {
  kFlight,  ///< quantiles of the flight's accelerations and jerk, and the guarantee before any measurement
  kData,    ///< suggest_segments on the measurements themselves
};

void study_flights(const std::string& directory, int windows, std::size_t only, Knowledge knowledge) {
  const std::vector<study::Flight> flights = study::all_flights(directory);
  std::printf("| flight | 1.5 x 99 %% acceleration, m/s^2 | 99 %% jerk, m/s^3 |\n|---|---|---|\n");
  for (const study::Flight& flight : flights) {
    std::printf("| %s | %.1f, %.1f, %.1f | %.1f |\n", flight.name.c_str(), flight.acceleration_mps2.x(),
                flight.acceleration_mps2.y(), flight.acceleration_mps2.z(), flight.jerk_mps3);
  }
  std::printf(
      "\n| set-up | windows | segments s | acceleration bound, jerk over the flight's | actual, stated "
      "medians m | g_lin, curvature, model medians m | Q "
      "of g_lin, Q | cover, worst | stated/actual | ambiguous, no bound | Gauss-Markov | least squares | "
      "smoother, velocity | smoother, acceleration "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  constexpr std::array kDurations_s{60.0, 120.0, 180.0, 240.0, 300.0};
  for (std::size_t s = 0; s < set_ups().size(); ++s) {
    if (only > 0 && s + 1 != only) {
      continue;
    }
    const SetUp set_up = set_ups()[s];
    Tally all, linear, gauss_markov, least_squares, velocity, acceleration;
    std::vector<double> g_lin, beta, model, segments, accelerations, jerks;
    int ambiguous = 0;
    int unbounded = 0;
    int infeasible = 0;
    for (std::size_t f = 0; f < flights.size(); ++f) {
      std::map<double, double> segment_for;  // duration
      for (int w = 0; w < windows; ++w) {
        const auto place = static_cast<std::uint64_t>(1000 * f + static_cast<std::size_t>(w));
        RandomStream stream(s + 1, place);
        Window window{.flight = &flights[f]};
        window.duration_s = kDurations_s[(static_cast<std::size_t>(w) + f) % kDurations_s.size()];
        const double free = flights[f].path.end_s() - flights[f].path.begin_s() - window.duration_s;
        window.begin_s = flights[f].path.begin_s() + free * stream.uniform();
        double T = 10.0;
        double jerk_mps3 = flights[f].jerk_mps3;
        if (knowledge == Knowledge::kFlight) {
          if (!segment_for.contains(window.duration_s)) {
            segment_for[window.duration_s] = choose_segment(window, set_up, stream);
          }
          T = segment_for[window.duration_s];
        }
        Scenario scenario = make_scenario(window, set_up, T, stream);
        scenario.observations = estimate::simulate_measurements(scenario, window, 1000000 * (s + 1) + place);
        if (knowledge == Knowledge::kData) {
          localise::SuggestSettings ask;
          ask.minimum_height_m = floor_of(set_up);
          const localise::Suggestion suggestion = localise::suggest_segments(scenario, ask);
          const localise::LengthTrial& best = suggestion.trials[suggestion.best];
          T = best.segment_s;
          jerk_mps3 = suggestion.jerk_mps3;
          scenario.knots_s = equally_spaced(0.0, window.duration_s, T);
          scenario.bounds.acceleration_mps2.assign(scenario.segments(), best.acceleration_mps2);
        }
        accelerations.push_back(scenario.bounds.acceleration_mps2.front().norm() /
                                flights[f].acceleration_mps2.norm());
        jerks.push_back(jerk_mps3 / flights[f].jerk_mps3);
        localise::LocateSettings settings;
        settings.model_error = localise::model_error_from_jerk(jerk_mps3, T);
        settings.minimum_height_m = floor_of(set_up);
        const localise::Location found = localise::locate(scenario, settings);
        if (found.branches.empty()) {
          ++infeasible;
          continue;
        }
        const localise::StatedValue& stated = *found.branches.front().stated;
        const std::vector<double> times = equally_spaced(0.0, window.duration_s, 0.5);
        const double actual = rms_error(study::positions(stated.problem, stated.z, times), window, times);
        const bool flagged = found.status == localise::LocateStatus::kAmbiguous;
        ambiguous += flagged ? 1 : 0;
        if (!(stated.stated_rms_m > 0.0)) {
          ++unbounded;
          continue;
        }
        all.add(actual, stated.stated_rms_m);
        linear.add(actual, stated.linear_guarantee_rms_m);
        g_lin.push_back(stated.linear_guarantee_rms_m);
        beta.push_back(stated.curvature_rms_m);
        model.push_back(stated.model_error_rms_m);
        segments.push_back(T);
        if (std::getenv("LOCALISE_STUDY_VERBOSE") != nullptr) {
          std::fprintf(stderr,
                       "%s %s %.0f s from %.0f, T %.1f: actual %.2f g_lin %.2f beta %.2f model %.2f%s\n",
                       set_up.name, flights[f].name.c_str(), window.duration_s, window.begin_s, T, actual,
                       g_lin.back(), beta.back(), model.back(), flagged ? " ambiguous" : "");
        }
        const auto peer = [&](Tally& tally, const study::PeerEstimate& estimate) {
          tally.add(rms_error(estimate.positions_m, window, times), estimate.sigma_m);
        };
        // Without bounds short segments leave the motion undetermined: they have the length that suits them.
        constexpr double kUnboundedSegment_s = 5.0;
        Scenario longer = scenario;
        longer.knots_s = equally_spaced(0.0, window.duration_s, kUnboundedSegment_s);
        const study::PeerEstimates peers = study::unbounded_estimates(longer, stated, times);
        peer(gauss_markov, peers.gauss_markov);
        if (peers.least_squares) {
          peer(least_squares, *peers.least_squares);
        }
        peer(velocity, study::KalmanSmoother<2>(scenario, times).run());
        peer(acceleration, study::KalmanSmoother<3>(scenario, times).run());
      }
    }
    const auto show = [](const Tally& tally) {
      std::array<char, 64> text{};
      std::snprintf(text.data(), text.size(), "%.3g, %.3g, %.2f", tally.actual(), tally.stated(), tally.Q());
      return std::string(text.data());
    };
    std::printf(
        "| %s | %zu | %.0f (%.0f to %.0f) | %.2f, %.2f | %.3g, %.3g | %.3g, %.3g, %.3g | %.2f, %.2f | %.2f, "
        "%.2f | "
        "%.2f | %d, %d | %s | %s | %s | %s |\n",
        set_up.name, all.count(), quantile(segments, 0.5), quantile(segments, 0.0), quantile(segments, 1.0),
        quantile(accelerations, 0.5), quantile(jerks, 0.5), all.actual(), all.stated(), quantile(g_lin, 0.5),
        quantile(beta, 0.5), quantile(model, 0.5), linear.Q(), all.Q(), all.cover(), all.worst(),
        all.looseness(), ambiguous, unbounded + infeasible, show(gauss_markov).c_str(),
        show(least_squares).c_str(), show(velocity).c_str(), show(acceleration).c_str());
    std::fflush(stdout);
  }
}

/// A window of 100 s with 10 s segments and two radars at 1 Hz: the whole search over one certified solve.
void study_cost() {
  const study::Flight flight = study::airliner();
  const SetUp set_up = set_ups()[2];
  std::printf(
      "| draw | parameters | systems | search ms | certified solve ms | ratio "
      "|\n|---|---|---|---|---|---|\n");
  constexpr int kDraws = 9;
  std::vector<double> ratios;
  for (int draw = 0; draw < kDraws; ++draw) {
    RandomStream stream(7, static_cast<std::uint64_t>(draw));
    const Window window{.flight = &flight, .begin_s = 80.0 * draw, .duration_s = 100.0};
    Scenario scenario = make_scenario(window, set_up, 10.0, stream);
    scenario.observations =
        estimate::simulate_measurements(scenario, window, static_cast<std::uint64_t>(draw));
    const double start = now_s();
    const localise::Location found = localise::locate(scenario);
    const double middle = now_s();
    const auto about =
        found.branches.front().stated->problem.coordinates.spline(found.branches.front().stated->reference);
    constexpr int kRepeat = 5;
    double solve = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kRepeat; ++i) {
      const double from = now_s();
      const TrajectoryProblem problem = assemble(scenario, &about);
      const minimax::Solution solution = minimax::solve(problem.problem);
      const certify::Certificate certificate = certify::verify(problem.problem, solution);
      static_cast<void>(certificate);
      solve = std::min(solve, now_s() - from);
    }
    ratios.push_back((middle - start) / solve);
    std::printf("| %d | %ld | %d | %.1f | %.2f | %.1f |\n", draw,
                static_cast<long>(found.branches.front().stated->z.size()), found.systems,
                1e3 * (middle - start), 1e3 * solve, ratios.back());
  }
  std::printf("median ratio %.1f\n", quantile(ratios, 0.5));
}

}  // namespace

int main(int argc, char** argv) {
  // Freed memory is kept, as by the program: pages need not be cleared anew.
  mallopt(M_MMAP_THRESHOLD, 1 << 25);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  const std::string_view what = argc > 1 ? argv[1] : "";
  if (what == "manoeuvre") {
    study_manoeuvre(argc > 2 ? std::atoi(argv[2]) : 1000);
  } else if ((what == "flights" || what == "suggested") && argc > 2) {
    study_flights(argv[2], argc > 3 ? std::atoi(argv[3]) : 10,
                  argc > 4 ? static_cast<std::size_t>(std::atoi(argv[4])) : 0,
                  what == "flights" ? Knowledge::kFlight : Knowledge::kData);
  } else if (what == "cost") {
    study_cost();
  } else {
    std::fprintf(stderr,
                 "localise_study manoeuvre [draws] | flights|suggested DIRECTORY [windows per flight] "
                 "[set-up, 1 to 12] | "
                 "cost\n");
    return 2;
  }
  return 0;
}
