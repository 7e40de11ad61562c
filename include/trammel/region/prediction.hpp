// SPDX-License-Identifier: Apache-2.0
/// @file
/// Randomised one-step prediction of a drifting parameter under arbitrary measurement noise, its error bound
/// and the best step.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// State of the predictor.
struct RandomisedPrediction {
  Eigen::VectorXd theta;  ///< prediction of theta_t
  double centre = 0.0;    ///< c_t, predictable centre of the residuals; stays 0 without centring
};

/// Settings of one step.
///
/// Problem: y_t = phi_t' theta_t + v_t, theta_{t+1} = A theta_t + w_{t+1}, v_t arbitrary; the regressors
/// phi_t are drawn by the user, Delta_t = phi_t - E phi_t symmetric and independent of v_t. Method (Amelin
/// 2013, eq. (10)):
///   theta^_{t+1} = A theta^_t - alpha A Gamma Delta_t (phi_t' theta^_t - y_t + c_t),
///   c_{t+1} = c_t + g (y_t - phi_t' theta^_t - c_t),
/// with c = 0 as published (g = 0). Centring takes a slow noise out of the residuals before they multiply the
/// probe; it needs Delta_t independent of the past, and does harm where the noise jumps.
/// Guarantee: prediction_error_bound, for g = 0.
struct PredictionSettings {
  Eigen::MatrixXd transition;  ///< A, r x r, norm at most 1
  Eigen::MatrixXd gain;        ///< Gamma, r x r, symmetric positive definite
  double step = 0.0;           ///< alpha, positive
  double centring = 0.0;       ///< g, 0 (off) to 1
};

/// Throws Error on wrong shapes, norm of A above 1, Gamma not symmetric positive definite, step not positive.
void validate(const PredictionSettings& settings);

/// One step; `probe` = Delta_t = regressor - its expectation. Returns the residual phi' theta^ - y + c.
double predict_step(const PredictionSettings& settings, const Eigen::VectorXd& regressor,
                    const Eigen::VectorXd& probe, double y, RandomisedPrediction& state);

/// What the error bound knows about the problem.
///
/// | symbol     | meaning                                                      |
/// |------------|--------------------------------------------------------------|
/// | r          | number of parameters                                         |
/// | sigma_w    | trace of the drift's covariance is at most r sigma_w^2       |
/// | norm_a     | spectral norm of A                                           |
/// | lambda_min | smallest eigenvalue of (the symmetric part of) B Gamma       |
/// | norm_gamma | spectral norm of Gamma                                       |
/// | norm_a_gamma | spectral norm of A Gamma                                   |
/// | m4_4       | bound of E |Delta|^4 (the fourth power of M_4)               |
/// | m_phi      | bound of |E phi|                                             |
/// | trace_b    | trace of B = E Delta Delta'                                  |
/// | c_v        | E v^2 is at most c_v^2                                       |
struct PredictionProblem {
  int r = 1;
  double sigma_w = 0.0;
  double norm_a = 1.0;
  double lambda_min = 1.0;
  double norm_gamma = 1.0;
  double norm_a_gamma = 1.0;
  double m4_4 = 1.0;
  double m_phi = 0.0;
  double trace_b = 1.0;
  double c_v = 0.0;
};

/// Fills the norms and eigenvalues from the matrices A, Gamma and B.
[[nodiscard]] PredictionProblem prediction_problem(const Eigen::MatrixXd& transition,
                                                   const Eigen::MatrixXd& gain,
                                                   const Eigen::MatrixXd& probe_covariance, double sigma_w,
                                                   double m4_4, double m_phi, double c_v);

/// Bound of E |theta^_t - theta_t|^2 (Amelin 2013, theorem 3 and eq. (11)).
struct PredictionBound {
  double contraction = 0.0;  ///< psi(alpha, rho), below 1 where the bound exists
  double limit = 0.0;        ///< first term of (11), for t to infinity; infinite if contraction >= 1

  /// (11) at time t for an initial squared error.
  [[nodiscard]] double at(int t, double initial_square) const;
};

/// psi = [1 - 2 alpha lambda_min + alpha^2 |Gamma|^2 (M_4^4 + (M_phi^2 + M_phi/rho) tr B)] |A|^2,
/// limit = [r sigma_w^2 + alpha^2 (1 + M_phi rho) |A Gamma|^2 tr B C_v^2] / (1 - psi), any rho > 0.
[[nodiscard]] PredictionBound prediction_error_bound(const PredictionProblem& problem, double alpha,
                                                     double rho);

/// The step that minimises `limit`.
struct BestStep {
  double alpha = 0.0;
  double rho = 1.0;  ///< NaN where it does not matter (m_phi = 0)
  double limit = 0.0;
};

/// For a given rho, in closed form: alpha = p k1 / (h + sqrt(h^2 + p q k1^2)) with p = r sigma_w^2,
/// q = (1 + M_phi rho) |A Gamma|^2 tr B C_v^2, k0 = 1 - |A|^2, k1 = 2 |A|^2 lambda_min,
/// k2 = |A|^2 |Gamma|^2 (M_4^4 + (M_phi^2 + M_phi/rho) tr B), h = q k0 + p k2.
[[nodiscard]] BestStep best_step(const PredictionProblem& problem, double rho);

/// Over rho too, by golden section in ln rho.
[[nodiscard]] BestStep best_step(const PredictionProblem& problem);

}  // namespace trammel::inline TRAMMEL_ABI::region

#ifndef TRAMMEL_COMPILED
#include "trammel/region/prediction_impl.hpp"
#endif
