// SPDX-License-Identifier: Apache-2.0
/// @file
/// Measurement noise: covariances, checked and factored.
#pragma once

#include <cmath>
#include <string>
#include <string_view>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"
#include "trammel/linalg/small_cholesky.hpp"
#include "trammel/sensor/any_sensor.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// Lower Cholesky factor L of a covariance W = L L' of `size` components (1 to 3), continued by the identity
/// to three rows, so that it whitens padded measurements. Throws Error naming `where` for another shape,
/// entries that are not finite, asymmetry, or a matrix that is not positive definite.
[[nodiscard]] inline Eigen::Matrix3d noise_factor(const Eigen::MatrixXd& covariance, Eigen::Index size,
                                                  std::string_view where) {
  // Symmetric up to the rounding of decimal files.
  constexpr double kSymmetry = 1e-9;
  const auto fail = [where](const std::string& found, const std::string& expected) {
    throw Error({std::string(where) + " covariance", found, expected});
  };
  const std::string shape = std::to_string(size) + " x " + std::to_string(size);
  if (covariance.rows() != size || covariance.cols() != size) {
    fail(std::to_string(covariance.rows()) + " x " + std::to_string(covariance.cols()) + " entries",
         shape + ", one row per component");
  }
  if (!covariance.allFinite()) {
    fail("an entry that is not finite", "finite entries");
  }
  Eigen::Matrix3d padded = Eigen::Matrix3d::Identity();
  padded.topLeftCorner(size, size) = covariance;
  const Eigen::Vector3d variance = padded.diagonal();
  if (!(variance.minCoeff() > 0.0)) {
    fail("variance " + std::to_string(variance.minCoeff()), "a positive definite matrix");
  }
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const double scale = std::sqrt(variance(i)) * std::sqrt(variance(j));
      if (!(std::abs(covariance(i, j) - covariance(j, i)) <= kSymmetry * scale)) {
        fail("entries " + std::to_string(covariance(i, j)) + " and " + std::to_string(covariance(j, i)) +
                 " in mirrored places",
             "a symmetric matrix");
      }
    }
  }
  // Factored with unit variances: positive definiteness does not depend on the units.
  const Eigen::Vector3d sigma = variance.cwiseSqrt();
  const Eigen::Vector3d inverse = sigma.cwiseInverse();
  const Eigen::Matrix3d correlation = inverse.asDiagonal() * padded * inverse.asDiagonal();
  const linalg::Cholesky3 cholesky(correlation);
  if (cholesky.info() != Eigen::Success) {
    fail("a matrix with a negative or zero eigenvalue", "a positive definite matrix");
  }
  const Eigen::Matrix3d lower = cholesky.matrixL();
  return sigma.asDiagonal() * lower;
}

}  // namespace trammel::inline TRAMMEL_ABI
