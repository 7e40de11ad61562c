// SPDX-License-Identifier: Apache-2.0
/// @file
/// The structured interior-point method for the guaranteed problem.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/minimax/newton_system.hpp"
#include "trammel/minimax/prior_state.hpp"
#include "trammel/minimax/reduced_solution.hpp"
#include "trammel/minimax/reduction.hpp"
#include "trammel/minimax/solution.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

/// Follows the central path of
///
///   max over V > 0 of  f(V) + mu log det V + mu sum_l log t_l,   t_l = 1 - <H_l, V>,   mu -> 0,
///
/// f(V) = tr C (V^-1 + F'F)^-1 C' (the concave dual of the guaranteed problem). On the path
/// lambda_l = mu / t_l and H(lambda) - Sigma(V) = mu V^-1 > 0, so each centred point is feasible for both
/// sides, with the gap mu (q + s).
///
/// Method: predictor along the tangent to a smaller mu, as long a step as leaves the point well inside, then
/// Newton corrections (NewtonSystem) with a line search on the barrier function. V = L L' is kept in product
/// form and every iteration works in coordinates where V is the identity, so a nearly singular least
/// favourable prior costs no accuracy; the slacks t and the multipliers lambda are variables of their own,
/// since 1 - <H_l, V> and mu / t_l lose their digits near the boundary.
/// Sources: Nesterov and Nemirovski (1994) for barriers compatible with a matrix-concave function; the
/// problem and its dual as in the README's Sources.
/// Guarantee: `lower` and `upper` come from feasible points and hold at every exit, up to rounding.
/// Cost: 25 to 45 iterations of about 100 q x q products; memory O(q^2), held for all iterations.
class InteriorPoint {
 public:
  InteriorPoint(const ReducedProblem& problem, const SolverSettings& settings);

  /// From a point well inside the bounds.
  [[nodiscard]] ReducedSolution run(const ProgressObserver& observe);

  /// From a nearly optimal V = L L' and its multipliers.
  [[nodiscard]] ReducedSolution polish(const Eigen::MatrixXd& prior_factor,
                                       const Eigen::VectorXd& multipliers, const ProgressObserver& observe);

 private:
  void start();
  void start_near(const Eigen::MatrixXd& prior_factor, const Eigen::VectorXd& multipliers);
  [[nodiscard]] ReducedSolution follow_path(const ProgressObserver& observe);
  void newton_step();
  [[nodiscard]] bool reject_prediction();
  void predict();
  void correct();
  void apply_prediction(double shrink);
  [[nodiscard]] bool positive(double base, const Eigen::MatrixXd& D, double factor, const Eigen::MatrixXd* E,
                              double e_factor);
  void move(const Eigen::MatrixXd& base_factor);
  [[nodiscard]] bool certify();
  void sum_bounds();
  void set_multipliers();
  [[nodiscard]] bool inequality_holds(double inflation);
  void best_effort_certificate();
  void keep_lower();
  void keep_upper(double inflation);
  [[nodiscard]] double merit(const PriorState& state, const Eigen::VectorXd& slack, double log_det) const;
  [[nodiscard]] double target_mu() const;
  [[nodiscard]] double lower_bound() const;

  const ReducedProblem& problem_;
  SolverSettings settings_;
  PriorState state_, candidate_;
  NewtonSystem system_;
  double mu_ = 0.0, saved_mu_ = 0.0, first_mu_ = 0.0;
  double decrement_ = 0.0;
  double wanted_shrink_ = 0.1;
  double used_shrink_ = 1.0;
  bool predicted_ = false;  // the last step was a prediction that newton_step() has not judged yet
  bool stuck_ = false;
  int final_steps_ = 0;
  Eigen::VectorXd slack_, saved_slack_, candidate_slack_, saved_dt_, multipliers_, wanted_, weight_;
  Eigen::VectorXd barrier_, saved_barrier_, saved_y_, rho_;
  Eigen::VectorXd y_centre_, y_tangent_, dt_centre_, dt_tangent_, row_weight_;
  Eigen::MatrixXd residual_, centre_, tangent_, saved_centre_, triangle_, weighted_, bound_sum_,
      saved_factor_, upper_factor_;
  ReducedSolution best_;
};

}  // namespace trammel::inline TRAMMEL_ABI::minimax

#ifndef TRAMMEL_COMPILED
#include "trammel/minimax/interior_point_impl.hpp"
#endif
