// SPDX-License-Identifier: Apache-2.0
// What fits and whole searches cost by the built-in minimiser and by Ceres, and how far their results are
// apart.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <vector>

#include "localise_truth.hpp"
#include "trammel/ceres/fit.hpp"
#include "trammel/estimate/simulate_measurements.hpp"
#include "trammel/localise/levenberg_marquardt.hpp"
#include "trammel/localise/locate.hpp"

namespace {

using namespace trammel;
using study::quantile;

/// A window of the made-up airliner; times count from its beginning.
struct Window {
  study::SampledPath path;
  double begin_s = 0.0;

  [[nodiscard]] Eigen::Vector3d position(double t) const { return path.position(begin_s + t); }
  [[nodiscard]] Eigen::Vector3d velocity(double t) const { return path.velocity(begin_s + t); }
  [[nodiscard]] bool covers(double t) const { return path.covers(begin_s + t); }
};

struct SetUp {
  double duration_s;
  double segment_s;
  double range_sigma_m;
  double angle_sigma_rad;
  int draws;
};

/// Two radars at 1 Hz, the reference path straight and 100 m off.
Scenario make_scenario(const SetUp& set_up, int draw) {
  const study::Flight flight = study::airliner();
  const Window window{.path = flight.path, .begin_s = 80.0 * draw};
  Scenario scenario;
  const auto segments = static_cast<std::size_t>(std::lround(set_up.duration_s / set_up.segment_s));
  for (std::size_t i = 0; i <= segments; ++i) {
    scenario.knots_s.push_back(set_up.segment_s * static_cast<double>(i));
  }
  scenario.nominal.position_m = window.position(0.0) + Eigen::Vector3d(80, -50, 30);
  scenario.nominal.velocity_mps = window.velocity(0.0) + Eigen::Vector3d(-5, 6, 2);
  scenario.bounds = {.position_m = Eigen::Vector3d::Constant(300),
                     .velocity_mps = Eigen::Vector3d::Constant(20),
                     .acceleration_mps2 = std::vector<Eigen::Vector3d>(segments, flight.acceleration_mps2)};
  const Eigen::Vector3d middle = window.position(set_up.duration_s / 2);
  for (const Eigen::Vector3d& from : {Eigen::Vector3d(18000, 9000, 0), Eigen::Vector3d(-6000, 25000, 0)}) {
    const Eigen::Vector3d variances =
        Eigen::Vector3d(set_up.angle_sigma_rad, set_up.angle_sigma_rad, set_up.range_sigma_m).cwiseAbs2();
    Station radar{.name = from.x() > 0.0 ? "east" : "west",
                  .kind = SensorKind::kAzimuthElevationRange,
                  .position_m = {middle.x() + from.x(), middle.y() + from.y(), 0.0},
                  .covariance = variances.asDiagonal()};
    for (double t = 0.0; t <= set_up.duration_s; t += 1.0) {
      radar.times_s.push_back(t);
    }
    scenario.stations.push_back(std::move(radar));
  }
  scenario.observations = estimate::simulate_measurements(scenario, window, static_cast<std::uint64_t>(draw));
  return scenario;
}

/// Times in ms, one per draw, of the same work by both minimisers.
struct Pair {
  std::vector<double> built_in, ceres;

  /// Both in turn, each `repeats` times; the least time counts.
  template <class Work>
  void add(const Work& work, int repeats) {
    const localise::Minimiser levenberg_marquardt = localise::fit_levenberg_marquardt;
    const localise::Minimiser by_ceres = localise::fit_ceres;
    double first = std::numeric_limits<double>::infinity();
    double second = first;
    for (int i = 0; i < repeats; ++i) {
      first = std::min(first, time_ms(work, levenberg_marquardt));
      second = std::min(second, time_ms(work, by_ceres));
    }
    built_in.push_back(first);
    ceres.push_back(second);
  }
  void print() const {
    std::vector<double> ratios;
    for (std::size_t k = 0; k < ceres.size(); ++k) {
      ratios.push_back(ceres[k] / built_in[k]);
    }
    std::printf(" %.3g, %.3g, %.2f |", quantile(built_in, 0.5), quantile(ceres, 0.5), quantile(ratios, 0.5));
  }

 private:
  template <class Work>
  static double time_ms(const Work& work, const localise::Minimiser& minimise) {
    const auto start = std::chrono::steady_clock::now();
    work(minimise);
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  }
};

void study_set_up(const SetUp& set_up) {
  constexpr int kRepeats = 5;
  const localise::FitSettings kTight{.max_systems = 5000, .relative_decrease = 1e-18};
  Pair fit, reference, search;
  double apart_m = 0.0;
  double apart_stated = 0.0;
  int different = 0;
  Eigen::Index parameters = 0;
  for (int draw = 0; draw < set_up.draws; ++draw) {
    const Scenario scenario = make_scenario(set_up, draw);
    const localise::FitProblem problem(scenario);
    parameters = problem.parameters();
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(parameters);
    const Eigen::VectorXd near = localise::fit_levenberg_marquardt(problem, zero, localise::kWeakBarrier).z;
    const Eigen::VectorXd start = problem.pull_inside(0.9 * near, 0.95, zero);
    fit.add([&](const localise::Minimiser& minimise) { (void)minimise(problem, zero, 30.0, {}); }, kRepeats);
    reference.add(
        [&](const localise::Minimiser& minimise) {
          (void)minimise(problem, start, localise::kStrongBarrier, kTight);
        },
        kRepeats);
    std::vector<localise::Location> found;
    search.add(
        [&](const localise::Minimiser& minimise) {
          localise::LocateSettings settings;
          settings.minimise = minimise;
          found.push_back(localise::locate(scenario, settings));
        },
        1);
    const localise::Branch& a = found.front().branches.front();
    const localise::Branch& b = found.back().branches.front();
    different += found.front().status == found.back().status ? 0 : 1;
    apart_m = std::max(apart_m, problem.distance_m(a.reference.z, b.reference.z));
    apart_stated = std::max(apart_stated, std::abs(a.stated->stated_rms_m / b.stated->stated_rms_m - 1));
  }
  std::printf("| %.0f s, %.0f s, %.0f m, %.1f mrad | %ld | %d |", set_up.duration_s, set_up.segment_s,
              set_up.range_sigma_m, 1e3 * set_up.angle_sigma_rad, static_cast<long>(parameters),
              set_up.draws);
  fit.print();
  reference.print();
  search.print();
  std::printf(" %d | %.1e m, %.1e |\n", different, apart_m, apart_stated);
  std::fflush(stdout);
}

}  // namespace

int main() {
  std::printf(
      "| window, segments, range, angles | parameters | draws | fit: built-in, Ceres ms, ratio | reference "
      "fit "
      "| whole search | other status | references, stated values apart "
      "|\n|---|---|---|---|---|---|---|---|\n");
  for (const SetUp& set_up : {SetUp{100, 10, 15, 1.5e-3, 9}, SetUp{100, 4, 15, 1.5e-3, 9},
                              SetUp{100, 4, 3, 2e-4, 9}, SetUp{200, 4, 15, 1.5e-3, 3}}) {
    study_set_up(set_up);
  }
  return 0;
}
