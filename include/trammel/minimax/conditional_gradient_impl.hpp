// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of conditional_gradient.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "trammel/linalg/lu.hpp"
#include "trammel/linalg/qr.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/minimax/conditional_gradient.hpp"
#include "trammel/minimax/interior_point.hpp"
#include "trammel/minimax/prior_state.hpp"
#include "trammel/minimax/reduced_solution.hpp"
#include "trammel/minimax/worst_prior.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

namespace detail {

/// Frank and Wolfe's method in reduced coordinates.
class ConditionalGradient {
 public:
  ConditionalGradient(const ReducedProblem& problem, const SolverSettings& settings,
                      ConditionalGradientVariant variant)
      : problem_(problem),
        settings_(settings),
        variant_(variant),
        state_(problem),
        best_state_(problem),
        information_(problem.information.transpose() * problem.information),
        directions_(problem.size(), 0) {
    constexpr double kStart = 0.9;  // of the bounds; the paper starts there too
    Eigen::VectorXd use(static_cast<Eigen::Index>(problem.ellipsoids()));
    squared_norms(problem.bounds, problem.first_row, use);
    state_.factor.setIdentity();
    state_.factor *= std::sqrt(kStart / use.maxCoeff());
  }

  [[nodiscard]] ReducedSolution run(const ProgressObserver& observe) {
    constexpr double kOracleShare = 0.05;  // of the gap asked for
    double first_gap = 0.0;
    while (true) {
      state_.update(problem_);
      const WorstPrior worst = worst_prior(problem_.bounds, problem_.first_row, gradient(prior()),
                                           kOracleShare * settings_.relative_gap);
      best_.inner_iterations += worst.steps;
      ++best_.iterations;
      keep_bounds(worst);
      const double gap = (best_.upper - best_.lower) / (best_.upper + problem_.free_error);
      if (gap <= settings_.relative_gap) {
        best_.status = SolveStatus::kOptimal;
        break;
      }
      if (best_.iterations >= settings_.max_iterations) {
        best_.status = SolveStatus::kIterationLimit;
        break;
      }
      first_gap = best_.iterations == 1 ? gap : first_gap;
      if (observe) {
        observe(
            {"solving",
             std::clamp(std::log(first_gap / gap) / std::log(first_gap / settings_.relative_gap), 0.0, 1.0)});
      }
      const bool moved =
          variant_ == ConditionalGradientVariant::kFullyCorrective && correct(worst.prior_factor)
              ? true
              : search(worst.prior_factor);
      if (!moved) {
        best_.status = SolveStatus::kNumericalTrouble;
        break;
      }
    }
    best_.gain = best_state_.gain();
    return best_;
  }

 private:
  [[nodiscard]] Eigen::MatrixXd prior() const { return state_.factor * state_.factor.transpose(); }

  /// Sigma(V) = (I + J V)^-1 C'C (I + V J)^-1, for singular V too.
  [[nodiscard]] Eigen::MatrixXd gradient(const Eigen::MatrixXd& V) const {
    Eigen::MatrixXd system = information_ * V;
    system.diagonal().array() += 1.0;
    const Eigen::MatrixXd half = linalg::Lu(system).solve(problem_.criterion.transpose());
    return half * half.transpose();
  }

  void keep_bounds(const WorstPrior& worst) {
    const double use = std::max(1.0, state_.use.maxCoeff());
    if (state_.value / use > best_.lower) {
      best_.lower = state_.value / use;
      best_.prior_factor = state_.factor / std::sqrt(use);
    }
    if (state_.noise + worst.upper < best_.upper) {
      best_.upper = state_.noise + worst.upper;
      best_.multipliers = worst.multipliers;
      best_state_ = state_;
    }
  }

  /// V + t (V' - V) with the t in [0, 1] that maximises f: the zero of its derivative, by the regula falsi
  /// with halved weights. False where no step raises f.
  [[nodiscard]] bool search(const Eigen::MatrixXd& worst_factor) {
    const Eigen::MatrixXd V = prior();
    const Eigen::MatrixXd change = worst_factor * worst_factor.transpose() - V;
    const auto slope = [&](double t) { return gradient(V + t * change).cwiseProduct(change).sum(); };
    constexpr int kSteps = 60;
    constexpr double kNarrow = 1e-13;
    double low = 0.0;
    double high = 1.0;
    double at_low = slope(low);
    double at_high = slope(high);
    if (!(at_low > 0.0)) {
      return false;
    }
    const double least = kNarrow * at_low;
    double t = at_high >= 0.0 ? 1.0 : 0.0;
    if (at_high < 0.0) {
      for (int k = 0; k < kSteps && high - low > kNarrow; ++k) {
        t = (low * at_high - high * at_low) / (at_high - at_low);
        const double here = slope(t);
        if (std::abs(here) <= least) {
          break;
        }
        if (here > 0.0) {
          low = t;
          at_low = here;
          at_high *= 0.5;
        } else {
          high = t;
          at_high = here;
          at_low *= 0.5;
        }
      }
    }
    // The factor of the mixture, from the QR of both factors side by side.
    const Eigen::Index q = problem_.size();
    Eigen::MatrixXd both(2 * q, q);
    both.topRows(q) = std::sqrt(1.0 - t) * state_.factor.transpose();
    both.bottomRows(q) = std::sqrt(t) * worst_factor.transpose();
    state_.factor = linalg::compressed(std::move(both)).transpose();
    return t > 0.0;
  }

  /// Adds the directions of the worst prior and solves on the face they span. False where that brings
  /// nothing.
  [[nodiscard]] bool correct(const Eigen::MatrixXd& worst_factor) {
    constexpr double kSeen = 1e-3;  // eigenvalue of the worst prior, over the largest, that counts
    constexpr double kNew = 1e-6;   // part of a direction outside the span
    const Eigen::Index before = directions_.cols();
    const linalg::SymmetricEigen eigen(worst_factor * worst_factor.transpose());
    const double largest = eigen.eigenvalues().maxCoeff();
    for (Eigen::Index i = problem_.size() - 1; i >= 0 && eigen.eigenvalues()[i] > kSeen * largest; --i) {
      Eigen::VectorXd direction = eigen.eigenvectors().col(i);
      for (int pass = 0; pass < 2; ++pass) {
        direction -= directions_ * (directions_.transpose() * direction);
      }
      if (direction.norm() > kNew && directions_.cols() < problem_.size()) {
        directions_.conservativeResize(Eigen::NoChange, directions_.cols() + 1);
        directions_.rightCols<1>() = direction.normalized();
      }
    }
    if (directions_.cols() == before) {
      return false;
    }
    ReducedProblem face;
    face.information = problem_.information * directions_;
    face.criterion = problem_.criterion * directions_;
    face.bounds = problem_.bounds * directions_;
    face.first_row = problem_.first_row;
    face.owner = problem_.owner;
    face.basis = problem_.basis * directions_;
    face.free_error = problem_.free_error;
    SolverSettings settings = settings_;
    settings.relative_gap = 0.1 * settings_.relative_gap;
    const ReducedSolution inner = InteriorPoint(face, settings).run({});
    if (!(inner.lower > state_.value)) {
      return false;
    }
    state_.factor.setZero();
    state_.factor.leftCols(inner.prior_factor.cols()) = directions_ * inner.prior_factor;
    return true;
  }

  const ReducedProblem& problem_;
  SolverSettings settings_;
  ConditionalGradientVariant variant_;
  PriorState state_, best_state_;
  Eigen::MatrixXd information_;
  Eigen::MatrixXd directions_;  // orthonormal
  ReducedSolution best_;
};

}  // namespace detail

TRAMMEL_INLINE Solution solve_by_conditional_gradient(const GuaranteedProblem& problem,
                                                      const SolverSettings& settings,
                                                      ConditionalGradientVariant variant,
                                                      const ProgressObserver& observe) {
  return solve_reduced(problem, settings, Method::kConditionalGradient, [&](const ReducedProblem& reduced) {
    return detail::ConditionalGradient(reduced, settings, variant).run(observe);
  });
}

}  // namespace trammel::inline TRAMMEL_ABI::minimax
