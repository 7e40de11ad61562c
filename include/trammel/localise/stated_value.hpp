// SPDX-License-Identifier: Apache-2.0
/// @file
/// One guaranteed estimate about a reference, and what the measurements' curvature adds to its guarantee.
#pragma once

#include <limits>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "trammel/certify/certificate.hpp"
#include "trammel/core/config.hpp"
#include "trammel/localise/fit_problem.hpp"
#include "trammel/minimax/methods.hpp"
#include "trammel/problem/assemble.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

/// How far the true motion may be from the nearest spline of the class.
struct ModelError {
  enum class Kind {
    kBox,        ///< at every time at most position_m (and velocity_mps)
    kEllipsoid,  ///< in root mean square over the measurements and over the criterion
  };
  Kind kind = Kind::kEllipsoid;
  double position_m = 0.0;
  double velocity_mps = 0.0;  ///< matters where range rates are measured
};

/// For a jerk of at most `jerk_mps3` (m/s^3) and equal segments of `segment_s`: position error j T^3/24
/// (Favard's constant for quadratic splines with equally spaced knots on the whole line). The velocity error
/// 15/32 j T^2 follows from it on one segment: beside the quadratic through three Chebyshev points the error
/// is at most j T^3/192 and its derivative at most 3/32 j T^2 (Shadrin 1995, error of Lagrange
/// interpolation), and the quadratic's derivative at most 8/T times its size (Markov). Says nothing about
/// whether that spline keeps the bounds on the acceleration. Throws Error unless both are finite, the jerk
/// not negative and the segment positive.
[[nodiscard]] ModelError model_error_from_jerk(double jerk_mps3, double segment_s);

/// Radius over tube: E |e|^4 <= 3 (E |e|^2)^2 for normal errors e, and 3^(1/4) = 1.316.
inline constexpr double kTubeFactor = 1.31607401295249246081921890179699;

/// What is known about a stated value.
enum class Consistency {
  kSelfConsistent,      ///< kappa <= 1/4 and the tube widened by the stated value itself settles
  kCurvatureDominated,  ///< the stated value holds within the tube given; the tube does not confirm itself
  kNoBound,             ///< a remainder could not be bounded, or there is no certified linear bound
};

/// Name as in result files.
[[nodiscard]] constexpr std::string_view to_string(Consistency consistency) noexcept {
  switch (consistency) {
    case Consistency::kSelfConsistent:
      return "self_consistent";
    case Consistency::kCurvatureDominated:
      return "curvature_dominated";
    case Consistency::kNoBound:
      break;
  }
  return "no_bound";
}

/// One guaranteed estimate linearised about a reference. NaN: not computed or not proved.
struct StatedValue {
  explicit StatedValue(TrajectoryProblem linearised) : problem(std::move(linearised)) {}

  TrajectoryProblem problem;   ///< linearised about the reference
  minimax::Solution solution;  ///< with verified bounds
  certify::Certificate certificate;
  Eigen::VectorXd reference;  ///< linearised about, in the coordinates of `problem`
  Eigen::VectorXd z;          ///< the estimate, in the coordinates of `problem`
  Consistency consistency = Consistency::kNoBound;
  double linear_guarantee_rms_m = std::numeric_limits<double>::quiet_NaN();  ///< g_lin
  double curvature_rms_m = std::numeric_limits<double>::quiet_NaN();         ///< beta
  /// No bound of the form of beta, for remainders within the same half-widths, is below it.
  double curvature_lower_rms_m = std::numeric_limits<double>::quiet_NaN();
  double model_error_rms_m = std::numeric_limits<double>::quiet_NaN();  ///< g_model
  double kappa = std::numeric_limits<double>::quiet_NaN();              ///< beta/g_lin
  double sum_rms_m = std::numeric_limits<double>::quiet_NaN();          ///< g_lin + beta + g_model
  std::optional<double> fixed_point_rms_m;                              ///< where the tube settles
  /// fixed_point_rms_m where self-consistent, sum_rms_m where dominated by curvature, else NaN.
  double stated_rms_m = std::numeric_limits<double>::quiet_NaN();
  /// tau_k per measurement: bound of the linear estimator's rms error there, times tube_widening.
  std::vector<double> tube_m;
  double tube_widening = 1.0;  ///< above 1 where the estimate lies clearly outside the tube
};

/// Solves the guaranteed problem linearised about the reference z_r and bounds what the linearisation leaves.
///
/// | symbol  | meaning                                                                          |
/// |---------|----------------------------------------------------------------------------------|
/// | K       | gain times A': estimate = K (r(z_r) + A z_r)                                     |
/// | tau_k   | ((sum_l |P B_k (K A - I) D_l|_2)^2 + |P B_k K|_F^2)^(1/2), D_l the motions of    |
/// |         | bound l at its semi-axes, P along the directions a sensor's bound asks for       |
/// | Delta_k | remainder bounds (bound_remainder) at the radii 3^(1/4) tau_k + model error      |
/// | beta    | with M = N'N, N = C K L^-1 diag(Delta):                                          |
/// |         | beta^2 = min(sum |M_kl|, n lambda_max(M)), n channels                            |
/// | g_model | the model error through K in the same way, plus the model error itself           |
///
/// What is proved: for a reference that does not depend on the noise of these measurements, for every motion
/// within the bounds whose deviation from the reference has fourth moments within the radii (in particular
/// for every motion within the radii), the root mean square error over the noise is at most
/// g_lin + beta + g_model. That the radii contain the truth is not proved; `consistency` tests it, and where
/// the estimate lies clearly farther from the reference than tau says (root mean squares over the
/// measurements) all tau_k are widened to that distance: barriers pull a reference away from data that say
/// little, such as ranges alone over many short segments, and then tau, which is the estimator's error, is
/// too small for the reference's. With the reference fitted to the same measurements the dependence is
/// neglected.
///
/// Cost: one guaranteed solve, O(n p^2) for the tube, O(n^2 p) for sum |M_kl|.
/// Throws Error for a reference outside the bounds, and for range rates beside a model error without
/// velocity_mps.
[[nodiscard]] StatedValue state(const FitProblem& fit, const Eigen::VectorXd& reference,
                                const ModelError& model_error = {},
                                const minimax::SolverSettings& solver = {},
                                const minimax::MethodChoice& method = {});

}  // namespace trammel::inline TRAMMEL_ABI::localise

#ifndef TRAMMEL_COMPILED
#include "trammel/localise/stated_value_impl.hpp"
#endif
