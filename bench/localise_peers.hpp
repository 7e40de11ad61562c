// SPDX-License-Identifier: Apache-2.0
/// @file
/// Estimators without a guarantee, on the same measurements as the guaranteed one.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>

#include "trammel/ceres/fit.hpp"
#include "trammel/filter/minimise.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/localise/stated_value.hpp"
#include "trammel/problem/noise.hpp"
#include "trammel/problem/scenario.hpp"
#include "trammel/sensor/any_sensor.hpp"

namespace trammel::study {

/// Positions at given times and the root mean square error the estimator claims over them.
struct PeerEstimate {
  std::vector<Eigen::Vector3d> positions_m;
  double sigma_m = std::numeric_limits<double>::quiet_NaN();
};

/// Positions of a deviation from the reference.
inline std::vector<Eigen::Vector3d> positions(const TrajectoryProblem& problem, const Eigen::VectorXd& z,
                                              const std::vector<double>& times_s) {
  const trajectory::QuadraticSpline<double> spline = problem.coordinates.spline(z);
  std::vector<Eigen::Vector3d> result;
  for (const double t : times_s) {
    result.emplace_back(problem.nominal.position(t) + spline.position(t));
  }
  return result;
}

/// |C (A'A)^-1/2|: the root of the trace of the best unbiased estimate's covariance over the criterion.
inline double unbiased_sigma(const Eigen::MatrixXd& information, const Eigen::MatrixXd& criterion_factor) {
  const linalg::PivotedCholesky factor(information);
  const Eigen::MatrixXd spread = factor.solve(criterion_factor.transpose());
  return std::sqrt(std::max(0.0, (criterion_factor * spread).trace()));
}

/// Estimates without bounds.
struct PeerEstimates {
  PeerEstimate gauss_markov;  ///< best linear unbiased one, linearised near the guaranteed one
  std::optional<PeerEstimate> least_squares;  ///< converged; nothing where it does not start
};

/// Both with the knots of `scenario`, whose bounds are taken away, from the spline with these knots nearest
/// to the path that the guaranteed estimate is linearised about.
inline PeerEstimates unbounded_estimates(Scenario scenario, const localise::StatedValue& stated,
                                         const std::vector<double>& times_s) {
  const Eigen::Vector3d unbounded = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  scenario.bounds = {.position_m = unbounded,
                     .velocity_mps = unbounded,
                     .acceleration_mps2 = std::vector<Eigen::Vector3d>(scenario.segments(), unbounded)};
  const localise::FitProblem problem(scenario);
  const trajectory::QuadraticSpline<double> about = stated.problem.coordinates.spline(stated.reference);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(problem.parameters(), problem.parameters());
  Eigen::VectorXd right = Eigen::VectorXd::Zero(problem.parameters());
  for (const double t : times_s) {
    const MotionCoordinates::Rows3 rows = problem.trajectory().coordinates.position_rows(t);
    normal += rows.transpose() * rows;
    right += rows.transpose() * about.position(t);
  }
  const Eigen::VectorXd start = linalg::PivotedCholesky(normal).solve(right);
  const Eigen::MatrixXd& C = problem.trajectory().problem.criterion_factor;
  const localise::Quadratic at = problem.expand(start, 0.0);
  const Eigen::VectorXd one_step = start - linalg::PivotedCholesky(at.hessian).solve(at.gradient);
  PeerEstimates result{
      .gauss_markov = {positions(problem.trajectory(), one_step, times_s), unbiased_sigma(at.hessian, C)},
      .least_squares = {}};
  const localise::Fit fit = localise::fit_ceres(problem, start, 0.0, {.max_systems = 300});
  if (std::isfinite(fit.cost)) {
    result.least_squares = PeerEstimate{positions(problem.trajectory(), fit.z, times_s),
                                        unbiased_sigma(problem.expand(fit.z, 0.0).hessian, C)};
  }
  return result;
}

/// Kalman smoother (Rauch, Tung, Striebel 1965) for a body whose derivative of order `Order` is white noise:
/// 2 nearly constant velocity, 3 nearly constant acceleration. Measurements are linearised about the
/// prediction, then about the smoothed path (iterated twice). The two intensities (horizontal, vertical)
/// maximise the likelihood of the innovations.
template <int Order>
class KalmanSmoother {
 public:
  static constexpr int kSize = 3 * Order;
  using State = Eigen::Matrix<double, kSize, 1>;
  using Covariance = Eigen::Matrix<double, kSize, kSize>;

  /// `times_s`: ascending, where the estimate is wanted. The prior is the scenario's reference and bounds at
  /// the first knot, a semi-axis being three standard deviations.
  KalmanSmoother(const Scenario& scenario, const std::vector<double>& times_s) : scenario_(scenario) {
    for (std::size_t k = 0; k < scenario.observations.size(); ++k) {
      steps_.push_back({.t_s = scenario.observations[k].t_s, .measurement = static_cast<int>(k)});
    }
    for (std::size_t k = 0; k < times_s.size(); ++k) {
      steps_.push_back({.t_s = times_s[k], .output = static_cast<int>(k)});
    }
    std::stable_sort(steps_.begin(), steps_.end(),
                     [](const Step& a, const Step& b) { return a.t_s < b.t_s; });
    for (const Station& station : scenario.stations) {
      noise_.push_back(noise_factor(station.covariance, components(station.kind), station.name));
    }
    first_.setZero();
    first_.template head<3>() = scenario.nominal.position_m;
    first_.template segment<3>(3) = scenario.nominal.velocity_mps;
    constexpr double kSigmas = 3.0;
    State spread;
    spread.template head<3>() = scenario.bounds.position_m / kSigmas;
    spread.template segment<3>(3) = scenario.bounds.velocity_mps / kSigmas;
    if constexpr (Order == 3) {
      spread.template tail<3>() = scenario.bounds.acceleration_mps2.front() / kSigmas;
    }
    first_covariance_ = spread.cwiseAbs2().asDiagonal();
  }

  [[nodiscard]] PeerEstimate run() {
    Eigen::Vector2d log_intensity = Eigen::Vector2d::Zero();
    constexpr int kSweeps = 2;
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      for (Eigen::Index i = 0; i < 2; ++i) {
        log_intensity(i) = maximise(log_intensity, i);
      }
    }
    const Eigen::Vector2d intensity = log_intensity.array().exp();
    about_.clear();
    constexpr int kIterations = 2;
    for (int i = 0; i <= kIterations; ++i) {
      filter(intensity, true);
      smooth();
    }
    PeerEstimate result;
    double sum = 0.0;
    for (std::size_t k = 0; k < steps_.size(); ++k) {
      if (steps_[k].output >= 0) {
        result.positions_m.emplace_back(smoothed_[k].template head<3>());
        sum += smoothed_covariance_[k].template topLeftCorner<3, 3>().trace();
      }
    }
    result.sigma_m = std::sqrt(sum / static_cast<double>(result.positions_m.size()));
    return result;
  }

 private:
  struct Step {
    double t_s = 0.0;
    int measurement = -1;
    int output = -1;
  };

  /// x(t + T) = transition x(t) + noise, per axis; the noise's covariance for unit intensity.
  static void model(double T, const Eigen::Vector2d& intensity, Covariance& transition, Covariance& noise) {
    Eigen::Matrix<double, Order, Order> phi = Eigen::Matrix<double, Order, Order>::Identity();
    Eigen::Matrix<double, Order, Order> q;
    double factorial[] = {1, 1, 2, 6};
    for (int i = 0; i < Order; ++i) {
      for (int j = 0; j < Order; ++j) {
        if (j > i) {
          phi(i, j) = std::pow(T, j - i) / factorial[j - i];
        }
        const int a = Order - 1 - i;
        const int b = Order - 1 - j;
        q(i, j) = std::pow(T, a + b + 1) / ((a + b + 1) * factorial[a] * factorial[b]);
      }
    }
    transition.setZero();
    noise.setZero();
    for (int i = 0; i < Order; ++i) {
      for (int j = 0; j < Order; ++j) {
        for (int axis = 0; axis < 3; ++axis) {
          transition(3 * i + axis, 3 * j + axis) = phi(i, j);
          noise(3 * i + axis, 3 * j + axis) = intensity(axis == 2 ? 1 : 0) * q(i, j);
        }
      }
    }
  }

  /// Returns the log likelihood; keeps what the smoother needs if `keep`.
  double filter(const Eigen::Vector2d& intensity, bool keep) {
    State x = first_;
    Covariance P = first_covariance_;
    double t = scenario_.knots_s.front();
    double likelihood = 0.0;
    if (keep) {
      filtered_.clear();
      filtered_covariance_.clear();
      predicted_.clear();
      predicted_covariance_.clear();
      transitions_.clear();
    }
    for (std::size_t k = 0; k < steps_.size(); ++k) {
      Covariance transition;
      Covariance noise;
      model(steps_[k].t_s - t, intensity, transition, noise);
      t = steps_[k].t_s;
      x = transition * x;
      P = Covariance(transition * P * transition.transpose() + noise);
      if (keep) {
        transitions_.push_back(transition);
        predicted_.push_back(x);
        predicted_covariance_.push_back(P);
      }
      if (steps_[k].measurement >= 0) {
        likelihood += update(k, x, P);
      }
      if (keep) {
        filtered_.push_back(x);
        filtered_covariance_.push_back(P);
      }
    }
    return likelihood;
  }

  double update(std::size_t k, State& x, Covariance& P) const {
    const Measurement& m = scenario_.observations[static_cast<std::size_t>(steps_[k].measurement)];
    const Station& station = scenario_.stations[m.station];
    const auto count = static_cast<Eigen::Index>(components(station.kind));
    const State& about = about_.empty() ? x : about_[k];
    const Eigen::Vector3d place = about.template head<3>() - station.position_m;
    const sensor::Linearised at = sensor::linearise(station.kind, place, about.template segment<3>(3));
    Eigen::Matrix<double, 3, kSize> H = Eigen::Matrix<double, 3, kSize>::Zero();
    H.template leftCols<3>() = at.J_value_position;
    H.template middleCols<3>(3) = at.J_value_velocity;
    Eigen::Vector3d r = sensor::difference(station.kind, sensor::padded(m.value), at.value) - H * (x - about);
    const auto whiten = noise_[m.station].template triangularView<Eigen::Lower>();
    whiten.solveInPlace(H);
    whiten.solveInPlace(r);
    const Eigen::Matrix3d S = Eigen::Matrix3d::Identity() + H * P * H.transpose();
    const Eigen::Matrix<double, kSize, 3> K = P * H.transpose() * S.inverse();
    double log_likelihood = -r.dot(S.inverse() * r) / 2 - std::log(S.determinant()) / 2;
    x += K * r;
    const Covariance keep = Covariance::Identity() - K * H;
    P = Covariance(keep * P * keep.transpose() + K * K.transpose());
    static_cast<void>(count);  // padded components have no derivative and no residual
    return log_likelihood;
  }

  void smooth() {
    smoothed_ = filtered_;
    smoothed_covariance_ = filtered_covariance_;
    for (std::size_t k = steps_.size() - 1; k-- > 0;) {
      const Covariance& next = predicted_covariance_[k + 1];
      const Covariance gain =
          Eigen::LDLT<Covariance>(next).solve(transitions_[k + 1] * filtered_covariance_[k]).transpose();
      smoothed_[k] += gain * (smoothed_[k + 1] - predicted_[k + 1]);
      smoothed_covariance_[k] += gain * (smoothed_covariance_[k + 1] - next) * gain.transpose();
    }
    about_ = smoothed_;
  }

  /// Golden section over one logarithm of an intensity.
  double maximise(Eigen::Vector2d at, Eigen::Index i) {
    const auto unlikelihood = [&](double x) {
      at(i) = x;
      const double likelihood = filter(at.array().exp(), false);
      return std::isfinite(likelihood) ? -likelihood : std::numeric_limits<double>::infinity();
    };
    constexpr double kWidth = 1.2e-3;  // of 20: 2 % of the intensity
    return filter::minimise(unlikelihood, -12.0, 8.0, kWidth).point(0);
  }

  const Scenario& scenario_;
  std::vector<Step> steps_;
  std::vector<Eigen::Matrix3d> noise_;
  State first_;
  Covariance first_covariance_;
  std::vector<State> about_, predicted_, filtered_, smoothed_;
  std::vector<Covariance> predicted_covariance_, filtered_covariance_, smoothed_covariance_, transitions_;
};

}  // namespace trammel::study
