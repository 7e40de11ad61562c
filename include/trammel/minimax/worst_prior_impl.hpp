// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of worst_prior.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/minimax/prior_state.hpp"
#include "trammel/minimax/worst_prior.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

namespace detail {

/// sum lambda - mu log det (H(lambda) - G) - mu sum log lambda, with its Newton step.
class MultiplierBarrier {
 public:
  MultiplierBarrier(const Eigen::MatrixXd& bounds, const std::vector<Eigen::Index>& first_row,
                    const Eigen::MatrixXd& G)
      : bounds_(bounds), first_row_(first_row), G_(G), weight_(bounds.rows()) {}

  /// H(lambda) - G is positive definite, as far as its Cholesky factorisation says.
  [[nodiscard]] bool factor(const Eigen::VectorXd& lambda) {
    if (!(lambda.array() > 0.0).all()) {
      return false;
    }
    slack_ = combination(lambda) - G_;
    cholesky_.compute(slack_);
    return cholesky_.info() == Eigen::Success && cholesky_.matrixLLT().diagonal().allFinite();
  }

  /// Value at the point factored last.
  [[nodiscard]] double value(const Eigen::VectorXd& lambda, double mu) const {
    return lambda.sum() -
           mu * (2.0 * cholesky_.matrixLLT().diagonal().array().log().sum() + lambda.array().log().sum());
  }

  /// <a_l Z^-1 a_m'>: the block of two bounds in the Gram matrix of all their rows.
  [[nodiscard]] auto block(Eigen::Index l, Eigen::Index m) const {
    const auto i = static_cast<std::size_t>(l);
    const auto j = static_cast<std::size_t>(m);
    return gram_.block(first_row_[i], first_row_[j], first_row_[i + 1] - first_row_[i],
                       first_row_[j + 1] - first_row_[j]);
  }

  /// Newton's step at the point factored last; returns gradient' step (not positive).
  double newton(const Eigen::VectorXd& lambda, double mu, Eigen::VectorXd& step) {
    seen_ = bounds_.transpose();
    cholesky_.matrixL().solveInPlace(seen_);
    gram_.noalias() = seen_.transpose() * seen_;
    const Eigen::Index s = lambda.size();
    gradient_.resize(s);
    hessian_.resize(s, s);
    for (Eigen::Index l = 0; l < s; ++l) {
      gradient_[l] = 1.0 - mu * block(l, l).trace() - mu / lambda[l];
      for (Eigen::Index m = 0; m < s; ++m) {
        hessian_(l, m) = mu * block(l, m).squaredNorm();
      }
      hessian_(l, l) += mu / (lambda[l] * lambda[l]);
    }
    // Scaled by lambda, whose entries may differ by many orders of magnitude.
    hessian_ = lambda.asDiagonal() * hessian_ * lambda.asDiagonal();
    const linalg::Cholesky system(hessian_);
    step = -(lambda.asDiagonal() * system.solve(lambda.cwiseProduct(gradient_)));
    return gradient_.dot(step);
  }

  /// V = mu (Z^-1 - Z^-1 H(step) Z^-1) = L L' at the point factored last: the primal point of Newton's step.
  /// Empty where it is not positive definite.
  [[nodiscard]] Eigen::MatrixXd prior_factor(const Eigen::VectorXd& step, double mu) {
    Eigen::MatrixXd change = combination(step);
    cholesky_.matrixL().solveInPlace(change);
    change = cholesky_.matrixL().solve(change.transpose()).eval();
    change = Eigen::MatrixXd::Identity(change.rows(), change.cols()) - change;
    const linalg::Cholesky half(change);
    if (half.info() != Eigen::Success) {
      return {};
    }
    Eigen::MatrixXd factor = half.matrixL();
    cholesky_.matrixU().solveInPlace(factor);
    return std::sqrt(mu) * factor;
  }

 private:
  [[nodiscard]] Eigen::MatrixXd combination(const Eigen::VectorXd& lambda) {
    per_row(lambda, first_row_, weight_);
    return bounds_.transpose() * weight_.asDiagonal() * bounds_;
  }
  const Eigen::MatrixXd& bounds_;
  const std::vector<Eigen::Index>& first_row_;
  const Eigen::MatrixXd& G_;
  Eigen::VectorXd weight_, gradient_;
  Eigen::MatrixXd slack_, seen_, gram_, hessian_;
  linalg::Cholesky cholesky_;
};

}  // namespace detail

TRAMMEL_INLINE WorstPrior worst_prior(const Eigen::MatrixXd& bounds,
                                      const std::vector<Eigen::Index>& first_row, const Eigen::MatrixXd& G,
                                      double relative_gap) {
  constexpr double kShrink = 0.1;     // of mu, between centrings
  constexpr double kCentred = 0.3;    // decrement from which the primal point is feasible
  constexpr double kShorter = 0.7;    // of a step that does not lower the barrier function
  constexpr double kShortest = 1e-9;  // step from which rounding errors have the say
  constexpr double kDescent = 1e-4;
  const auto s = static_cast<Eigen::Index>(first_row.size()) - 1;
  const auto cone = static_cast<double>(bounds.cols() + s);
  WorstPrior best;
  best.upper = std::numeric_limits<double>::infinity();
  detail::MultiplierBarrier barrier(bounds, first_row, G);
  // sum H_l = I: twice the largest eigenvalue is well inside.
  Eigen::VectorXd lambda = Eigen::VectorXd::Constant(
      s, 2.0 * linalg::SymmetricEigen(G, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff());
  Eigen::VectorXd step;
  Eigen::VectorXd trial;
  double mu = lambda.sum() / cone;
  bool inside = barrier.factor(lambda);
  while (inside) {
    const double slope = barrier.newton(lambda, mu, step);
    ++best.steps;
    if (!(slope <= 0.0)) {
      break;
    }
    if (std::sqrt(-slope / mu) < kCentred) {
      Eigen::MatrixXd factor = barrier.prior_factor(step, mu);
      if (factor.size() == 0) {
        break;
      }
      double use = 0.0;
      for (std::size_t l = 0; l + 1 < first_row.size(); ++l) {
        use = std::max(
            use, (bounds.middleRows(first_row[l], first_row[l + 1] - first_row[l]) * factor).squaredNorm());
      }
      factor /= std::sqrt(std::max(1.0, use));
      const double lower = (G * factor).cwiseProduct(factor).sum();
      if (lower > best.lower) {
        best.lower = lower;
        best.prior_factor = std::move(factor);
      }
      if (lambda.sum() < best.upper) {
        best.upper = lambda.sum();
        best.multipliers = lambda;
      }
      if (best.upper - best.lower <= relative_gap * best.upper ||
          mu * cone < 0.1 * relative_gap * best.upper) {
        break;
      }
      mu *= kShrink;
      continue;
    }
    const double before = barrier.value(lambda, mu);
    double length = 1.0;
    for (; length > kShortest; length *= kShorter) {
      trial = lambda + length * step;
      if (barrier.factor(trial) && barrier.value(trial, mu) < before + kDescent * length * slope) {
        break;
      }
    }
    inside = length > kShortest;
    if (inside) {
      lambda = trial;
    }
  }
  return best;
}

}  // namespace trammel::inline TRAMMEL_ABI::minimax
