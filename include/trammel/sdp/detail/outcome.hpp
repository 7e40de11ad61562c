// SPDX-License-Identifier: Apache-2.0
/// @file
/// The interior-point iteration in each precision, compiled apart.
#pragma once

#include <limits>

#include <Eigen/Core>

#include "trammel/core/progress.hpp"
#include "trammel/sdp/detail/model.hpp"
#include "trammel/sdp/solution.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp::detail {

/// An iterate in the model's own parts; empty where there is none.
struct Start {
  Eigen::VectorXd x;
  Parts slack;
  Parts multiplier;
};

/// What the iteration leaves.
struct Outcome {
  Status status = Status::kNumericalTrouble;
  Start best;
  Start sound;  ///< the last iterate that rounding errors had not touched much
  double ray_violation = std::numeric_limits<double>::quiet_NaN();
  int iterations = 0;
  bool sparse_schur = false;
  double assembly_s = 0.0;
  double factor_s = 0.0;
};

[[nodiscard]] Outcome run_double(const Model& model, const Settings& settings,
                                 const ProgressObserver& observe);
[[nodiscard]] Outcome run_double_double(const Model& model, const Settings& settings,
                                        const ProgressObserver& observe, const Start& start);

}  // namespace trammel::inline TRAMMEL_ABI::sdp::detail

#ifndef TRAMMEL_COMPILED
#include "trammel/sdp/detail/run_double_double_impl.hpp"
#include "trammel/sdp/detail/run_double_impl.hpp"
#endif
