// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of stated_value.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/estimate/bounded_motion.hpp"
#include "trammel/estimate/observed.hpp"
#include "trammel/linalg/double_double.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/localise/remainder.hpp"
#include "trammel/localise/stated_value.hpp"
#include "trammel/problem/noise.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

namespace detail {

/// One measurement seen from the reference.
struct Sight {
  SensorKind kind = SensorKind::kRange;
  double made_s = 0.0;         ///< the station's time offset included
  Eigen::Vector3d position_m;  ///< relative to the station
  Eigen::Vector3d velocity_mps;
  sensor::Linearised model;        ///< not whitened
  Eigen::MatrixXd error_per_unit;  ///< C K L^-1, criterion rows x components
  DeviationRadius tube;            ///< tau, of what the measurement sees: the station's clock included
  ClockRadius clock;               ///< tau of the station's time offset
};

/// The linear estimator about the reference, and its errors at the measurements.
struct Sights {
  std::vector<Sight> sights;
  Eigen::Index channels = 0;
  Eigen::Index criterion_rows = 0;
  double widening = 1.0;  ///< of all tubes
};

/// Rms bound of P (rows of the motion) under the estimator: bias over the bounds and noise.
class ErrorAt {
 public:
  ErrorAt(const TrajectoryProblem& problem, const MotionBounds& bounds, const Eigen::MatrixXd& gain)
      : noise_(gain * problem.problem.information_factor.transpose()) {
    const estimate::BoundedMotion motion = estimate::bounded_motion(problem.coordinates, bounds);
    // Motions without bounds are followed exactly where the linear guarantee is finite.
    bias_ = noise_ * (problem.problem.information_factor * motion.bounded) - motion.bounded;
    block_sizes_ = motion.block_sizes;
  }

  /// Errors of three rows of the motion.
  struct Rows {
    MotionCoordinates::Rows3 noise;
    MotionCoordinates::Rows3 bias;
  };
  [[nodiscard]] Rows of(const MotionCoordinates::Rows3& rows) const {
    const NonzeroColumns local = nonzero_columns(rows);
    const auto middle = rows.middleCols(local.first, local.count);
    return {.noise = middle * noise_.middleRows(local.first, local.count),
            .bias = middle * bias_.middleRows(local.first, local.count)};
  }

  /// tau of the rows seen along the rows of `directions`, orthonormal.
  template <int Directions>
  [[nodiscard]] double rms(const Eigen::Matrix<double, Directions, 3>& directions, const Rows& rows) const {
    const Eigen::Matrix<double, Directions, Eigen::Dynamic> bias = directions * rows.bias;
    double sum = 0.0;
    Eigen::Index at = 0;
    for (const Eigen::Index size : block_sizes_) {
      Eigen::Matrix<double, Directions, Directions> square;
      square.setZero();
      for (Eigen::Index j = at; j < at + size; ++j) {
        square += bias.col(j) * bias.col(j).transpose();
      }
      sum += std::sqrt(std::max(0.0, largest_eigenvalue(square)));
      at += size;
    }
    return std::sqrt(sum * sum + (directions * rows.noise).squaredNorm());
  }

 private:
  [[nodiscard]] static double largest_eigenvalue(const Eigen::Matrix3d& symmetric) {
    linalg::SymmetricEigen3 eigen;
    eigen.computeDirect(symmetric, Eigen::EigenvaluesOnly);  // the largest one to its last digits
    return eigen.eigenvalues().maxCoeff();
  }
  [[nodiscard]] static double largest_eigenvalue(const Eigen::Matrix2d& symmetric) {
    const double half_difference = (symmetric(0, 0) - symmetric(1, 1)) / 2;
    return symmetric.trace() / 2 +
           std::sqrt(half_difference * half_difference + symmetric(1, 0) * symmetric(1, 0));
  }

  Eigen::MatrixXd noise_;  ///< K times an orthogonal matrix, p x m
  Eigen::MatrixXd bias_;   ///< (K A - I) D
  std::vector<Eigen::Index> block_sizes_;
};

/// Bound of the acceleration (m/s^2) of every motion within the bounds, at all times, as a station sees it.
inline double largest_acceleration(const Scenario& scenario, const TrajectoryProblem& problem,
                                   std::size_t station) {
  double widest = 0.0;
  for (const Eigen::Vector3d& axes : scenario.bounds.acceleration_mps2) {
    widest = std::max(widest, axes.maxCoeff());
  }
  return widest + problem.nominal.largest_acceleration_mps2() +
         problem.stations[station].largest_acceleration_mps2();
}

inline Sights look(const Scenario& scenario, const TrajectoryProblem& problem, const Eigen::MatrixXd& gain) {
  const ErrorAt error(problem, scenario.bounds, gain);
  const std::vector<BiasParameter>& biases = problem.coordinates.bias_parameters();
  const auto q = static_cast<Eigen::Index>(biases.size());
  const Eigen::MatrixXd bias_rows = problem.coordinates.kept_motion_rows().bottomRows(q);
  const Eigen::MatrixXd reach = problem.problem.criterion_factor * gain;
  Sights result;
  result.criterion_rows = reach.rows();
  for_each_measurement(scenario, [&](const MeasurementSite& site) {
    const Station& station = scenario.stations[site.station];
    Sight sight;
    sight.kind = station.kind;
    const double made_s = sight.made_s = site.t_s + problem.time_offsets_s[site.station];
    const RelativeMotion motion = linearised_motion(problem, site.station, site.t_s);
    sight.position_m = motion.position_m;
    sight.velocity_mps = motion.velocity_mps;
    sight.model = sensor::linearise(station.kind, sight.position_m, sight.velocity_mps);
    const sensor::Linearised& model = sight.model;
    MotionCoordinates::Rows3 position = problem.coordinates.position_rows(made_s);
    MotionCoordinates::Rows3 velocity = problem.coordinates.velocity_rows(made_s);
    MotionCoordinates::Rows3 derivative =
        model.J_value_position * position + model.J_value_velocity * velocity;
    derivative += bias_columns(biases, site.station, time_rate(model, motion)) * bias_rows;
    const Eigen::Index count = components(station.kind);
    const bool own = site.observation != nullptr && site.observation->covariance.has_value();
    const Eigen::Matrix3d lower = noise_factor(own ? *site.observation->covariance : station.covariance,
                                               count, describe(scenario, site));
    // K L^-1 = gain (L^-1 H)' L^-1 = gain H' W^-1.
    const auto whiten = lower.triangularView<Eigen::Lower>();
    const MotionCoordinates::Rows3 rows =
        whiten.transpose().solve(Eigen::MatrixXd(whiten.solve(Eigen::MatrixXd(derivative))));
    const NonzeroColumns local = nonzero_columns(rows);
    sight.error_per_unit = reach.middleCols(local.first, local.count) *
                           rows.middleCols(local.first, local.count).topRows(count).transpose();
    const Eigen::Vector3d e = sight.position_m.normalized();
    const Eigen::Matrix3d every = Eigen::Matrix3d::Identity();
    const Eigen::Matrix<double, 2, 3> horizontal = every.topRows<2>();
    Eigen::Matrix<double, 2, 3> across;
    across.row(0) = e.unitOrthogonal();
    across.row(1) = e.cross(across.row(0).transpose());
    sight.clock.acceleration_mps2 = largest_acceleration(scenario, problem, site.station);
    sight.clock.reference_mps2 = motion.acceleration_mps2.norm();
    for (Eigen::Index k = 0; k < q; ++k) {
      const BiasParameter& bias = biases[static_cast<std::size_t>(k)];
      if (bias.station == site.station && bias.component == BiasParameter::kTimeOffset) {
        MotionCoordinates::Rows3 offset = MotionCoordinates::Rows3::Zero(3, bias_rows.cols());
        offset.row(0) = bias_rows.row(k);
        sight.clock.offset_s = error.rms(every, error.of(offset));
        position += motion.velocity_mps * bias_rows.row(k);
      }
    }
    const ErrorAt::Rows error_m = error.of(position);
    const bool velocity_counts = station.kind == SensorKind::kRangeRate || sight.clock.offset_s > 0.0;
    sight.tube = {.all_m = error.rms(every, error_m),
                  .across_m = error.rms(across, error_m),
                  .horizontal_m = error.rms(horizontal, error_m),
                  .velocity_mps = velocity_counts ? error.rms(every, error.of(velocity)) : 0.0};
    result.channels += count;
    result.sights.push_back(std::move(sight));
  });
  return result;
}

/// How much wider the tube has to be where the estimate lies clearly outside: the root mean square of its
/// distance from the reference over that of tau, both over the measurements; 1 where it lies within.
inline double tube_widening(const trajectory::QuadraticSpline<double>& deviation, const Sights& sights) {
  constexpr double kClearly = 2.0;  // less is usual where strong barriers hold the reference back
  double distance = 0.0;
  double tube = 0.0;
  for (const Sight& sight : sights.sights) {
    distance += deviation.position(sight.made_s).squaredNorm();
    tube += sight.tube.all_m * sight.tube.all_m;
  }
  const double ratio = std::sqrt(distance / tube);
  return ratio > kClearly && std::isfinite(ratio) ? ratio : 1.0;
}

struct ChannelBound {
  double upper = 0.0;
  double lower = 0.0;  ///< attained by signs
};

/// How errors of the channels combine: N = C K L^-1 diag(half widths).
class Channels {
 public:
  explicit Channels(const Sights& sights) : unit_(sights.criterion_rows, sights.channels) {
    Eigen::Index at = 0;
    for (const Sight& sight : sights.sights) {
      unit_.middleCols(at, sight.error_per_unit.cols()) = sight.error_per_unit;
      at += sight.error_per_unit.cols();
    }
    for (Eigen::Index first = 0; unit_.cols() <= kMostKept && first < unit_.cols(); first += kPanel) {
      panels_.push_back(panel(first));
    }
  }

  /// Bounds max |N s| over |s_k| <= 1 (also its root mean square over random s with E s_k^2 <= 1).
  [[nodiscard]] ChannelBound bound(const Sights& sights,
                                   const std::vector<sensor::Padded>& half_width) const {
    const Eigen::VectorXd width = widths(sights, half_width);
    const Eigen::MatrixXd N = unit_ * width.asDiagonal();
    const linalg::SymmetricEigen eigen(N * N.transpose());
    const auto signs = [](const Eigen::VectorXd& x) -> Eigen::VectorXd {
      return x.unaryExpr([](double value) { return value < 0.0 ? -1.0 : 1.0; });
    };
    Eigen::VectorXd s = signs(N.transpose() * eigen.eigenvectors().rightCols<1>());
    constexpr int kSteps = 100;  // |N s| grows with each step but the last; a few are usual
    for (int step = 0; step < kSteps; ++step) {
      const Eigen::VectorXd next = signs(N.transpose() * (N * s));
      if (next == s) {
        break;
      }
      s = next;
    }
    return {.upper = upper(width, size_sum(width), eigen.eigenvalues().maxCoeff()), .lower = (N * s).norm()};
  }

  /// The upper bound alone.
  [[nodiscard]] double bound_above(const Sights& sights,
                                   const std::vector<sensor::Padded>& half_width) const {
    const Eigen::VectorXd width = widths(sights, half_width);
    const Eigen::MatrixXd N = unit_ * width.asDiagonal();
    const Eigen::MatrixXd square = N * N.transpose();
    const double sum = size_sum(width);
    // The largest eigenvalue is at least the Frobenius norm over the root of their number: often that says
    // that its bound is not the smaller one.
    const double least = square.norm() / std::sqrt(static_cast<double>(square.rows()));
    if (sum <= static_cast<double>(width.size()) * least) {
      return std::sqrt(sum);
    }
    return upper(width, sum, linalg::SymmetricEigen(square, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff());
  }

 private:
  /// Channels up to which |N'N| is kept for other widths (100 MB) ...
  static constexpr Eigen::Index kMostKept = 5000;
  /// ... as panels of so many columns.
  static constexpr Eigen::Index kPanel = 64;

  /// |unit' unit| entry by entry: the columns from `first` on, from the diagonal on.
  [[nodiscard]] Eigen::MatrixXd panel(Eigen::Index first) const {
    const Eigen::Index count = std::min(kPanel, unit_.cols() - first);
    Eigen::MatrixXd result(unit_.cols() - first, count);
    result.noalias() = unit_.rightCols(result.rows()).transpose() * unit_.middleCols(first, count);
    result = result.cwiseAbs();
    return result;
  }

  [[nodiscard]] static Eigen::VectorXd widths(const Sights& sights,
                                              const std::vector<sensor::Padded>& half_width) {
    Eigen::VectorXd result(sights.channels);
    Eigen::Index at = 0;
    for (std::size_t k = 0; k < sights.sights.size(); ++k) {
      for (Eigen::Index i = 0; i < sights.sights[k].error_per_unit.cols(); ++i) {
        result(at++) = half_width[k](i);
      }
    }
    return result;
  }

  [[nodiscard]] static double upper(const Eigen::VectorXd& width, double sum, double largest) {
    return std::sqrt(std::min(sum, static_cast<double>(width.size()) * std::max(0.0, largest)));
  }

  /// Sum of all |M_kl|.
  [[nodiscard]] double size_sum(const Eigen::VectorXd& width) const {
    double sum = 0.0;
    const auto add = [&](Eigen::Index first, const Eigen::MatrixXd& panel) {
      const Eigen::VectorXd rows = panel * width.segment(first, panel.cols());
      sum += width.segment(first, panel.cols()).dot(rows.head(panel.cols())) +
             2 * width.tail(panel.rows() - panel.cols()).dot(rows.tail(panel.rows() - panel.cols()));
    };
    for (Eigen::Index first = 0; first < unit_.cols(); first += kPanel) {
      if (panels_.empty()) {
        add(first, panel(first));
      } else {
        add(first, panels_[static_cast<std::size_t>(first / kPanel)]);
      }
    }
    return sum;
  }

  Eigen::MatrixXd unit_;                 ///< C K L^-1
  std::vector<Eigen::MatrixXd> panels_;  ///< each `panel`; none above kMostKept
};

/// The remainder of one measurement at the radii scale * tau.
inline RemainderBound bound_sight(const Sight& sight, const ModelError& model, double scale) {
  const DeviationRadius& tau = sight.tube;
  ClockRadius clock = sight.clock;
  clock.offset_s *= scale;
  return bound_remainder(sight.kind, sight.position_m, sight.velocity_mps, sight.model,
                         {.all_m = scale * tau.all_m + model.position_m,
                          .across_m = scale * tau.across_m + model.position_m,
                          .horizontal_m = scale * tau.horizontal_m + model.position_m,
                          .velocity_mps = scale * tau.velocity_mps + model.velocity_mps},
                         clock);
}

/// Half widths of the remainders with the widened tube multiplied by `factor`; nothing where one is not
/// bounded.
inline std::optional<std::vector<sensor::Padded>> remainder_widths(const Sights& sights,
                                                                   const ModelError& model, double factor) {
  std::vector<sensor::Padded> widths;
  for (const Sight& sight : sights.sights) {
    const RemainderBound bound = bound_sight(sight, model, kTubeFactor * sights.widening * factor);
    if (!bound.valid || !bound.half_width.allFinite()) {
      return std::nullopt;
    }
    widths.push_back(bound.half_width);
  }
  return widths;
}

/// The model error through the estimator, plus itself.
inline double model_term(const Sights& sights, const Channels& channels, const ModelError& model) {
  if (model.position_m == 0.0 && model.velocity_mps == 0.0) {
    return 0.0;
  }
  if (model.kind == ModelError::Kind::kBox) {
    std::vector<sensor::Padded> widths;
    for (const Sight& sight : sights.sights) {
      widths.emplace_back(sight.model.J_value_position.rowwise().norm() * model.position_m +
                          sight.model.J_value_velocity.rowwise().norm() * model.velocity_mps);
    }
    return channels.bound_above(sights, widths) + model.position_m;
  }
  // max |sum_k N_k s_k| over sum |s_k|^2 <= n is sqrt(n lambda_max(sum N_k N_k')).
  Eigen::MatrixXd position = Eigen::MatrixXd::Zero(sights.criterion_rows, sights.criterion_rows);
  Eigen::MatrixXd velocity = position;
  for (const Sight& sight : sights.sights) {
    const Eigen::Index count = sight.error_per_unit.cols();
    const Eigen::MatrixXd N = sight.error_per_unit * sight.model.J_value_position.topRows(count);
    const Eigen::MatrixXd N_velocity = sight.error_per_unit * sight.model.J_value_velocity.topRows(count);
    position += N * N.transpose();
    velocity += N_velocity * N_velocity.transpose();
  }
  const auto widest = [&](const Eigen::MatrixXd& square) {
    const linalg::SymmetricEigen eigen(square, Eigen::EigenvaluesOnly);
    return std::sqrt(static_cast<double>(sights.sights.size()) *
                     std::max(0.0, eigen.eigenvalues().maxCoeff()));
  };
  return model.position_m * widest(position) + model.velocity_mps * widest(velocity) + model.position_m;
}

/// g where widening the tube by g/g_lin changes nothing any more; nothing where it keeps growing.
inline std::optional<double> fixed_point(const Sights& sights, const Channels& channels,
                                         const ModelError& model, double g_lin, double first,
                                         double g_model) {
  constexpr int kRounds = 500;
  constexpr double kSettled = 1e-13;
  double g = first;
  for (int round = 0; round < kRounds; ++round) {
    const auto wider = remainder_widths(sights, model, g / g_lin);
    if (!wider) {
      return std::nullopt;
    }
    const double next = g_lin + channels.bound_above(sights, *wider) + g_model;
    if (std::abs(next - g) <= kSettled * next) {
      return next;
    }
    g = next;
  }
  return std::nullopt;
}

/// The curvature term follows the estimator to first order, where the guarantee does to second: a narrower
/// interval than the one asked for keeps its digits. Only where that costs a few iterations.
inline minimax::Solution solve_tightly(const minimax::MethodChoice& method, const GuaranteedProblem& problem,
                                       const minimax::SolverSettings& asked) {
  constexpr double kNarrower = 1e-2;
  constexpr double kNarrowest = 1e-10;
  minimax::SolverSettings tight = asked;
  if (method.method == minimax::RequestedMethod::kStructured) {
    tight.relative_gap = std::min(asked.relative_gap, std::max(kNarrower * asked.relative_gap, kNarrowest));
  }
  minimax::Solution solution = minimax::solve_with(method, problem, tight);
  if (solution.status != SolveStatus::kUnbounded && solution.relative_gap() <= asked.relative_gap) {
    solution.status = SolveStatus::kOptimal;
  }
  return solution;
}

inline void check_model_error(const Scenario& scenario, const ModelError& model) {
  const auto size = [](double value, const char* where) {
    if (!(value >= 0.0) || !std::isfinite(value)) {
      throw Error({where, shortest(value), "a finite value that is not negative"});
    }
  };
  size(model.position_m, "model_error.position_m");
  size(model.velocity_mps, "model_error.velocity_mps");
  const bool rates = std::any_of(scenario.stations.begin(), scenario.stations.end(),
                                 [](const Station& s) { return s.kind == SensorKind::kRangeRate; });
  if (rates && model.position_m > 0.0 && model.velocity_mps == 0.0) {
    throw Error({"model_error.velocity_mps", "0 beside range rates", "a bound on the velocity's error"});
  }
}

}  // namespace detail

TRAMMEL_INLINE ModelError model_error_from_jerk(double jerk_mps3, double segment_s) {
  if (!(jerk_mps3 >= 0.0) || !std::isfinite(jerk_mps3)) {
    throw Error({"jerk_mps3", shortest(jerk_mps3), "a finite bound that is not negative"});
  }
  if (!(segment_s > 0.0) || !std::isfinite(segment_s)) {
    throw Error({"segment_s", shortest(segment_s), "a positive length"});
  }
  return {.position_m = jerk_mps3 * segment_s * segment_s * segment_s / 24,
          .velocity_mps = 15 * jerk_mps3 * segment_s * segment_s / 32};
}

TRAMMEL_INLINE StatedValue state(const FitProblem& fit, const Eigen::VectorXd& reference,
                                 const ModelError& model_error, const minimax::SolverSettings& solver,
                                 const minimax::MethodChoice& method) {
  require(reference.size() == fit.parameters(), "reference", std::to_string(reference.size()) + " entries",
          std::to_string(fit.parameters()));
  require(fit.inside(reference), "reference", "a deviation outside the bounds", "one strictly inside");
  const Scenario& scenario = fit.scenario();
  detail::check_model_error(scenario, model_error);
  const trajectory::QuadraticSpline<double> about = fit.trajectory().coordinates.spline(reference);
  const std::vector<double> offsets_s =
      fit.trajectory().coordinates.time_offsets_s(reference, scenario.stations.size());
  StatedValue result(assemble(scenario, &about, offsets_s));
  result.reference = result.problem.coordinates.moved_from(fit.trajectory().coordinates, reference);
  result.solution = detail::solve_tightly(method, result.problem.problem, solver);
  result.certificate = certify::certify(result.problem.problem, solver, result.solution);
  if (!std::isfinite(result.solution.upper) || !(result.solution.upper > 0.0)) {
    return result;
  }
  const Eigen::MatrixXd& F = result.problem.problem.information_factor;
  result.z = result.solution.gain * (F.transpose() * result.problem.information_rhs);
  const estimate::BiasEstimate biases =
      estimate::estimate_biases(result.problem, scenario.bounds, result.solution.gain);
  result.z.tail(biases.z.size()) = biases.z;
  result.linear_guarantee_rms_m = linalg::round_up(std::sqrt(result.solution.upper));
  detail::Sights sights = detail::look(scenario, result.problem, result.solution.gain);
  sights.widening =
      detail::tube_widening(result.problem.coordinates.spline(result.z - result.reference), sights);
  result.tube_widening = sights.widening;
  for (const detail::Sight& sight : sights.sights) {
    result.tube_m.push_back(sights.widening * sight.tube.all_m);
  }
  const detail::Channels channels(sights);
  result.model_error_rms_m = detail::model_term(sights, channels, model_error);
  const auto widths = detail::remainder_widths(sights, model_error, 1.0);
  if (!widths) {
    return result;
  }
  const detail::ChannelBound beta = channels.bound(sights, *widths);
  const double g_lin = result.linear_guarantee_rms_m;
  result.curvature_rms_m = beta.upper;
  result.curvature_lower_rms_m = beta.lower;
  result.kappa = beta.upper / g_lin;
  result.sum_rms_m = g_lin + beta.upper + result.model_error_rms_m;
  result.fixed_point_rms_m =
      detail::fixed_point(sights, channels, model_error, g_lin, result.sum_rms_m, result.model_error_rms_m);
  const bool settled = result.fixed_point_rms_m.has_value() && result.kappa <= 0.25;  // f = 1 + kappa f^2
  result.consistency = settled ? Consistency::kSelfConsistent : Consistency::kCurvatureDominated;
  result.stated_rms_m = settled ? *result.fixed_point_rms_m : result.sum_rms_m;
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
