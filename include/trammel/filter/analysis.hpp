// SPDX-License-Identifier: Apache-2.0
/// @file
/// What a designed filter does: poles, stability, astatism, steady errors, noise, worst-case bias.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/filter/design.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

/// State-space form of 1/P in differences: the state holds s_j = d^j / P(d) g, j = 0..n-1, scaled by powers
/// of the filter's bandwidth, so that all entries are of one size even for filters with a long memory.
///
///   s_j(n) = s_n(n) + sum_{l >= j} s_l(n-1),   s_n(n) = g(n) - sum_l (p_0 + ... + p_l) s_l(n-1).
class DeltaRealisation {
 public:
  explicit DeltaRealisation(const Polynomial& denominator_d);

  /// Degree n of P.
  [[nodiscard]] Eigen::Index states() const { return input_.size() - 1; }
  /// Coefficients of the numerator N(d), degree at most n, in scaled coordinates: value = row . (s_0..s_n).
  [[nodiscard]] Eigen::VectorXd output_row(const Polynomial& numerator_d) const;
  /// (n + 1) x n: s_0..s_n now from s_0..s_{n-1} before.
  [[nodiscard]] const Eigen::MatrixXd& transition() const { return transition_; }
  /// (n + 1): effect of the measurement.
  [[nodiscard]] const Eigen::VectorXd& input() const { return input_; }
  /// Covariance of (s_0..s_n) for measurements of unit variance (doubling); P must be stable.
  [[nodiscard]] Eigen::MatrixXd covariance() const;
  /// First `count` values of N/P for a unit pulse.
  [[nodiscard]] Eigen::VectorXd impulse_response(const Polynomial& numerator_d, int count) const;
  /// Smallest power of two N with |A^N| at most 1e-18: what comes after N samples is rounding error.
  [[nodiscard]] int memory() const;

 private:
  double scale_ = 1.0;
  Eigen::MatrixXd transition_;
  Eigen::VectorXd input_;
};

/// Analysis of one design. Rows as in the design; what is meaningless for an unstable filter is NaN.
///
/// | field                         | shape       | meaning, unit |
/// |-------------------------------|-------------|-----------------------------------------------------------|
/// | error_coefficients            | k x (v + 2) | e_i(t) = sum_p eps_(i,p) x^(p)(t) in steady state, s^(p-i)
/// | | prediction_error_coefficients | v + 2       | the same for the predicted coordinate, s^p | |
/// covariance                    | k x k       | of the estimates for unit measurement variance, s^-(i+j)  |
/// | astatism                      | k           | power of the first derivative of x that leaves an error |
struct FilterAnalysis {
  Eigen::VectorXcd poles;  ///< in z; for information, multiple poles are inaccurate
  bool stable = false;     ///< Schur-Cohn criterion
  std::vector<int> astatism;
  int prediction_astatism = 0;
  Eigen::MatrixXd error_coefficients;
  Eigen::VectorXd prediction_error_coefficients;
  Eigen::MatrixXd covariance;
  double prediction_noise_gain = 0.0;  ///< variance of the predicted coordinate, unit measurement variance
  double innovation_variance = 0.0;    ///< 1 + prediction_noise_gain
};

/// Analyses a design. Steady errors: the operator (ln(1/q)/T)^i - N_i/P expanded in d and then in powers of
/// d/dt through d = 1 - exp(-T d/dt). Astatism larger than v + 1 is reported as v + 2. In
/// FilterMode::kDifferences rows i > 0 are compared with the derivative itself, so their bias shows.
/// Cost: O(n^3 log of the memory) for n poles.
[[nodiscard]] FilterAnalysis analyse(const FilterDesign& design);

/// Response of row i of the estimates to `input`, from zero state.
[[nodiscard]] Eigen::VectorXd response(const FilterDesign& design, int row, const Eigen::VectorXd& input);

/// Response of the predicted coordinate (made from data before each sample) to `input`, from zero state.
[[nodiscard]] Eigen::VectorXd prediction_response(const FilterDesign& design, const Eigen::VectorXd& input);

}  // namespace trammel::inline TRAMMEL_ABI::filter

#ifndef TRAMMEL_COMPILED
#include "trammel/filter/analysis_impl.hpp"
#endif
