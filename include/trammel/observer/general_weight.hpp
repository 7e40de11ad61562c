// SPDX-License-Identifier: Apache-2.0
/// @file
/// The optimum when the variances of y and z are weighted too: a concave dual in three variables.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/observer/closed_form.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

/// Result of solve_general_weight.
struct GeneralWeightSolution {
  PathShape shape;
  double critical = 0.0;
  double lower_bound = 0.0;  ///< largest dual value met
  int evaluations = 0;       ///< of the dual function
};

/// A point of the dual.
struct DualPoint {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  PathShape shape;
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();  ///< half of dg/dp
  double value = 0.0;                                  ///< g(p)
};

/// The dual of the general problem. With p_j = sqrt(beta_j) Gamma_1j and |p| = xi/(sigma L) the extremal path
/// is
///
///   w = Q diag(1/v_i) Q' (D22 e - c),  c = (sqrt(beta_2) p_2, sqrt(beta_3) p_3)/|p|^2,
///
/// and, with b and q of that path (see evaluate),
///
///   g(p) = 2 (sqrt(beta_1) p_1 + sqrt(beta_2) p_2 b_1 + sqrt(beta_3) p_3 b_2) - |p|^2 q + J_R
///          + beta_2 [(D22 + L)^-1]_11 + beta_3 [(D22 + L)^-1]_22,
///   dg/dp / 2 = (sqrt(beta_1), sqrt(beta_2) b_1, sqrt(beta_3) b_2) - q p.
///
/// For a fixed path the Lagrangian is concave in p, for fixed |p| < xi_1/(sigma L) convex in the path: g is
/// concave on that ball, never above the optimal cost, and a stationary point inside is the global optimum.
/// Source: Emelyanov and Rubinovich (2020), eqs. (3.11)-(3.13), in regular form.
class GeneralWeightDual {
 public:
  GeneralWeightDual(const ChannelProblem& problem, const Eigen::Vector3d& beta);

  [[nodiscard]] DualPoint at(const Eigen::Vector3d& p) const;
  /// The largest g on the boundary |p| = xi_1/(sigma L), where the weak channel k has v_k = 0: g is finite
  /// only where its force (D22 e - c)_k vanishes too, a plane that cuts the sphere in a circle. Any value
  /// there is a lower bound. -infinity as value if plane and sphere do not meet.
  [[nodiscard]] DualPoint best_on_boundary() const;
  /// Jacobian of the gradient by central differences, symmetrised.
  [[nodiscard]] Eigen::Matrix3d curvature(const Eigen::Vector3d& p) const;
  /// p_j = sqrt(beta_j) Gamma_1j of any path shape.
  [[nodiscard]] Eigen::Vector3d multipliers(const PathShape& shape) const;
  /// Cost J of any path shape.
  [[nodiscard]] double cost(const PathShape& shape) const;
  /// Radius of the ball on which g is concave.
  [[nodiscard]] double radius() const { return critical_ / scale_; }
  [[nodiscard]] double critical() const { return critical_; }
  [[nodiscard]] double frequency_scale() const { return scale_; }
  /// Part of the cost that no path changes.
  [[nodiscard]] double constant() const { return constant_; }
  [[nodiscard]] int evaluations() const { return evaluations_; }

 private:
  [[nodiscard]] DualPoint complete(const Eigen::Vector3d& p, const Frequency& f,
                                   const Eigen::Vector2d& wave) const;
  [[nodiscard]] Eigen::Vector2d force(const Eigen::Vector3d& p) const;
  [[nodiscard]] DualPoint at_boundary(const Eigen::Vector3d& p) const;

  ChannelProblem problem_;
  Eigen::Vector3d beta_;
  Eigen::Vector3d root_;  ///< sqrt(beta)
  double critical_;
  double scale_;     ///< sigma L: xi = scale |p|
  double constant_;  ///< beta_2 [(D22 + L)^-1]_11 + beta_3 [(D22 + L)^-1]_22
  mutable int evaluations_ = 0;
};

/// Damped Newton on the dual from the multipliers of the straight path, kept inside the ball; where the
/// maximum lies on its boundary (nearly on the axis, extreme weights), the closed form of the cost is
/// minimised over (xi, w) from several starts, and the bound reached so far is returned with it: a heuristic
/// whose gap is stated, not a proof.
[[nodiscard]] GeneralWeightSolution solve_general_weight(const ChannelProblem& problem,
                                                         const Eigen::Vector3d& beta);

}  // namespace trammel::inline TRAMMEL_ABI::observer

#ifndef TRAMMEL_COMPILED
#include "trammel/observer/general_weight_impl.hpp"
#endif
