// SPDX-License-Identifier: Apache-2.0
/// @file
/// True paths of the localisation study: recorded flights and made-up ones.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace trammel::study {

inline constexpr double kGravity_mps2 = 9.81;

/// Position, velocity and acceleration at one time.
struct State {
  double t_s = 0.0;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_mps2 = Eigen::Vector3d::Zero();
};

/// A path through states: between two of them the polynomial of degree five that meets both.
class SampledPath {
 public:
  explicit SampledPath(std::vector<State> states) : states_(std::move(states)) {}

  [[nodiscard]] const std::vector<State>& states() const { return states_; }
  [[nodiscard]] double begin_s() const { return states_.front().t_s; }
  [[nodiscard]] double end_s() const { return states_.back().t_s; }
  [[nodiscard]] bool covers(double t) const { return t >= begin_s() && t <= end_s(); }
  [[nodiscard]] Eigen::Vector3d position(double t) const { return at(t).position_m; }
  [[nodiscard]] Eigen::Vector3d velocity(double t) const { return at(t).velocity_mps; }

  [[nodiscard]] State at(double t) const {
    const auto after = std::upper_bound(states_.begin() + 1, states_.end() - 1, t,
                                        [](double time, const State& state) { return time < state.t_s; });
    const State& b = *after;
    const State& a = *(after - 1);
    const double T = b.t_s - a.t_s;
    const double s = t - a.t_s;
    // What constant acceleration leaves to reach b, in units of T: c3 u^3 + c4 u^4 + c5 u^5.
    const Eigen::Vector3d dx =
        b.position_m - a.position_m - a.velocity_mps * T - a.acceleration_mps2 * (T * T / 2);
    const Eigen::Vector3d dv = (b.velocity_mps - a.velocity_mps - a.acceleration_mps2 * T) * T;
    const Eigen::Vector3d da = (b.acceleration_mps2 - a.acceleration_mps2) * (T * T);
    const Eigen::Vector3d c3 = 10 * dx - 4 * dv + da / 2;
    const Eigen::Vector3d c4 = -15 * dx + 7 * dv - da;
    const Eigen::Vector3d c5 = 6 * dx - 3 * dv + da / 2;
    const double u = s / T;
    const double u2 = u * u;
    return {.t_s = t,
            .position_m = a.position_m + a.velocity_mps * s + a.acceleration_mps2 * (s * s / 2) +
                          u2 * u * (c3 + u * (c4 + u * c5)),
            .velocity_mps =
                a.velocity_mps + a.acceleration_mps2 * s + u2 * (3 * c3 + u * (4 * c4 + u * 5 * c5)) / T,
            .acceleration_mps2 = a.acceleration_mps2 + u * (6 * c3 + u * (12 * c4 + u * 20 * c5)) / (T * T)};
  }

 private:
  std::vector<State> states_;
};

/// A flight with what its user would know of this class of aircraft.
struct Flight {
  std::string name;
  SampledPath path;
  Eigen::Vector3d acceleration_mps2;  ///< semi-axes: 1.5 times the 99 % quantile per axis
  double jerk_mps3;                   ///< 99 % quantile of its size between samples
};

/// The value that a share of `values` does not exceed.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) {
    return std::nan("");
  }
  const auto last = static_cast<double>(values.size() - 1);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::lround(share * last));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

inline Flight describe_flight(std::string name, SampledPath path) {
  constexpr double kShare = 0.99;
  constexpr double kMargin = 1.5;
  constexpr double kLeast_mps2 = 0.5;  // an axis that hardly moved in this record is not immovable
  std::array<std::vector<double>, 3> size;
  std::vector<double> jerk;
  const std::vector<State>& states = path.states();
  for (std::size_t i = 0; i < states.size(); ++i) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      size[static_cast<std::size_t>(axis)].push_back(std::abs(states[i].acceleration_mps2(axis)));
    }
    if (i > 0) {
      jerk.push_back((states[i].acceleration_mps2 - states[i - 1].acceleration_mps2).norm() /
                     (states[i].t_s - states[i - 1].t_s));
    }
  }
  Eigen::Vector3d semi_axes;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    semi_axes(axis) = std::max(kLeast_mps2, kMargin * quantile(size[static_cast<std::size_t>(axis)], kShare));
  }
  return {std::move(name), std::move(path), semi_axes, quantile(std::move(jerk), kShare)};
}

/// Reads `t_s,e_m,n_m,u_m,ve,vn,vu,ae,an,au`; empty where the file cannot be read.
inline std::vector<State> read_states(const std::string& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  std::vector<State> states;
  while (std::getline(in, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    State s;
    words >> s.t_s;
    for (Eigen::Vector3d* v : {&s.position_m, &s.velocity_mps, &s.acceleration_mps2}) {
      words >> v->x() >> v->y() >> v->z();
    }
    if (words) {
      states.push_back(s);
    }
  }
  return states;
}

/// Flies along a law that gives the acceleration from time and state (midpoint rule, a state twice a second).
inline SampledPath fly(State state, double duration_s,
                       const std::function<Eigen::Vector3d(const State&)>& acceleration) {
  constexpr double kStep_s = 0.005;
  constexpr int kKeep = 100;
  std::vector<State> states;
  const auto steps = static_cast<int>(std::lround(duration_s / kStep_s));
  for (int i = 0; i <= steps; ++i) {
    state.acceleration_mps2 = acceleration(state);
    if (i % kKeep == 0) {
      states.push_back(state);
    }
    State middle = state;
    middle.t_s += kStep_s / 2;
    middle.velocity_mps += state.acceleration_mps2 * (kStep_s / 2);
    middle.acceleration_mps2 = acceleration(middle);
    state.position_m += middle.velocity_mps * kStep_s;
    state.velocity_mps += middle.acceleration_mps2 * kStep_s;
    state.t_s += kStep_s;
  }
  return SampledPath(std::move(states));
}

/// Rises from 0 to 1 along a half cosine of `rise_s` from `from_s` on, falls likewise to end at `to_s`.
inline double pulse(double t, double from_s, double to_s, double rise_s) {
  const auto step = [rise_s](double s) {
    return (1 - std::cos(std::numbers::pi * std::clamp(s / rise_s, 0.0, 1.0))) / 2;
  };
  return step(t - from_s) - step(t - (to_s - rise_s));
}

/// Horizontal unit vector to the left of the velocity.
inline Eigen::Vector3d left_of(const Eigen::Vector3d& velocity) {
  return Eigen::Vector3d(-velocity.y(), velocity.x(), 0.0).normalized();
}

/// Parabolas as flown for weightlessness: pull up with 1.8 g, 22 s without weight, pull out, 40 s level.
inline Flight parabolic_flight() {
  const State start{.position_m = {-20000, 5000, 6000}, .velocity_mps = {180, 60, 0}};
  return describe_flight("parabolas", fly(start, 600, [](const State& s) {
                           constexpr double kPeriod_s = 100.0;
                           const double t = std::fmod(s.t_s, kPeriod_s);
                           // Rises overlap: 0.8 g x 13.75 s = g x 22 s / 2.
                           const double up = pulse(t, 10.0, 28.0, 3.0) + pulse(t, 48.5, 66.5, 3.0);
                           const double down = pulse(t, 25.5, 51.0, 3.0);
                           constexpr double kPull = 0.8 * 11.25 / 12.0;
                           return Eigen::Vector3d(0, 0, kGravity_mps2 * (kPull * up - down));
                         }));
}

/// From downwind over base onto a glide path of three degrees: two turns of 90 degrees at rate one, slowing.
inline Flight instrument_approach() {
  const State start{.position_m = {15000, 8000, 1200}, .velocity_mps = {-105, 0, 0}};
  return describe_flight(
      "approach", fly(start, 480, [](const State& s) {
        constexpr double kRateOne = 3.0 * std::numbers::pi / 180.0;
        const double speed = s.velocity_mps.head<2>().norm();
        const double turn = pulse(s.t_s, 60.0, 94.0, 4.0) + pulse(s.t_s, 130.0, 164.0, 4.0);
        const double slow = pulse(s.t_s, 100.0, 130.0, 5.0) + pulse(s.t_s, 200.0, 215.0, 5.0);
        const double sink = pulse(s.t_s, 190.0, 200.0, 4.0);
        const Eigen::Vector3d ahead = Eigen::Vector3d(s.velocity_mps.x(), s.velocity_mps.y(), 0).normalized();
        return Eigen::Vector3d(kRateOne * speed * turn * left_of(s.velocity_mps) - 0.7 * slow * ahead -
                               Eigen::Vector3d(0, 0, 0.7 * sink));
      }));
}

/// An airliner that climbs, cruises and turns with up to 25 degrees of bank.
inline Flight airliner() {
  const State start{.position_m = {-60000, -20000, 8500}, .velocity_mps = {215, 70, 8}};
  return describe_flight(
      "airliner", fly(start, 900, [](const State& s) {
        const double bank = pulse(s.t_s, 100, 150, 6) - pulse(s.t_s, 330, 420, 6) + pulse(s.t_s, 600, 640, 6);
        const double level = pulse(s.t_s, 200, 220, 4);
        constexpr double kBank = 25.0 * std::numbers::pi / 180.0;
        const Eigen::Vector3d side = kGravity_mps2 * std::tan(kBank * bank) * left_of(s.velocity_mps);
        return Eigen::Vector3d(side - Eigen::Vector3d(0, 0, 0.5 * level));
      }));
}

/// The made-up flights and the recorded ones found in `directory`.
inline std::vector<Flight> all_flights(const std::string& directory) {
  std::vector<Flight> flights;
  for (const char* name : {"glider_ash25", "paraglider_skydrop", "helicopter_rega"}) {
    std::vector<State> states = read_states(directory + "/" + name + ".smooth.csv");
    if (states.size() > 1) {
      flights.push_back(describe_flight(name, SampledPath(std::move(states))));
    }
  }
  flights.push_back(parabolic_flight());
  flights.push_back(instrument_approach());
  flights.push_back(airliner());
  return flights;
}

}  // namespace trammel::study
