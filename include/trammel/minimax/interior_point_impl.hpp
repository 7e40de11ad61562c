// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of interior_point.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "trammel/minimax/interior_point.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

namespace detail {

/// Dual residual left by a linear solve, in units of mu: more would spoil the multipliers carried along, even
/// where the preconditioner's norm of the residual is small.
inline constexpr double kMostOfMu = 3.0;

}  // namespace detail

TRAMMEL_INLINE InteriorPoint::InteriorPoint(const ReducedProblem& problem, const SolverSettings& settings)
    : problem_(problem), settings_(settings), state_(problem), candidate_(problem), system_(problem) {
  const Eigen::Index q = problem.size();
  const auto s = static_cast<Eigen::Index>(problem.ellipsoids());
  for (Eigen::VectorXd* vector :
       {&slack_, &saved_slack_, &candidate_slack_, &saved_dt_, &multipliers_, &wanted_, &barrier_,
        &saved_barrier_, &saved_y_, &rho_, &weight_, &y_centre_, &y_tangent_, &dt_centre_, &dt_tangent_}) {
    vector->setZero(s);
  }
  for (Eigen::MatrixXd* matrix : {&residual_, &centre_, &tangent_, &saved_centre_, &triangle_, &bound_sum_,
                                  &saved_factor_, &upper_factor_, &best_.prior_factor}) {
    matrix->setZero(q, q);
  }
  row_weight_.setZero(problem.bounds.rows());
  weighted_.setZero(problem.bounds.rows(), q);
  best_.multipliers.setZero(s);
}

TRAMMEL_INLINE ReducedSolution InteriorPoint::run(const ProgressObserver& observe) {
  start();
  return follow_path(observe);
}

TRAMMEL_INLINE ReducedSolution InteriorPoint::polish(const Eigen::MatrixXd& prior_factor,
                                                     const Eigen::VectorXd& multipliers,
                                                     const ProgressObserver& observe) {
  start_near(prior_factor, multipliers);
  return follow_path(observe);
}

TRAMMEL_INLINE ReducedSolution InteriorPoint::follow_path(const ProgressObserver& observe) {
  while (true) {
    newton_step();
    if (predicted_ && reject_prediction()) {
      continue;
    }
    predicted_ = false;
    keep_lower();
    if (certify()) {
      best_.status = SolveStatus::kOptimal;
      break;
    }
    if (stuck_ || best_.iterations >= settings_.max_iterations) {
      best_.status = stuck_ ? SolveStatus::kNumericalTrouble : SolveStatus::kIterationLimit;
      best_effort_certificate();
      break;
    }
    if (observe) {
      observe(
          {"solving", std::clamp(std::log(first_mu_ / mu_) / std::log(first_mu_ / target_mu()), 0.0, 1.0)});
    }
    constexpr double kCentred = 1.0;  // decrement below which the tangent is a good direction
    if (decrement_ < kCentred && mu_ > target_mu()) {
      predict();
    } else {
      correct();
    }
  }
  best_.inner_iterations = system_.steps();
  state_.factor = upper_factor_;
  state_.update(problem_);
  best_.gain = state_.gain();
  return best_;
}

TRAMMEL_INLINE void InteriorPoint::start() {
  squared_norms(problem_.bounds, problem_.first_row, slack_);
  state_.factor.setIdentity();
  state_.factor *= std::sqrt(0.5 / slack_.maxCoeff());
  state_.update(problem_);
  slack_ = 1.0 - state_.use.array();
  mu_ = std::max(state_.gradient.trace() / static_cast<double>(problem_.size()),
                 std::numeric_limits<double>::min());
  first_mu_ = mu_;
  multipliers_ = mu_ * slack_.cwiseInverse();
}

TRAMMEL_INLINE void InteriorPoint::start_near(const Eigen::MatrixXd& prior_factor,
                                              const Eigen::VectorXd& multipliers) {
  state_.factor = prior_factor;
  state_.update(problem_);
  mu_ = target_mu();
  first_mu_ = mu_;
  // Every slack gets at least half of what its multiplier asks for, by a little less of V as a whole.
  double excess = 0.0;
  for (Eigen::Index l = 0; l < slack_.size(); ++l) {
    const double least = std::min(0.5, 0.5 * mu_ / multipliers[l]);
    excess = std::max(excess, state_.use[l] - (1.0 - least));
  }
  if (excess > 0.0) {
    state_.factor *= std::sqrt(std::max(0.5, 1.0 - excess));
    state_.update(problem_);
  }
  slack_ = 1.0 - state_.use.array();
  multipliers_ = multipliers;
}

TRAMMEL_INLINE double InteriorPoint::target_mu() const {
  return kGapShare * settings_.relative_gap * (state_.value + problem_.free_error) /
         static_cast<double>(problem_.size() + slack_.size());
}

TRAMMEL_INLINE double InteriorPoint::lower_bound() const {
  return state_.value / std::max(1.0, state_.use.maxCoeff());
}

/// Newton's direction at the present mu: `centre_`, with the decrement. The gradient is split into what the
/// multipliers carried along leave, and the difference of mu / t from them.
TRAMMEL_INLINE void InteriorPoint::newton_step() {
  ++best_.iterations;
  barrier_ = mu_ * slack_.cwiseInverse();
  weight_ = barrier_.cwiseQuotient(slack_);
  sum_bounds();
  residual_ = state_.gradient - bound_sum_;
  residual_.diagonal().array() += mu_;
  rho_ = multipliers_ - barrier_;
  system_.set_up(problem_, state_, mu_, weight_);
  // The residual left must stay well below mu for H(lambda) - Sigma to be positive at the end.
  constexpr double kRelative = 1e-3;
  constexpr double kEnough = 0.03;
  const double squared =
      system_.solve(residual_, rho_, {kRelative, detail::kMostOfMu * mu_, kEnough * mu_}, centre_, y_centre_);
  decrement_ = std::sqrt(std::max(squared, 0.0) / mu_);
  dt_centre_ = -y_centre_.cwiseQuotient(weight_);
}

/// bound_sum_ = sum lambda_l h_l.
TRAMMEL_INLINE void InteriorPoint::sum_bounds() {
  per_row(multipliers_, problem_.first_row, row_weight_);
  weighted_.noalias() = row_weight_.asDiagonal() * state_.bounds;
  bound_sum_.noalias() = state_.bounds.transpose() * weighted_;
}

/// Takes a prediction back that led too far from the path, and makes a shorter one from the same point.
TRAMMEL_INLINE bool InteriorPoint::reject_prediction() {
  constexpr double kTooFar = 20.0;  // more takes longer to centre again than a second prediction
  constexpr double kLongEnough = 0.9;
  constexpr double kGoodDecrement = 2.0;
  constexpr double kPoorDecrement = 4.0;
  // Near the centre the next step removes what the linear solver left: no reason to go back.
  const bool bad = decrement_ > kTooFar || (!system_.converged() && decrement_ > kGoodDecrement);
  if (bad && used_shrink_ < kLongEnough) {
    used_shrink_ = std::min(kLongEnough, std::sqrt(used_shrink_));
    wanted_shrink_ = std::max(wanted_shrink_, used_shrink_);
    centre_ = saved_centre_;
    dt_centre_ = saved_dt_;
    y_centre_ = saved_y_;
    apply_prediction(used_shrink_);
    return true;
  }
  if (decrement_ < kGoodDecrement) {
    wanted_shrink_ *= 0.3;
  } else if (decrement_ > kPoorDecrement) {
    wanted_shrink_ = std::min(0.5, 2.0 * wanted_shrink_);
  }
  return false;
}

/// Whether base I + factor D + e_factor E is positive definite; its Cholesky factor is left in triangle_.
TRAMMEL_INLINE bool InteriorPoint::positive(double base, const Eigen::MatrixXd& D, double factor,
                                            const Eigen::MatrixXd* E, double e_factor) {
  triangle_ = factor * D;
  if (E != nullptr) {
    triangle_ += e_factor * *E;
  }
  triangle_.diagonal().array() += base;
  Eigen::Ref<Eigen::MatrixXd> target(triangle_);
  return linalg::InPlaceCholesky(target).info() == Eigen::Success && triangle_.diagonal().allFinite();
}

/// Candidate at base_factor * triangle_ (the Cholesky factor of I + step).
TRAMMEL_INLINE void InteriorPoint::move(const Eigen::MatrixXd& base_factor) {
  candidate_.factor.noalias() = base_factor * triangle_.triangularView<Eigen::Lower>();
  candidate_.update(problem_);
}

TRAMMEL_INLINE void InteriorPoint::predict() {
  // Tangent of the central path, dV/d(log mu) with the sign that makes mu smaller.
  residual_.setZero();
  residual_.diagonal().setConstant(-mu_);
  constexpr double kLoose = 1e-2;
  constexpr double kNothing = 1e-6;  // what is left is rounding: no tangent to follow
  (void)system_.solve(residual_, barrier_, {kLoose, detail::kMostOfMu * mu_, kNothing * mu_}, tangent_,
                      y_tangent_);
  dt_tangent_ = -y_tangent_.cwiseQuotient(weight_);

  constexpr std::array<double, 10> kShrinks{0.001, 0.003, 0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9};
  constexpr double kInside = 0.3;  // of the expected distance to the boundary, which shrinks with mu
  const double smallest = target_mu() / mu_;
  double shrink = kShrinks.back();
  for (const double trial : kShrinks) {
    shrink = std::max(trial, smallest);
    if (trial < std::min(wanted_shrink_, kShrinks.back())) {
      continue;
    }
    candidate_slack_ = slack_ + dt_centre_ + (1.0 - shrink) * dt_tangent_;
    if ((candidate_slack_.array() >= kInside * shrink * slack_.array()).all() &&
        positive(1.0 - kInside * shrink, centre_, 1.0, &tangent_, 1.0 - shrink)) {
      break;
    }
  }
  saved_factor_ = state_.factor;
  saved_slack_ = slack_;
  saved_mu_ = mu_;
  saved_centre_ = centre_;
  saved_dt_ = dt_centre_;
  saved_y_ = y_centre_;
  saved_barrier_ = barrier_;
  apply_prediction(shrink);
}

TRAMMEL_INLINE void InteriorPoint::apply_prediction(double shrink) {
  while (true) {
    candidate_slack_ = saved_slack_ + dt_centre_ + (1.0 - shrink) * dt_tangent_;
    if ((candidate_slack_.array() > 0.0).all() && positive(1.0, centre_, 1.0, &tangent_, 1.0 - shrink)) {
      break;
    }
    if (shrink >= 1.0) {  // even the way to the centre is barred: correct with a line search instead
      predicted_ = false;
      state_.factor = saved_factor_;
      state_.update(problem_);
      slack_ = saved_slack_;
      mu_ = saved_mu_;
      barrier_ = saved_barrier_;
      correct();
      return;
    }
    shrink = std::min(1.0, 2.0 * shrink);
  }
  move(saved_factor_);
  std::swap(state_, candidate_);
  slack_.swap(candidate_slack_);
  mu_ = saved_mu_ * shrink;
  wanted_ = shrink * saved_barrier_ + y_centre_ + (1.0 - shrink) * y_tangent_;
  set_multipliers();
  used_shrink_ = shrink;
  predicted_ = shrink < 1.0;
}

TRAMMEL_INLINE double InteriorPoint::merit(const PriorState& state, const Eigen::VectorXd& slack,
                                           double log_det) const {
  return state.value + mu_ * (log_det + slack.array().log().sum());
}

TRAMMEL_INLINE void InteriorPoint::correct() {
  constexpr double kToBoundary = 0.9;
  constexpr double kShorter = 0.6;
  constexpr double kShortest = 1e-6;
  constexpr double kRounding = 1e-13;
  double length = 1.0;
  const double before = merit(state_, slack_, 0.0);
  while (true) {
    candidate_slack_ = slack_ + (length / kToBoundary) * dt_centre_;
    const bool inside = (candidate_slack_.array() > 0.0).all() &&
                        positive(1.0, centre_, length / kToBoundary, nullptr, 0.0) &&
                        positive(1.0, centre_, length, nullptr, 0.0);
    if (inside) {
      const double log_det = 2.0 * triangle_.diagonal().array().log().sum();
      candidate_slack_ = slack_ + length * dt_centre_;
      move(state_.factor);
      if (!(merit(candidate_, candidate_slack_, log_det) < before - kRounding * std::abs(before))) {
        break;
      }
    }
    length *= kShorter;
    if (length < kShortest) {
      stuck_ = true;
      return;
    }
  }
  std::swap(state_, candidate_);
  slack_.swap(candidate_slack_);
  wanted_ = multipliers_ + length * (barrier_ + y_centre_ - multipliers_);
  set_multipliers();
}

/// Takes Newton's multipliers from `wanted_`; one that would not be positive becomes mu / t.
TRAMMEL_INLINE void InteriorPoint::set_multipliers() {
  constexpr double kLeast = 0.1;  // of mu / t
  for (Eigen::Index l = 0; l < slack_.size(); ++l) {
    const double barrier = mu_ / slack_[l];
    multipliers_[l] = wanted_[l] > kLeast * barrier ? wanted_[l] : barrier;
  }
}

TRAMMEL_INLINE bool InteriorPoint::inequality_holds(double inflation) {
  triangle_ = (1.0 + inflation) * bound_sum_ - state_.gradient;
  Eigen::Ref<Eigen::MatrixXd> target(triangle_);
  return linalg::InPlaceCholesky(target).info() == Eigen::Success && triangle_.diagonal().allFinite();
}

TRAMMEL_INLINE void InteriorPoint::keep_lower() {
  if (lower_bound() > best_.lower) {
    best_.lower = lower_bound();
    best_.prior_factor = state_.factor;
    best_.prior_factor /= std::sqrt(std::max(1.0, state_.use.maxCoeff()));
  }
}

TRAMMEL_INLINE void InteriorPoint::keep_upper(double inflation) {
  const double upper = state_.noise + (1.0 + inflation) * multipliers_.sum();
  if (upper < best_.upper) {
    best_.upper = upper;
    best_.multipliers = (1.0 + inflation) * multipliers_;
    upper_factor_ = state_.factor;
  }
}

/// True when the interval is as narrow as asked for.
TRAMMEL_INLINE bool InteriorPoint::certify() {
  const double total = multipliers_.sum();
  constexpr double kStrictly = 0.999;  // so that rounding does not lift the gap over what was asked for
  const double wanted =
      (best_.lower + problem_.free_error) / (1.0 - kStrictly * settings_.relative_gap) - problem_.free_error;
  const double allowed = (wanted - state_.noise - total) / total;
  if (!(allowed >= 0.0)) {
    return false;
  }
  constexpr int kFinalSteps = 25;  // at the last mu Newton's method converges in fewer, or not at all
  ++final_steps_;
  if (!inequality_holds(allowed)) {
    stuck_ = stuck_ || final_steps_ > kFinalSteps;
    return false;
  }
  double inflation = allowed;
  for (const double share : {0.0, 1e-4, 1e-2, 1e-1}) {
    if (inequality_holds(share * allowed)) {
      inflation = share * allowed;
      break;
    }
  }
  keep_upper(inflation);
  return true;
}

/// Upper bound at whatever point the method stopped.
TRAMMEL_INLINE void InteriorPoint::best_effort_certificate() {
  constexpr double kSmallest = 1e-14;
  constexpr double kLargest = 1e12;
  constexpr double kRaise = 1.5;
  for (double inflation = kSmallest; inflation < kLargest; inflation *= kRaise) {
    if (inequality_holds(inflation)) {
      keep_upper(inflation);
      return;
    }
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::minimax
