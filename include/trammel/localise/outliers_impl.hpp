// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of outliers.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/localise/interior_motion.hpp"
#include "trammel/localise/locate_impl.hpp"
#include "trammel/localise/outliers.hpp"
#include "trammel/localise/stated_value_impl.hpp"
#include "trammel/problem/noise.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

namespace detail {

/// q with 2 Q(q) = probability, Q the tail of the normal distribution: bisection.
inline double two_sided_quantile(double probability) {
  double low = 0.0;
  double high = 40.0;  // 2 Q(40) < 1e-300
  constexpr int kHalvings = 60;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (low + high) / 2;
    (std::erfc(middle / std::numbers::sqrt2) > probability ? low : high) = middle;
  }
  return high;
}

/// The scenario with the weights w_k of its observations: covariances divided by w_k, those of weight 0 left
/// out.
inline Scenario weighted(const Scenario& scenario, const std::vector<double>& weights) {
  Scenario result = scenario;
  result.observations.clear();
  for (std::size_t k = 0; k < weights.size(); ++k) {
    if (weights[k] == 0.0) {
      continue;
    }
    Measurement m = scenario.observations[k];
    if (weights[k] != 1.0) {
      const Eigen::MatrixXd& W = m.covariance ? *m.covariance : scenario.stations[m.station].covariance;
      m.covariance = Eigen::MatrixXd(W / weights[k]);
    }
    result.observations.push_back(std::move(m));
  }
  return result;
}

/// Fits to weighted observations, in the coordinates of the problem with all of them.
class WeightedFits {
 public:
  /// `centre`: strictly inside, in the coordinates of `all`.
  WeightedFits(const FitProblem& all, const OutlierSettings& settings, Eigen::VectorXd centre)
      : all_(all), settings_(settings), centre_(std::move(centre)) {}

  /// The fit with barriers of weight `mu` from z; z itself where no observation has weight.
  [[nodiscard]] Eigen::VectorXd fit(const Eigen::VectorXd& z, const std::vector<double>& weights,
                                    double mu) const {
    const Scenario scenario = weighted(all_.scenario(), weights);
    if (scenario.observations.empty()) {
      return z;
    }
    const FitProblem problem(scenario, settings_.minimum_height_m);
    const MotionCoordinates& here = problem.trajectory().coordinates;
    const MotionCoordinates& there = all_.trajectory().coordinates;
    const Eigen::VectorXd start =
        problem.pull_inside(here.moved_from(there, z), kStartShare, here.moved_from(there, centre_));
    return there.moved_from(here, settings_.minimise(problem, start, mu, settings_.fit).z);
  }

 private:
  const FitProblem& all_;
  const OutlierSettings& settings_;
  Eigen::VectorXd centre_;
};

/// Weights of the fit with truncated squares min(|r_k|^2, limit^2), found through smoother costs; z follows.
inline std::vector<double> truncated_fit(const FitProblem& problem, const WeightedFits& fits, double limit,
                                         Eigen::VectorXd& z) {
  constexpr double kBarrier = 1.0;
  constexpr double kGrowth = 1.4;  // remark 5 of the source
  constexpr int kMostSteps = 200;
  const std::size_t n = problem.scenario().observations.size();
  std::vector<double> weights(n, 1.0);
  for (const double mu : {30.0, 3.0, kBarrier}) {
    z = fits.fit(z, weights, mu);
  }
  const auto squares = [&] {
    const Eigen::VectorXd r = problem.residuals(z);
    return Eigen::VectorXd(r.reshaped(3, r.size() / 3).colwise().squaredNorm().transpose());
  };
  Eigen::VectorXd square = squares();
  const double c2 = limit * limit;
  const double excess = 2 * square.maxCoeff() / c2 - 1;
  if (excess <= 1.0) {
    return weights;  // every residual is within the limit
  }
  double convexity = 1 / excess;
  for (int step = 0; step < kMostSteps; ++step, convexity *= kGrowth) {
    bool decided = true;
    for (std::size_t k = 0; k < n; ++k) {
      const double ratio = square(static_cast<Eigen::Index>(k)) / c2;
      if (ratio >= (convexity + 1) / convexity) {
        weights[k] = 0.0;
      } else if (ratio <= convexity / (convexity + 1)) {
        weights[k] = 1.0;
      } else {
        weights[k] = std::sqrt(convexity * (convexity + 1) / ratio) - convexity;
        decided = false;
      }
    }
    z = fits.fit(z, weights, kBarrier);
    if (decided) {
      break;
    }
    square = squares();
  }
  return weights;
}

/// Prediction of every measurement from the accepted others, and its worst case.
struct Prediction {
  std::vector<Eigen::VectorXd> residual;
  std::vector<Eigen::VectorXd> allowed;  ///< empty: not bounded

  [[nodiscard]] double excess(std::size_t k) const {
    return allowed[k].size() == 0 ? 0.0 : residual[k].cwiseAbs().cwiseQuotient(allowed[k]).maxCoeff();
  }
};

inline Prediction predict(const FitProblem& problem, const std::vector<bool>& accepted,
                          const Eigen::VectorXd& z, double quantile, const ModelError& model) {
  const Scenario& scenario = problem.scenario();
  const std::size_t n = scenario.observations.size();
  Prediction result{std::vector<Eigen::VectorXd>(n), std::vector<Eigen::VectorXd>(n)};
  Eigen::MatrixXd A;
  const Eigen::VectorXd y = problem.residuals(z, &A) + A * z;
  const auto rows = [&A](std::size_t k) { return A.middleRows<3>(3 * static_cast<Eigen::Index>(k)); };
  Eigen::MatrixXd A_accepted = A;
  for (std::size_t k = 0; k < n; ++k) {
    if (!accepted[k]) {
      A_accepted.middleRows<3>(3 * static_cast<Eigen::Index>(k)).setZero();
    }
  }
  const Eigen::MatrixXd gram = bound_gram(problem);
  const linalg::Cholesky H(3 * gram + A_accepted.transpose() * A_accepted);
  if (H.info() != Eigen::Success) {
    return result;
  }
  const Eigen::VectorXd estimate = H.solve(A_accepted.transpose() * y);
  // What linearising about z leaves of each measurement, in its units.
  TrajectoryProblem linear = problem.trajectory();
  linear.problem.information_factor = A_accepted;
  linear.linearised_about = linear.coordinates.spline(z);
  linear.time_offsets_s = linear.coordinates.time_offsets_s(z, scenario.stations.size());
  const Sights sights = look(scenario, linear, H.solve(Eigen::MatrixXd::Identity(z.size(), z.size())));
  std::vector<std::optional<sensor::Padded>> remainder(n);
  double together = 0.0;  // |Delta|^2
  std::vector<Eigen::Matrix3d> lower(n);
  for (std::size_t k = 0; k < n; ++k) {
    const Measurement& m = scenario.observations[k];
    const Station& station = scenario.stations[m.station];
    lower[k] = noise_factor(m.covariance ? *m.covariance : station.covariance, components(station.kind),
                            station.name);
    const Sight& sight = sights.sights[k];
    const RemainderBound bound = bound_sight(sight, model, kTubeFactor);
    if (bound.valid && bound.half_width.allFinite()) {
      remainder[k] = bound.half_width + sight.model.J_value_position.rowwise().norm() * model.position_m +
                     sight.model.J_value_velocity.rowwise().norm() * model.velocity_mps;
      if (accepted[k]) {
        const Eigen::Matrix3d inverse =
            lower[k].triangularView<Eigen::Lower>().solve(Eigen::Matrix3d::Identity());
        together += (inverse.cwiseAbs() * *remainder[k]).squaredNorm();
      }
    } else if (accepted[k]) {
      return result;  // an accepted measurement may mislead the predictions by any amount
    }
  }
  for (std::size_t k = 0; k < n; ++k) {
    if (!remainder[k]) {
      continue;
    }
    const Eigen::MatrixXd A_k = rows(k);
    Eigen::MatrixXd Y = H.solve(A_k.transpose()).transpose();
    Eigen::Vector3d v = y.segment<3>(3 * static_cast<Eigen::Index>(k)) - A_k * estimate;
    if (accepted[k]) {  // without itself: (H - A_k'A_k)^-1 by Woodbury's formula
      const Eigen::Matrix3d rest = Eigen::Matrix3d::Identity() - Y * A_k.transpose();
      const linalg::Cholesky3 own(rest);
      if (own.info() != Eigen::Success) {
        continue;  // the others do not determine it
      }
      Y = own.solve(Y);
      v = own.solve(v);
    }
    Eigen::Matrix3d noise = Y * A_k.transpose() - 3 * Y * gram * Y.transpose();  // Y J Y'
    noise = lower[k] * noise * lower[k].transpose();
    const Eigen::MatrixXd reach = lower[k] * Y;
    Eigen::Vector3d allowed = *remainder[k];
    for (const Eigen::MatrixXd& a : problem.trajectory().problem.ellipsoids) {
      allowed += 3 * (reach * a.transpose()).rowwise().norm();
    }
    const Eigen::Vector3d spread = noise.diagonal().cwiseMax(0.0);
    const Eigen::Vector3d own_noise = lower[k].rowwise().squaredNorm();
    allowed += quantile * (spread + own_noise).cwiseSqrt() + std::sqrt(together) * spread.cwiseSqrt();
    const Eigen::Index count = components(scenario.stations[scenario.observations[k].station].kind);
    result.residual[k] = sensor::unpadded(lower[k] * v, count);
    result.allowed[k] = sensor::unpadded(allowed, count);
  }
  return result;
}

}  // namespace detail

TRAMMEL_INLINE OutlierSearch find_outliers(const Scenario& scenario, const OutlierSettings& settings) {
  if (!(settings.false_alarm > 0.0 && settings.false_alarm < 1.0)) {
    throw Error({"false_alarm", shortest(settings.false_alarm), "a probability between 0 and 1"});
  }
  require(settings.max_rounds >= 1, "max_rounds", std::to_string(settings.max_rounds), "at least 1");
  detail::check_model_error(scenario, settings.model_error);
  const FitProblem problem(scenario, settings.minimum_height_m);
  const std::size_t n = scenario.observations.size();
  Eigen::Index values = 0;
  for (const Measurement& m : scenario.observations) {
    values += m.value.size();
  }
  OutlierSearch result;
  result.false_alarm = settings.false_alarm;
  result.quantile = detail::two_sided_quantile(settings.false_alarm / static_cast<double>(values));
  Eigen::VectorXd z = require_interior_motion(problem, settings.minimise);
  const detail::WeightedFits fits(problem, settings, z);
  const std::vector<double> first = detail::truncated_fit(problem, fits, result.quantile, z);
  std::vector<bool> accepted(n);
  std::transform(first.begin(), first.end(), accepted.begin(), [](double w) { return w > 0.5; });
  detail::Prediction prediction;
  while (!result.settled && result.rounds < settings.max_rounds) {
    ++result.rounds;
    z = fits.fit(z, std::vector<double>(accepted.begin(), accepted.end()), kStrongBarrier);
    prediction = detail::predict(problem, accepted, z, result.quantile, settings.model_error);
    double worst = 1.0;
    for (std::size_t k = 0; k < n; ++k) {
      worst = accepted[k] ? std::max(worst, prediction.excess(k)) : worst;
    }
    // The worst ones first: they may be what makes the others look wrong.
    const double limit = std::max(1.0, worst / 2);
    result.settled = true;
    for (std::size_t k = 0; k < n; ++k) {
      const bool keep = prediction.excess(k) <= (accepted[k] ? limit : 1.0);
      result.settled = result.settled && keep == accepted[k];
      accepted[k] = keep;
    }
  }
  for (std::size_t k = 0; k < n; ++k) {
    result.tested += prediction.allowed[k].size() > 0 ? 1 : 0;
    if (!accepted[k]) {
      result.rejected.push_back({.observation = k,
                                 .station = scenario.observations[k].station,
                                 .t_s = scenario.observations[k].t_s,
                                 .residual = prediction.residual[k],
                                 .allowed = prediction.allowed[k]});
    }
  }
  return result;
}

TRAMMEL_INLINE Scenario without(Scenario scenario, const OutlierSearch& outliers) {
  std::vector<Measurement> kept;
  auto next = outliers.rejected.begin();
  for (std::size_t k = 0; k < scenario.observations.size(); ++k) {
    if (next != outliers.rejected.end() && next->observation == k) {
      ++next;
    } else {
      kept.push_back(std::move(scenario.observations[k]));
    }
  }
  scenario.observations = std::move(kept);
  return scenario;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
