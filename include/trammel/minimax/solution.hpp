// SPDX-License-Identifier: Apache-2.0
/// @file
/// Settings and result of the solvers of the guaranteed problem.
#pragma once

#include <concepts>
#include <limits>
#include <string_view>
#include <type_traits>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/settings.hpp"
#include "trammel/core/status.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

/// Settings common to all methods.
struct SolverSettings {
  double relative_gap = 1e-8;  ///< stop when (upper - lower)/upper is at most this
  int max_iterations = 200;    ///< of the outer iteration
  int threads = 1;  ///< of Newton's method in the multipliers, for large problems; 0: all there are
};

template <class Settings, class Visitor>
requires std::same_as<std::remove_const_t<Settings>, SolverSettings>
void visit_fields(Settings& settings, Visitor&& visit) {
  visit(FieldDoc{.name = "relative_gap",
                 .unit = "",
                 .meaning =
                     "stop when (upper - lower)/upper of the squared error is at most this; smaller than "
                     "1e-12 is beyond double precision",
                 .minimum = 0.0,
                 .maximum = 1.0},
        settings.relative_gap);
  visit(FieldDoc{.name = "max_iterations",
                 .unit = "",
                 .meaning = "iterations after which the best certified interval so far is returned",
                 .minimum = 1.0,
                 .maximum = 1e9},
        settings.max_iterations);
  visit(FieldDoc{.name = "threads",
                 .unit = "",
                 .meaning = "threads for large products, the same result for any number; 0: as many as the "
                            "machine has; more than one pays from about 300 parameters on",
                 .minimum = 0.0,
                 .maximum = 1e4},
        settings.threads);
}

/// The barrier parameter stops where the gap (parameters + ellipsoids) * mu is this share of the gap asked
/// for: the rest is room for the inflation of the multipliers.
inline constexpr double kGapShare = 0.2;

/// The algorithm that produced a solution.
enum class Method {
  kNewtonMultipliers,  ///< Newton's method in the multipliers alone (applies to well observed motions)
  kInteriorPoint,      ///< structured primal-dual interior point
  kSemidefinite,       ///< the linear matrix inequality through the general solver
  kConditionalGradient,
  kWindows,  ///< overlapping windows of a long flight (window::solve_windows)
};

[[nodiscard]] constexpr std::string_view to_string(Method method) noexcept {
  switch (method) {
    case Method::kNewtonMultipliers:
      return "newton_multipliers";
    case Method::kInteriorPoint:
      return "interior_point";
    case Method::kSemidefinite:
      return "semidefinite";
    case Method::kConditionalGradient:
      return "conditional_gradient";
    case Method::kWindows:
      break;
  }
  return "windows";
}

/// Answer to a GuaranteedProblem. p parameters, s ellipsoids; all in the problem's own coordinates.
///
/// | symbol | field        | shape | meaning                                                               |
/// |--------|--------------|-------|-----------------------------------------------------------------------|
/// | -      | upper        | -     | the mean-square error of K never exceeds it within the bounds         |
/// | -      | lower        | -     | no linear estimator guarantees less                                   |
/// | lambda | multipliers  | s     | H(lambda) >= (KJ-I)'S(KJ-I); upper = tr S K J K' + sum lambda         |
/// | V      | prior_factor | p x k | V = L L', <H_l, V> <= 1: least favourable; lower = tr S (V^-1 + J)^-1 |
/// | K      | gain         | p x p | estimate theta = K F' y                                               |
struct Solution {
  SolveStatus status = SolveStatus::kNumericalTrouble;
  Claim claim = Claim::kNone;
  Method method = Method::kInteriorPoint;
  double upper = std::numeric_limits<double>::quiet_NaN();
  double lower = std::numeric_limits<double>::quiet_NaN();
  Eigen::VectorXd multipliers;
  Eigen::MatrixXd gain;
  Eigen::MatrixXd prior_factor;
  /// Where status is kUnbounded: directions theta (columns) that C sees and neither F nor any a_l limits.
  Eigen::MatrixXd unbounded_directions;
  int iterations = 0;
  int inner_iterations = 0;  ///< conjugate-gradient steps in all (0 where none are taken)
  double solve_time_s = std::numeric_limits<double>::quiet_NaN();

  /// (upper - lower)/upper; 0 when both are 0.
  [[nodiscard]] double relative_gap() const { return upper == lower ? 0.0 : (upper - lower) / upper; }
};

}  // namespace trammel::inline TRAMMEL_ABI::minimax
