// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of prediction.hpp.
#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/linalg/svd.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/region/prediction.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

namespace detail {

TRAMMEL_INLINE double spectral_norm(const Eigen::MatrixXd& matrix) {
  return linalg::Svd(matrix).singularValues()(0);
}

TRAMMEL_INLINE void require_number(double value, double least, const char* name) {
  require(value >= least && std::isfinite(value), [&] {
    return ErrorDetail{std::string("PredictionProblem.") + name, std::to_string(value),
                       "a finite number, at least " + std::to_string(least)};
  });
}

TRAMMEL_INLINE void require_valid(const PredictionProblem& problem) {
  require(problem.r >= 1, [&] {
    return ErrorDetail{"PredictionProblem.r", std::to_string(problem.r), "at least 1"};
  });
  require_number(problem.sigma_w, 0.0, "sigma_w");
  require_number(problem.norm_a, 0.0, "norm_a");
  require(problem.norm_a <= 1.0 + 1e-12, [&] {
    return ErrorDetail{"PredictionProblem.norm_a", std::to_string(problem.norm_a), "at most 1"};
  });
  require(problem.lambda_min > 0.0, [&] {
    return ErrorDetail{"PredictionProblem.lambda_min", std::to_string(problem.lambda_min),
                       "a positive number"};
  });
  require_number(problem.norm_gamma, 0.0, "norm_gamma");
  require_number(problem.norm_a_gamma, 0.0, "norm_a_gamma");
  require_number(problem.m4_4, 0.0, "m4_4");
  require_number(problem.m_phi, 0.0, "m_phi");
  require_number(problem.trace_b, 0.0, "trace_b");
  require_number(problem.c_v, 0.0, "c_v");
}

/// M_4^4 + (M_phi^2 + M_phi / rho) tr B.
TRAMMEL_INLINE double second_order(const PredictionProblem& problem, double rho) {
  const double mean = problem.m_phi > 0.0 ? problem.m_phi * problem.m_phi + problem.m_phi / rho : 0.0;
  return problem.norm_gamma * problem.norm_gamma * (problem.m4_4 + mean * problem.trace_b);
}

/// (1 + M_phi rho) |A Gamma|^2 tr B C_v^2.
TRAMMEL_INLINE double noise_factor(const PredictionProblem& problem, double rho) {
  const double mean = problem.m_phi > 0.0 ? 1.0 + problem.m_phi * rho : 1.0;
  return mean * problem.norm_a_gamma * problem.norm_a_gamma * problem.trace_b * problem.c_v * problem.c_v;
}

}  // namespace detail

TRAMMEL_INLINE void validate(const PredictionSettings& settings) {
  const Eigen::MatrixXd& a = settings.transition;
  const Eigen::MatrixXd& gamma = settings.gain;
  require(a.rows() >= 1 && a.rows() == a.cols(), [&] {
    return ErrorDetail{"PredictionSettings.transition",
                       std::to_string(a.rows()) + " x " + std::to_string(a.cols()), "a square matrix"};
  });
  require(gamma.rows() == a.rows() && gamma.cols() == a.cols(), [&] {
    return ErrorDetail{"PredictionSettings.gain",
                       std::to_string(gamma.rows()) + " x " + std::to_string(gamma.cols()),
                       "the shape of the transition"};
  });
  require(a.allFinite() && detail::spectral_norm(a) <= 1.0 + 1e-12, "PredictionSettings.transition",
          "a norm above 1", "a matrix of norm at most 1");
  require(gamma.allFinite() && gamma.isApprox(gamma.transpose(), 1e-12) &&
              linalg::SymmetricEigen(gamma).eigenvalues()(0) > 0.0,
          "PredictionSettings.gain", "a matrix that is not symmetric positive definite",
          "a symmetric positive definite one");
  require(settings.step > 0.0 && std::isfinite(settings.step), [&] {
    return ErrorDetail{"PredictionSettings.step", shortest(settings.step), "a positive number"};
  });
  require(settings.centring >= 0.0 && settings.centring <= 1.0, [&] {
    return ErrorDetail{"PredictionSettings.centring", shortest(settings.centring), "0 to 1"};
  });
}

TRAMMEL_INLINE double predict_step(const PredictionSettings& settings, const Eigen::VectorXd& regressor,
                                   const Eigen::VectorXd& probe, double y, RandomisedPrediction& state) {
  const double error = regressor.dot(state.theta) - y;
  const double residual = error + state.centre;
  state.theta = settings.transition * (state.theta - settings.step * residual * (settings.gain * probe));
  state.centre -= settings.centring * residual;
  return residual;
}

TRAMMEL_INLINE PredictionProblem prediction_problem(const Eigen::MatrixXd& transition,
                                                    const Eigen::MatrixXd& gain,
                                                    const Eigen::MatrixXd& probe_covariance, double sigma_w,
                                                    double m4_4, double m_phi, double c_v) {
  validate(PredictionSettings{.transition = transition, .gain = gain, .step = 1.0, .centring = 0.0});
  require(probe_covariance.rows() == gain.rows() && probe_covariance.cols() == gain.cols(), [&] {
    return ErrorDetail{
        "prediction_problem: probe_covariance",
        std::to_string(probe_covariance.rows()) + " x " + std::to_string(probe_covariance.cols()),
        "the shape of the gain"};
  });
  const Eigen::MatrixXd product = probe_covariance * gain;
  PredictionProblem problem;
  problem.r = static_cast<int>(gain.rows());
  problem.sigma_w = sigma_w;
  problem.norm_a = detail::spectral_norm(transition);
  problem.lambda_min = linalg::SymmetricEigen((product + product.transpose()) / 2.0).eigenvalues()(0);
  problem.norm_gamma = detail::spectral_norm(gain);
  problem.norm_a_gamma = detail::spectral_norm(transition * gain);
  problem.m4_4 = m4_4;
  problem.m_phi = m_phi;
  problem.trace_b = probe_covariance.trace();
  problem.c_v = c_v;
  detail::require_valid(problem);
  return problem;
}

TRAMMEL_INLINE double PredictionBound::at(int t, double initial_square) const {
  return limit + std::pow(contraction, t) * initial_square;
}

TRAMMEL_INLINE PredictionBound prediction_error_bound(const PredictionProblem& problem, double alpha,
                                                      double rho) {
  detail::require_valid(problem);
  require(alpha > 0.0, [&] {
    return ErrorDetail{"prediction_error_bound: alpha", std::to_string(alpha), "a positive number"};
  });
  require(rho > 0.0 || problem.m_phi == 0.0, [&] {
    return ErrorDetail{"prediction_error_bound: rho", std::to_string(rho), "a positive number"};
  });
  PredictionBound bound;
  bound.contraction =
      (1.0 - 2.0 * alpha * problem.lambda_min + alpha * alpha * detail::second_order(problem, rho)) *
      problem.norm_a * problem.norm_a;
  const double numerator =
      problem.r * problem.sigma_w * problem.sigma_w + alpha * alpha * detail::noise_factor(problem, rho);
  bound.limit = bound.contraction < 1.0 ? numerator / (1.0 - bound.contraction)
                                        : std::numeric_limits<double>::infinity();
  return bound;
}

TRAMMEL_INLINE BestStep best_step(const PredictionProblem& problem, double rho) {
  detail::require_valid(problem);
  require(rho > 0.0 || problem.m_phi == 0.0, [&] {
    return ErrorDetail{"best_step: rho", std::to_string(rho), "a positive number"};
  });
  const double c = problem.norm_a * problem.norm_a;
  const double p = problem.r * problem.sigma_w * problem.sigma_w;
  const double q = detail::noise_factor(problem, rho);
  const double k1 = 2.0 * c * problem.lambda_min;
  const double k2 = c * detail::second_order(problem, rho);
  require(p > 0.0 && c > 0.0, [&] {
    return ErrorDetail{"best_step: problem.sigma_w or problem.norm_a",
                       std::to_string(problem.sigma_w) + " and " + std::to_string(problem.norm_a),
                       "positive numbers: without drift the best step is 0"};
  });
  const double h = q * (1.0 - c) + p * k2;
  BestStep best;
  best.rho = problem.m_phi > 0.0 ? rho : std::numeric_limits<double>::quiet_NaN();
  best.alpha = p * k1 / (h + std::sqrt(h * h + p * q * k1 * k1));
  best.limit = prediction_error_bound(problem, best.alpha, rho).limit;
  return best;
}

TRAMMEL_INLINE BestStep best_step(const PredictionProblem& problem) {
  if (!(problem.m_phi > 0.0)) {
    return best_step(problem, 1.0);
  }
  constexpr double kRange = 25.0;  // ln rho from e^-25 to e^25
  const double golden = (std::sqrt(5.0) - 1.0) / 2.0;
  const auto value = [&](double log_rho) { return best_step(problem, std::exp(log_rho)).limit; };
  double low = -kRange;
  double high = kRange;
  double inner_low = high - golden * (high - low);
  double inner_high = low + golden * (high - low);
  double value_low = value(inner_low);
  double value_high = value(inner_high);
  constexpr int kSteps = 80;  // the interval shrinks below 1e-14 of its length
  for (int step = 0; step < kSteps; ++step) {
    if (value_low < value_high) {
      high = inner_high;
      inner_high = inner_low;
      value_high = value_low;
      inner_low = high - golden * (high - low);
      value_low = value(inner_low);
    } else {
      low = inner_low;
      inner_low = inner_high;
      value_low = value_high;
      inner_high = low + golden * (high - low);
      value_high = value(inner_high);
    }
  }
  return best_step(problem, std::exp((low + high) / 2.0));
}

}  // namespace trammel::inline TRAMMEL_ABI::region
