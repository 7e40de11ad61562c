// SPDX-License-Identifier: Apache-2.0
/// @file
/// Linear plants with a delay, which of their coefficients are unknown, and their description by the first
/// numbers of the impulse response.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// y_t + a_1 y_{t-1} + ... + a_na y_{t-na} = b_l u_{t-l} + ... + b_nb u_{t-nb} + v_t, v_t arbitrary
/// (Amelin 2013, eq. (1)).
struct Plant {
  Eigen::VectorXd a;  ///< a_1 ... a_na
  Eigen::VectorXd b;  ///< b_l ... b_nb, at least one
  int delay = 1;      ///< l, samples, at least 1
};

/// A plant of which some coefficients are known (a value) and the others are to be estimated (no value).
/// The unknown ones form the parameter vector p: first those of a, then those of b, in order of their index.
struct PlantModel {
  std::vector<std::optional<double>> a;  ///< a_1 ... a_na
  std::vector<std::optional<double>> b;  ///< b_l ... b_nb, at least one
  int delay = 1;                         ///< l, samples, at least 1
};

/// Throws Error unless the delay is at least 1, b is not empty, and every number is finite.
void validate(const Plant& plant);
/// As above; also at least one coefficient must be unknown.
void validate(const PlantModel& model);

/// Number of unknown coefficients.
[[nodiscard]] Eigen::Index unknown_count(const PlantModel& model);
/// Their names in the order of p: "a1", "b2", ... with the index of the coefficient.
[[nodiscard]] std::vector<std::string> unknown_names(const PlantModel& model);
/// The plant with the values `p` (unknown_count(model)) in the unknown places.
[[nodiscard]] Plant complete(const PlantModel& model, const Eigen::VectorXd& p);
/// The coefficients of `plant` in the unknown places of `model`; Error if the orders differ.
[[nodiscard]] Eigen::VectorXd unknown_of(const PlantModel& model, const Plant& plant);

/// theta, `size` numbers: theta_i = h_{l+i-1}, the impulse response of B/A from its first sample on
/// (theta = A^-1 B with A lower-triangular Toeplitz).
[[nodiscard]] Eigen::VectorXd impulse_parameters(const Plant& plant, int size);

/// Unknown coefficients from impulse parameters.
struct PlantFromImpulse {
  Eigen::VectorXd parameters;  ///< p; NaN where the equations are singular
  /// Ratio of the largest to the smallest singular value of the linear equations for p; infinite where they
  /// are singular to working precision. With every coefficient unknown they are regular exactly if
  /// z^na A(1/z) and z^nb B(1/z) have no common zero.
  double condition = 0.0;
  double determinant = 0.0;  ///< of the equations where they are square, NaN otherwise
};

/// Inverse of impulse_parameters for any choice of unknown coefficients: the linear equations, i = 1 ... s,
///   sum_{unknown a_j, j<i} a_j theta_{i-j} - [b_{l+i-1} unknown] b_{l+i-1}
///     = -theta_i - sum_{known a_j, j<i} a_j theta_{i-j} + [known] b_{l+i-1},
/// in the sense of least squares where there are more equations than unknowns.
/// Error where theta has fewer numbers than p.
[[nodiscard]] PlantFromImpulse plant_from_impulse(const PlantModel& model, const Eigen::VectorXd& theta);

}  // namespace trammel::inline TRAMMEL_ABI::region

#ifndef TRAMMEL_COMPILED
#include "trammel/region/plant_impl.hpp"
#endif
