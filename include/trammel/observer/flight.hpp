// SPDX-License-Identifier: Apache-2.0
/// @file
/// Conditionally programmed control: plan from the estimate, fly a while, measure, filter, plan again.
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/packet.hpp"
#include "trammel/core/settings.hpp"
#include "trammel/observer/bearing_filter.hpp"
#include "trammel/observer/plan.hpp"
#include "trammel/observer/plan_problem.hpp"
#include "trammel/observer/range_grid_filter.hpp"
#include "trammel/observer/single_weight.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

/// Which filter estimates the position in flight.
enum class FilterKind {
  kExtendedKalman,
  kRangeGrid,  ///< exact Bayes on a grid over x; tangents only
};

/// Settings of a closed loop.
struct FlightSettings {
  double replan_interval_s = 1.0;  ///< time between plans; infinity: one plan, open loop
  double min_final_distance_m =
      std::numeric_limits<double>::quiet_NaN();              ///< NaN: a tenth of |a| of the prior
  double gate_m = std::numeric_limits<double>::quiet_NaN();  ///< NaN: a fortieth of |a| of the prior
  double max_lateral_speed_mps = std::numeric_limits<double>::infinity();
  BearingKind measured = BearingKind::kTangents;
  FilterKind filter = FilterKind::kExtendedKalman;
};

template <class Settings, class Visitor>
requires std::same_as<std::remove_const_t<Settings>, FlightSettings>
void visit_fields(Settings& settings, Visitor&& visit) {
  visit(FieldDoc{.name = "replan_interval_s",
                 .unit = "s",
                 .meaning =
                     "time between two plans; below about 5 s in mid-course and 1 s near the end the miss "
                     "is as small as it gets"},
        settings.replan_interval_s);
  visit(FieldDoc{.name = "min_final_distance_m",
                 .unit = "m",
                 .meaning =
                     "an estimate whose flight would end closer to the beacon's plane than this is moved "
                     "back for planning; default: a tenth of the prior's final distance"},
        settings.min_final_distance_m);
  visit(FieldDoc{.name = "gate_m",
                 .unit = "m",
                 .meaning =
                     "measurements are skipped while the predicted x is closer than this to the beacon's "
                     "plane; default: a fortieth of the prior's final distance"},
        settings.gate_m);
  visit(FieldDoc{.name = "max_lateral_speed_mps",
                 .unit = "m/s",
                 .meaning = "plans respect this largest sqrt(u1^2 + u2^2) by lowering beta"},
        settings.max_lateral_speed_mps);
  visit(FieldDoc{.name = "measured", .unit = "", .meaning = "tangents or angles"}, settings.measured);
  visit(
      FieldDoc{
          .name = "filter", .unit = "", .meaning = "extended Kalman filter or exact Bayes on a grid over x"},
      settings.filter);
}

/// A moment of the flight at which something happens.
struct FlightEvent {
  double time_s = 0.0;
  bool measure = false;
  bool replan = false;
};

/// What one flight came to. Errors are estimate minus truth at T.
struct FlightOutcome {
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  Eigen::Vector3d final_position = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double miss_m = 0.0;  ///< distance of (y, z)(T) from the terminal point
  double effort_m =
      0.0;  ///< total variation of y plus that of z, relative to the beacon, sampled at the events
  double energy = 0.0;  ///< integral of the squared relative lateral velocity, sampled, m^2/s
  double nees = 0.0;    ///< error' Gamma^-1 error
  int moved_back = 0;   ///< plans made from an estimate that had to be moved back
  int skipped = 0;      ///< measurements the gate skipped
};

/// The closed loop of Emelyanov and Rubinovich (2020), section 4, ready to be flown any number of times.
///
///   at t_k = k times the replanning interval: plan from (R_hat, Gamma);
///   in between: truth and estimate both move by (V dt, P(t) - P(t - dt)), P the planned (y, z); every Delta
///   the bearing of the true position is measured and filtered.
///
/// The estimate may lie where no plan exists (x_hat + V T >= 0 although the truth is in front of the beacon):
/// it is planned for x = min(x_hat, -(V T_go + min_final_distance_m)) with y, z kept. Several threads may fly
/// the same loop.
class FlightLoop {
 public:
  /// `prior` gives mean and covariance of the start; Error if it is not a valid plan problem or a setting is
  /// bad.
  FlightLoop(const PlanProblem& prior, const FlightSettings& settings);

  [[nodiscard]] const std::vector<FlightEvent>& events() const { return events_; }
  [[nodiscard]] int measurements() const { return measurements_; }
  [[nodiscard]] const PlanProblem& prior() const { return prior_; }
  /// Settings with the defaults filled in.
  [[nodiscard]] const FlightSettings& settings() const { return settings_; }

  /// Flies once from `truth`. `noise()` returns the error of one measurement (2-vector, in units of sigma0);
  /// `watch(event, truth, filter)` is called at every event after the measurement and before the next plan
  /// takes effect, and once more with the start.
  template <class Noise, class Watch>
  FlightOutcome fly(const Eigen::Vector3d& truth, Noise&& noise, Watch&& watch) const {
    if (settings_.filter == FilterKind::kRangeGrid) {
      RangeGridFilter filter(prior_.position_m, prior_.covariance_m2, prior_.sigma0);
      filter.restrict_start(-prior_.closing_speed_mps() * prior_.time_to_go_s);
      return fly_with<double>(filter, truth, noise, watch).front();
    }
    return fly_lanes<double>(truth, noise, watch).front();
  }

  template <class Noise>
  FlightOutcome fly(const Eigen::Vector3d& truth, Noise&& noise) const {
    return fly(truth, noise, [](const auto&...) {});
  }

  /// Several flights in lockstep, one per lane of Real, with the extended Kalman filter.
  template <class Real, class Noise, class Watch>
  std::array<FlightOutcome, kLanesOf<Real>> fly_lanes(const Vector3<Real>& truth, Noise&& noise,
                                                      Watch&& watch) const {
    BasicBearingFilter<Real> filter(prior_.position_m, prior_.covariance_m2, prior_.sigma0,
                                    settings_.measured, settings_.gate_m);
    return fly_with<Real>(filter, truth, noise, watch);
  }

  /// Plan from an estimate at `time_s`; sets `moved_back` if it had to be moved.
  [[nodiscard]] Plan plan_from(const Eigen::Vector3d& estimate, const Eigen::Matrix3d& covariance,
                               double time_s, bool& moved_back) const;

 private:
  /// What the loop needs of a plan, and what helps to make the next one.
  template <class Real>
  struct FlightPath {
    PathCurve<Real> curve;
    Real x_start_m = 0.0;
    Real xi = 0.0;
    Real xi_change = 0.0;  ///< from the plan before

    /// Near the frequency of the next plan.
    [[nodiscard]] Real expected_xi() const {
      const Real ahead = xi + xi_change;
      return select(ahead > 0.5 * xi && ahead < 2.0 * xi, ahead, xi);
    }
  };

  /// Largest x from which a plan exists at `time_s`.
  [[nodiscard]] double largest_planned_x(double time_s) const {
    return -(prior_.closing_speed_mps() * (prior_.time_to_go_s - time_s) + settings_.min_final_distance_m);
  }
  /// Whether the path follows from one scalar equation.
  [[nodiscard]] bool single_weight() const {
    return !std::isfinite(settings_.max_lateral_speed_mps) && prior_.beta_per_s.y() == 0.0 &&
           prior_.beta_per_s.z() == 0.0;
  }

  /// Plans from the filter's estimate, moved back where no plan exists.
  template <class Real, class Filter>
  void replan(FlightPath<Real>& plan, const Filter& filter, double time_s) const {
    const Vector3<Real>& estimate = filter.position();
    const double limit = largest_planned_x(time_s);
    plan.x_start_m = select(estimate.x() <= limit, estimate.x(), Real(limit));
    const Vector3<Real> start(plan.x_start_m, estimate.y(), estimate.z());
    if (single_weight()) {
      // The path alone, from the previous root: the quantities of a full plan are not needed here.
      const BasicChannelProblem<Real> channels(prior_, prior_.time_to_go_s - time_s, start, filter.prior());
      const BasicPathShape<Real> shape =
          follow_single_weight(channels, prior_.beta_per_s.x(), plan.expected_xi());
      plan.xi_change = shape.xi - plan.xi;
      plan.xi = shape.xi;
      plan.curve = PathCurve<Real>(channels, shape);
      return;
    }
    const Matrix3<Real> covariance = filter.covariance();
    for (std::size_t lane = 0; lane < kLanesOf<Real>; ++lane) {
      const auto of_lane = [&](const Real& value) { return lane_of(value, lane); };
      bool moved_back = false;
      plan.curve.set_lane(
          lane, plan_from(start.unaryExpr(of_lane), covariance.unaryExpr(of_lane), time_s, moved_back).path);
    }
  }

  template <class Real, class Filter, class Noise, class Watch>
  std::array<FlightOutcome, kLanesOf<Real>> fly_with(Filter& filter, Vector3<Real> truth, Noise& noise,
                                                     Watch& watch) const {
    using std::abs;
    FlightPath<Real> plan;
    plan.xi = first_xi_;
    Vector2<Real> planned = Vector2<Real>::Zero();
    Real effort = 0.0;
    Real energy = 0.0;
    Real moved_back = 0.0;
    Real skipped = 0.0;
    double plan_time = 0.0;
    const double speed = prior_.closing_speed_mps();
    for (std::size_t k = 0; k < events_.size(); ++k) {
      const FlightEvent& event = events_[k];
      if (k > 0) {
        const double dt = event.time_s - events_[k - 1].time_s;
        const Vector2<Real> next = plan.curve.position(plan.x_start_m + speed * (event.time_s - plan_time));
        const Vector2<Real> step = next - planned;
        planned = next;
        const Vector3<Real> displacement(speed * dt, step.x(), step.y());
        truth += displacement;
        filter.move(displacement);
        effort += abs(step.x()) + abs(step.y());
        energy += (step.x() * step.x() + step.y() * step.y()) * (1.0 / dt);
      }
      if (event.measure) {
        const Vector2<Real> exact = bearing_value<Real>(settings_.measured, truth);
        const Vector2<Real> error = noise();
        const MaskOf<Real> used =
            filter.update({exact.x() + prior_.sigma0 * error.x(), exact.y() + prior_.sigma0 * error.y()});
        skipped += select(used, Real(0.0), Real(1.0));
      }
      watch(event, truth, filter);
      if (event.replan) {
        const Vector3<Real> estimate = filter.position();
        replan<Real>(plan, filter, event.time_s);
        moved_back += select(plan.x_start_m == estimate.x(), Real(0.0), Real(1.0));
        plan_time = event.time_s;
        planned = {estimate.y(), estimate.z()};
      }
    }
    const Matrix3<Real> covariance = filter.covariance();
    std::array<FlightOutcome, kLanesOf<Real>> outcomes;
    for (std::size_t lane = 0; lane < outcomes.size(); ++lane) {
      const auto of_lane = [&](const Real& value) { return lane_of(value, lane); };
      FlightOutcome& outcome = outcomes[lane];
      outcome.final_position = truth.unaryExpr(of_lane);
      outcome.error = Eigen::Vector3d(filter.position().unaryExpr(of_lane)) - outcome.final_position;
      outcome.covariance = covariance.unaryExpr(of_lane);
      outcome.nees = outcome.error.dot(linalg::Cholesky3(outcome.covariance).solve(outcome.error));
      outcome.miss_m = (outcome.final_position.tail<2>() - prior_.terminal_m).norm();
      outcome.effort_m = of_lane(effort);
      outcome.energy = of_lane(energy);
      outcome.moved_back = static_cast<int>(of_lane(moved_back));
      outcome.skipped = static_cast<int>(of_lane(skipped));
    }
    return outcomes;
  }

  PlanProblem prior_;
  FlightSettings settings_;
  std::vector<FlightEvent> events_;
  int measurements_ = 0;
  double first_xi_ = 0.0;  ///< of the plan from the prior
};

/// Moments of measuring and planning from 0 to `duration_s`, in order, coinciding ones joined; the last is
/// the end.
[[nodiscard]] std::vector<FlightEvent> flight_events(double duration_s, double measurement_interval_s,
                                                     double replan_interval_s);

}  // namespace trammel::inline TRAMMEL_ABI::observer

#ifndef TRAMMEL_COMPILED
#include "trammel/observer/flight_impl.hpp"
#endif
