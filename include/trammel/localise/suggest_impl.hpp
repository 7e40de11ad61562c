// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of suggest.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/localise/falling_barriers.hpp"
#include "trammel/localise/interior_motion.hpp"
#include "trammel/localise/locate.hpp"
#include "trammel/localise/suggest.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

namespace detail {

/// The observations on equal segments.
inline Scenario on_segments(Scenario scenario, std::size_t segments, const Eigen::Vector3d& bound_mps2) {
  const double begin = scenario.knots_s.front();
  const double end = scenario.knots_s.back();
  scenario.knots_s.clear();
  for (std::size_t i = 0; i < segments; ++i) {
    scenario.knots_s.push_back(begin +
                               (end - begin) * static_cast<double>(i) / static_cast<double>(segments));
  }
  scenario.knots_s.push_back(end);
  scenario.bounds.acceleration_mps2.assign(segments, bound_mps2);
  return scenario;
}

/// Numbers of segments to try, descending.
inline std::vector<std::size_t> segment_counts(const Scenario& scenario, const SuggestSettings& settings) {
  constexpr std::size_t kFewest = 3;  // to see a jerk
  const double duration = scenario.knots_s.back() - scenario.knots_s.front();
  std::vector<double> lengths = settings.lengths_s;
  if (lengths.empty()) {
    constexpr std::array kSteps{1.0, 2.0, 3.0, 5.0, 7.0};
    for (double decade = std::pow(10.0, std::floor(std::log10(duration / settings.max_segments)));
         decade < duration; decade *= 10) {
      for (const double step : kSteps) {
        lengths.push_back(step * decade);
      }
    }
  }
  std::vector<std::size_t> counts;
  for (const double length : lengths) {
    if (!(length > 0.0) || !std::isfinite(length)) {
      throw Error({"lengths_s", shortest(length), "positive lengths"});
    }
    const double count = std::round(duration / length);
    if (count >= static_cast<double>(kFewest) && count <= settings.max_segments) {
      counts.push_back(static_cast<std::size_t>(count));
    }
  }
  std::sort(counts.rbegin(), counts.rend());
  counts.erase(std::unique(counts.begin(), counts.end()), counts.end());
  if (counts.empty()) {
    throw Error({"lengths_s", "no length with 3 to " + std::to_string(settings.max_segments) + " segments",
                 "a shorter length or a longer flight"});
  }
  return counts;
}

/// The value below which a share `quantile` of the values is.
inline double quantile_of(std::vector<double> values, double quantile) {
  const auto at = static_cast<std::size_t>(std::ceil(quantile * static_cast<double>(values.size())));
  const std::size_t place = std::min(values.size() - 1, at == 0 ? 0 : at - 1);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(place), values.end());
  return values[place];
}

/// Normal accelerations of unknown variance, seen through linearised observations: theta = D u, u ~ N(0, I).
class AccelerationModel {
 public:
  AccelerationModel(const FitProblem& problem, const Eigen::VectorXd& about) : problem_(problem) {
    const MotionCoordinates& coordinates = problem.trajectory().coordinates;
    const Quadratic at = problem.expand(about, 0.0);
    const Eigen::MatrixXd map = coordinates.from_kept_motion();
    J_ = map.transpose() * at.hessian * map;
    pull_ = map.transpose() * (at.hessian * about - at.gradient);
    squares_ = problem.chi2(about) - 2 * about.dot(at.gradient) + about.dot(at.hessian * about);
    const MotionBounds& bounds = problem.scenario().bounds;
    spread_.resize(coordinates.parameters());
    for (Eigen::Index k = 0; k < spread_.size(); ++k) {
      // The ridge prior d^2/3 where the scenario has a bound; where it has none, hardly any.
      constexpr double kUnbounded = 1e6;
      const double axis =
          k < coordinates.motion_parameters()
              ? semi_axes(bounds, place(k) / 3)(place(k) % 3)
              : coordinates.bias_parameters()[static_cast<std::size_t>(k - coordinates.motion_parameters())]
                    .semi_axis;
      spread_(k) = std::isfinite(axis) ? axis / std::sqrt(3.0) : kUnbounded;
    }
    maximise();
  }

  [[nodiscard]] double likelihood() const { return squares_ - pull_.dot(mean_) + log_determinant_; }

  /// Bounds, jerk and the share of what the data leave open.
  void read(const SuggestSettings& settings, LengthTrial& trial) const {
    std::array<std::vector<double>, 2> sizes;  // horizontal, vertical
    double open = 0.0;
    double all = 0.0;
    std::vector<double> jerks;
    for (Eigen::Index k = 0; k < spread_.size(); ++k) {
      if (!is_acceleration(k)) {
        continue;
      }
      const double square = mean_(k) * mean_(k) + covariance_(k, k);
      sizes[is_vertical(k) ? 1 : 0].push_back(std::sqrt(square));
      open += covariance_(k, k);
      all += square;
    }
    const Eigen::Index first =
        problem_.trajectory().coordinates.motion_parameters() - 3 * static_cast<Eigen::Index>(trial.segments);
    for (Eigen::Index i = first; i + 3 < problem_.trajectory().coordinates.motion_parameters(); i += 3) {
      double square = 0.0;
      for (Eigen::Index a = i; a < i + 3; ++a) {
        const double step = mean_(a + 3) - mean_(a);
        square += step * step + covariance_(a, a) + covariance_(a + 3, a + 3) - 2 * covariance_(a, a + 3);
      }
      jerks.push_back(std::sqrt(square) / trial.segment_s);
    }
    const double horizontal = settings.margin * quantile_of(sizes[0], settings.quantile);
    const double vertical = settings.margin * quantile_of(sizes[1], settings.quantile);
    trial.acceleration_mps2 << horizontal, horizontal, vertical;
    trial.jerk_mps3 = settings.margin * quantile_of(jerks, settings.quantile);
    trial.noise_share = all > 0.0 ? open / all : 0.0;
  }

 private:
  [[nodiscard]] Eigen::Index place(Eigen::Index k) const {
    return problem_.trajectory().coordinates.kept()[static_cast<std::size_t>(k)];
  }
  [[nodiscard]] bool is_acceleration(Eigen::Index k) const {
    return k < problem_.trajectory().coordinates.motion_parameters() && place(k) >= 6;
  }
  [[nodiscard]] bool is_vertical(Eigen::Index k) const { return place(k) % 3 == 2; }

  void condition() {
    const Eigen::MatrixXd scaled = spread_.asDiagonal() * J_ * spread_.asDiagonal();
    const linalg::Cholesky cholesky(scaled + Eigen::MatrixXd::Identity(J_.rows(), J_.cols()));
    const Eigen::MatrixXd inverse = cholesky.solve(Eigen::MatrixXd::Identity(J_.rows(), J_.cols()));
    covariance_ = spread_.asDiagonal() * inverse * spread_.asDiagonal();
    mean_ = covariance_ * pull_;
    log_determinant_ = 2 * Eigen::MatrixXd(cholesky.matrixL()).diagonal().array().log().sum();
  }

  /// The variances that one step of expectation and maximisation makes of those given, as logarithms of the
  /// deviations (horizontal, vertical).
  [[nodiscard]] Eigen::Vector2d improve(const Eigen::Vector2d& log_deviation) {
    constexpr double kLeast_mps2 = 1e-6;  // a straight flight: the iteration would end at zero
    for (Eigen::Index k = 0; k < spread_.size(); ++k) {
      if (is_acceleration(k)) {
        spread_(k) = std::exp(log_deviation(is_vertical(k) ? 1 : 0));
      }
    }
    condition();
    Eigen::Vector2d square = Eigen::Vector2d::Zero();
    Eigen::Vector2d count = Eigen::Vector2d::Zero();
    for (Eigen::Index k = 0; k < spread_.size(); ++k) {
      if (is_acceleration(k)) {
        const Eigen::Index group = is_vertical(k) ? 1 : 0;
        square(group) += mean_(k) * mean_(k) + covariance_(k, k);
        count(group) += 1.0;
      }
    }
    return square.cwiseQuotient(count).cwiseSqrt().cwiseMax(kLeast_mps2).array().log();
  }

  /// Steps of expectation and maximisation, extrapolated two by two (Varadhan and Roland 2008, scheme S3):
  /// where the data say little about the accelerations plain steps hardly move.
  void maximise() {
    constexpr double kFirst_mps2 = 3.0;
    constexpr double kSettled = 1e-3;  // of the deviations, left to go
    constexpr double kFarthest = 3.0;  // of their logarithms, in one extrapolation
    constexpr int kRounds = 40;
    Eigen::Vector2d at = Eigen::Vector2d::Constant(std::log(kFirst_mps2));
    for (int round = 0; round < kRounds; ++round) {
      const Eigen::Vector2d first = improve(at);
      const Eigen::Vector2d step = first - at;
      const Eigen::Vector2d second = improve(first);
      const Eigen::Vector2d bend = second - first - step;
      const double length = bend.norm() > 0.0
                                ? std::max(1.0, std::min(step.norm() / bend.norm(), kFarthest / step.norm()))
                                : 1.0;
      const Eigen::Vector2d next = at + 2 * length * step + length * length * bend;
      if ((next - at).cwiseAbs().maxCoeff() <= kSettled) {
        break;
      }
      at = next;
    }
  }

  const FitProblem& problem_;
  Eigen::MatrixXd J_;       ///< information on theta
  Eigen::VectorXd pull_;    ///< A'y
  double squares_ = 0.0;    ///< |y|^2
  Eigen::VectorXd spread_;  ///< D
  Eigen::MatrixXd covariance_;
  Eigen::VectorXd mean_;
  double log_determinant_ = 0.0;
};

}  // namespace detail

TRAMMEL_INLINE double LengthTrial::excess() const { return (chi2 - degrees) / std::sqrt(2 * degrees); }

TRAMMEL_INLINE Suggestion suggest_segments(const Scenario& scenario, const SuggestSettings& settings,
                                           const ProgressObserver& observe) {
  if (!(settings.quantile > 0.0 && settings.quantile <= 1.0)) {
    throw Error({"quantile", shortest(settings.quantile), "a share above 0 up to 1"});
  }
  if (!(settings.margin > 0.0) || !std::isfinite(settings.margin)) {
    throw Error({"margin", shortest(settings.margin), "a positive factor"});
  }
  check(scenario);
  const std::vector<std::size_t> counts = detail::segment_counts(scenario, settings);
  const ProgressObserver tell = steady(observe);
  const auto progress = [&](double done) {
    if (tell) {
      tell({.phase = "segment lengths", .fraction = done / static_cast<double>(2 * counts.size())});
    }
  };
  const double duration = scenario.knots_s.back() - scenario.knots_s.front();
  Suggestion result;
  std::vector<Eigen::VectorXd> theta;
  std::vector<Eigen::VectorXd> biases;
  for (const std::size_t segments : counts) {
    constexpr double kWide_mps2 = 100.0;
    const FitProblem problem(detail::on_segments(scenario, segments, Eigen::Vector3d::Constant(kWide_mps2)),
                             settings.minimum_height_m);
    constexpr std::array kWeights{30.0, 10.0, 3.0, 1.0};
    const Fit fit = fit_with_falling_barriers(problem, require_interior_motion(problem, settings.minimise),
                                              kWeights, settings.minimise, settings.fit);
    LengthTrial trial;
    trial.segments = segments;
    trial.segment_s = duration / static_cast<double>(segments);
    const detail::AccelerationModel model(problem, fit.z);
    model.read(settings, trial);
    trial.likelihood = model.likelihood();
    theta.emplace_back(problem.trajectory().coordinates.motion(fit.z));
    biases.emplace_back(problem.trajectory().coordinates.biases(fit.z));
    result.trials.push_back(trial);
    progress(static_cast<double>(result.trials.size()));
  }
  const auto by_likelihood = [](const LengthTrial& a, const LengthTrial& b) {
    return a.likelihood < b.likelihood;
  };
  result.likeliest = static_cast<std::size_t>(
      std::min_element(result.trials.begin(), result.trials.end(), by_likelihood) - result.trials.begin());
  result.jerk_mps3 = result.trials[result.likeliest].jerk_mps3;
  for (std::size_t i = 0; i < result.trials.size(); ++i) {
    LengthTrial& trial = result.trials[i];
    trial.model_error = model_error_from_jerk(result.jerk_mps3, trial.segment_s);
    const FitProblem problem(detail::on_segments(scenario, trial.segments, trial.acceleration_mps2),
                             settings.minimum_height_m);
    constexpr double kInside = 0.9;
    const Eigen::VectorXd start =
        problem.pull_inside(problem.trajectory().coordinates.from_motion(theta[i], biases[i]), kInside,
                            require_interior_motion(problem, settings.minimise));
    const Fit fit = settings.minimise(problem, start, kWeakBarrier, settings.fit);
    const Eigen::MatrixXd J = problem.expand(fit.z, 0.0).hessian;
    const linalg::Cholesky posterior(problem.expand(fit.z, kWeakBarrier).hessian);
    Eigen::Index values = 0;
    for (const Measurement& m : scenario.observations) {
      values += m.value.size();
    }
    trial.chi2 = fit.chi2;
    trial.degrees = static_cast<double>(values) - posterior.solve(J).trace();
    const Fit strong = settings.minimise(problem, fit.z, kStrongBarrier, settings.fit);
    const StatedValue stated = state(problem, strong.z, trial.model_error, settings.solver);
    trial.linear_rms_m = stated.linear_guarantee_rms_m;
    trial.curvature_rms_m = stated.curvature_rms_m;
    trial.model_rms_m = stated.model_error_rms_m;
    trial.stated_rms_m = stated.sum_rms_m;
    progress(static_cast<double>(result.trials.size() + i + 1));
  }
  const auto less = [](double a, double b) {  // NaN compares as worse
    return a < b || (std::isnan(b) && !std::isnan(a));
  };
  const auto better = [&less](const LengthTrial& a, const LengthTrial& b) {
    if (a.fits() != b.fits()) {
      return a.fits();
    }
    return a.fits() ? less(a.stated_rms_m, b.stated_rms_m) : less(a.excess(), b.excess());
  };
  result.best = static_cast<std::size_t>(
      std::min_element(result.trials.begin(), result.trials.end(), better) - result.trials.begin());
  const double least_m = result.trials[result.best].stated_rms_m;
  for (std::size_t i = result.best + 1; i < result.trials.size(); ++i) {
    if (result.trials[i].fits() && result.trials[i].stated_rms_m <= Suggestion::kAsGood * least_m) {
      result.best = i;
    }
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
