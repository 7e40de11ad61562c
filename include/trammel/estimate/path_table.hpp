// SPDX-License-Identifier: Apache-2.0
/// @file
/// A path as results list it.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

/// A path on a time grid.
struct PathTable {
  std::vector<double> times_s;
  Eigen::MatrixXd position_m;    ///< n x 3
  Eigen::MatrixXd velocity_mps;  ///< n x 3
};

}  // namespace trammel::inline TRAMMEL_ABI::estimate
