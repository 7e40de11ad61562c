// SPDX-License-Identifier: Apache-2.0
/// @file
/// The linear system of one Newton step of the barrier problem, solved by preconditioned conjugate gradients.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/minimax/prior_state.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

/// Solves for symmetric D and y in R^s, in coordinates where V = I,
///
///   mu D + Q D G + G D Q + sum_l y_l h_l = R + sum_l rho_l h_l,   y_l = w_l <h_l, D>,   w_l = mu / t_l^2,
///
/// the Newton equations of f(V) + mu log det V + mu sum log t_l, t_l = 1 - <H_l, V>, with h_l = L'H_l L.
///
/// Method: conjugate gradients in a congruent basis D = T X T' that nearly diagonalises the operator.
/// 1. T from the eigenvectors of Q/|Q| + G/|G|; a direction i belongs to the range of V when
///    2 Q_ii G_ii > mu, the others die out with mu.
/// 2. On the range Q and G are diagonalised together (exact for Q X G + G X Q, where mu D is small beside
///    it); on the rest T stays orthogonal (exact for mu D).
/// The diagonal mu n_i n_j + q_i g_j + g_i q_j of what remains, with the s rank-one terms by the Woodbury
/// formula, is the preconditioner: 2 to 10 steps suffice, also where the optimal V is nearly singular; up to
/// 400 near the end where the range of V has no clear edge.
/// y is carried as an unknown of its own, and the residual as a pair (R, rho): near the end w_l is so large
/// that w_l <h_l, D> and R + sum rho_l h_l would keep no digits.
/// Up to kDenseLimit parameters the p(p+1)/2 equations are solved directly.
///
/// Cost: set-up about 40 p x p products and s^2 p^2 operations, a step about 6 products; memory O(p^2).
class NewtonSystem {
 public:
  explicit NewtonSystem(const ReducedProblem& problem);

  /// Prepares for one state. `weight` holds the w_l.
  void set_up(const ReducedProblem& problem, const PriorState& state, double mu,
              const Eigen::VectorXd& weight);

  /// When an answer is good enough: the residual's preconditioned norm at most `relative` of the start's and
  /// its Frobenius norm (in the coordinates V = I) at most `most`, or the latter at most `enough`.
  struct Tolerance {
    double relative = 0.0;
    double most = 0.0;
    double enough = 0.0;
  };

  /// Solves for the right-hand side (R, rho). Returns <R + sum rho_l h_l, D>.
  double solve(const Eigen::MatrixXd& rhs, const Eigen::VectorXd& rho, Tolerance tolerance,
               Eigen::MatrixXd& D, Eigen::VectorXd& y);

  [[nodiscard]] int steps() const { return steps_; }
  /// Whether the last solve reached its tolerance.
  [[nodiscard]] bool converged() const { return converged_; }
  [[nodiscard]] Eigen::Index range_size() const { return range_; }

  /// Largest number of parameters for which the equations are solved directly.
  static constexpr Eigen::Index kDenseLimit = 10;

 private:
  void choose_basis(const PriorState& state, double mu);
  void diagonalise_range();
  void set_up_base();
  void set_up_dense_base();
  void set_up_woodbury();
  void solve_base(const Eigen::MatrixXd& rhs, Eigen::MatrixXd& z);
  void precondition();
  [[nodiscard]] double residual_norm();
  void apply_base(const Eigen::MatrixXd& X, Eigen::MatrixXd& out);
  void bound_terms(const Eigen::VectorXd& y, Eigen::MatrixXd& out);
  void bound_products(const Eigen::MatrixXd& X, Eigen::VectorXd& out);
  [[nodiscard]] bool dense() const { return dense_.size() > 0; }

  const std::vector<Eigen::Index>* first_row_;
  double mu_ = 0.0;
  Eigen::Index range_ = 0;
  int steps_ = 0;
  bool converged_ = true;
  Eigen::MatrixXd T_, Q_, G_, N_, den_;       // basis, operator in it, its diagonal
  Eigen::MatrixXd h_, weighted_h_, product_;  // bound rows in the basis
  Eigen::MatrixXd residual_, direction_, image_, z_, X_, work_, work2_;
  Eigen::MatrixXd gram_, chunk_, dense_;
  Eigen::VectorXd weight_, root_, row_weight_, rho_, y_direction_, y_z_, score_, packed_;
  Eigen::VectorXi order_;
  linalg::RepeatedSymmetricEigen eigen_;
  linalg::Cholesky woodbury_;
};

}  // namespace trammel::inline TRAMMEL_ABI::minimax

#ifndef TRAMMEL_COMPILED
#include "trammel/minimax/newton_system_impl.hpp"
#endif
