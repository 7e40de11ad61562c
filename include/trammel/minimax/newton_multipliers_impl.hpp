// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of newton_multipliers.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/gram_eigen.hpp"
#include "trammel/linalg/lu.hpp"
#include "trammel/linalg/panels.hpp"
#include "trammel/linalg/qr.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/minimax/bound_gram.hpp"
#include "trammel/minimax/newton_multipliers.hpp"
#include "trammel/minimax/prior_state.hpp"
#include "trammel/minimax/separable_gram.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

namespace detail {

/// The iteration's data; allocated once.
class MultiplierNewton {
 public:
  MultiplierNewton(const ReducedProblem& problem, unsigned threads)
      : problem_(problem),
        threads_(threads),
        separable_(problem.size() > kLargestDirectHessian),
        eigen_(problem.bounds.rows(), problem.size()),
        hessian_(slack_size(), slack_size()),
        factor_(slack_size()) {
    if (!separable_) {
      storage_ = bound_gram_storage(slack_size(), problem.size());
    }
    const Eigen::Index p = problem.size();
    // J^-1 = T T', T the inverse of the triangular information factor.
    inverse_.setIdentity(p, p);
    problem.information.triangularView<Eigen::Upper>().solveInPlace(inverse_);
    const Eigen::MatrixXd seen = problem.criterion * inverse_;  // C T
    gauss_markov_ = seen.squaredNorm();
    whitened_ = seen.transpose();  // F R = T' C'
    e_.noalias() = problem.bounds * inverse_;
    information_use_.resize(slack_size());
    squared_norms(e_, problem.first_row, information_use_);
    rows_.noalias() = e_ * whitened_;
    use_.resize(slack_size());
    for (Eigen::VectorXd* v :
         {&lambda_, &slack_, &gradient_, &d_lambda_, &d_slack_, &d_lambda_2_, &d_slack_2_}) {
      v->setZero(slack_size());
    }
    root_.resize(p);
    aim_.resize(slack_size());
    row_weight_.resize(rows_.rows());
    weighted_.resizeLike(rows_);
    work_.resize(p, p);
  }

  [[nodiscard]] ReducedSolution run(const SolverSettings& settings, const ProgressObserver& observe) {
    ReducedSolution result;
    const double start_gap = begin();
    double checked = 1.0;
    int last_iterations = 0;
    while (result.iterations < settings.max_iterations) {
      ++result.iterations;
      evaluate();
      const double s_mu = lambda_.dot(slack_);
      if (!std::isfinite(value_) || !(s_mu > 0.0)) {
        return result;
      }
      const double relative = s_mu / value_;
      // mu stops here; further iterations only make the slacks agree with <H_l, V>.
      least_mu_ =
          kGapShare * settings.relative_gap * value_ / static_cast<double>(problem_.size() + lambda_.size());
      constexpr double kCheckBelow = 1e-2;  // earlier V is not yet near its limit
      constexpr double kCheckEvery = 1e-2;
      const bool last = s_mu < 2.0 * least_mu_ * static_cast<double>(lambda_.size());
      if ((relative < kCheckBelow && relative < kCheckEvery * checked) || last) {
        checked = relative;
        if (!prior_is_positive(relative)) {
          return result;
        }
      }
      constexpr double kAgreed = 0.05;
      constexpr int kMostLast = 8;  // rounding errors of V leave no more to gain
      last_iterations += last ? 1 : 0;
      const double disagreement = lambda_.dot((gradient_ - slack_).cwiseAbs());
      if (last && (disagreement < kAgreed * s_mu || last_iterations > kMostLast)) {
        result.status = extract_prior(result) ? SolveStatus::kOptimal : SolveStatus::kNumericalTrouble;
        return result;
      }
      if (observe) {
        observe({"solving", std::clamp(std::log(start_gap / relative) /
                                           std::log(start_gap / (kGapShare * settings.relative_gap)),
                                       0.0, 1.0)});
      }
      step();
    }
    result.status = SolveStatus::kIterationLimit;
    return result;
  }

 private:
  static constexpr double kClose = 1e-6;  // relative gap below which V must be positive definite as it is

  [[nodiscard]] Eigen::Index slack_size() const { return static_cast<Eigen::Index>(problem_.ellipsoids()); }

  double begin() {
    constexpr double kShare = 0.3;  // of the unbounded error, spread evenly: the order of magnitude is enough
    lambda_.setConstant(kShare * gauss_markov_ / static_cast<double>(slack_size()));
    slack_.setOnes();
    return 1.0;
  }

  void evaluate() {
    per_row(lambda_, problem_.first_row, row_weight_);
    row_weight_ = row_weight_.cwiseSqrt();
    weighted_.noalias() = row_weight_.asDiagonal() * rows_;
    eigen_.compute(weighted_, threads_);
    root_ = eigen_.norms().cwiseMax(std::numeric_limits<double>::min());
    e_.noalias() = row_weight_.cwiseInverse().asDiagonal() * eigen_.images();
    value_ = lambda_.sum() + gauss_markov_ + lambda_.dot(information_use_) - 2.0 * root_.sum();
    weighted_.noalias() = e_ * root_.cwiseSqrt().cwiseInverse().asDiagonal();
    squared_norms(weighted_, problem_.first_row, use_);
    use_ -= information_use_;
    gradient_ = 1.0 - use_.array();
  }

  /// Mehrotra's predictor-corrector for (Hessian + diag(t / lambda)) d lambda = sigma mu / lambda - gradient.
  void step() {
    if (separable_) {
      separable_gram(e_, problem_.first_row, root_, hessian_, threads_);
    } else {
      bound_gram(
          e_, problem_.first_row,
          [this](Eigen::Index i, Eigen::Index j) {
            return 1.0 / (root_[i] * root_[j] * (root_[i] + root_[j]));
          },
          storage_, hessian_);
    }
    hessian_.diagonal() += slack_.cwiseQuotient(lambda_);
    factor_.compute(hessian_);
    const auto s = static_cast<double>(lambda_.size());
    const double mu = lambda_.dot(slack_) / s;
    direction(0.0, 0.0, d_lambda_, d_slack_);
    const double affine = std::min(longest(lambda_, d_lambda_), longest(slack_, d_slack_));
    const double mu_affine = (lambda_ + affine * d_lambda_).dot(slack_ + affine * d_slack_) / s;
    constexpr double kLeastSigma = 1e-3;
    const double sigma = std::max(std::pow(std::max(mu_affine, 0.0) / mu, 3.0), kLeastSigma);
    d_lambda_2_ = d_lambda_;
    d_slack_2_ = d_slack_;
    direction(std::max(sigma * mu, least_mu_), 1.0, d_lambda_, d_slack_);
    constexpr double kToBoundary = 0.95;
    const double length =
        std::min(1.0, kToBoundary * std::min(longest(lambda_, d_lambda_), longest(slack_, d_slack_)));
    lambda_ += length * d_lambda_;
    slack_ += length * d_slack_;
  }

  void direction(double target, double second_order, Eigen::VectorXd& d_lambda, Eigen::VectorXd& d_slack) {
    aim_ = (target - second_order * d_lambda_2_.array() * d_slack_2_.array()) / lambda_.array();
    d_lambda = aim_ - gradient_;
    factor_.solveInPlace(d_lambda);
    d_slack = aim_ - slack_ - slack_.cwiseProduct(d_lambda).cwiseQuotient(lambda_);
  }

  static double longest(const Eigen::VectorXd& x, const Eigen::VectorXd& dx) {
    double length = 1.0 / 0.95;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      if (dx[i] < 0.0) {
        length = std::min(length, -x[i] / dx[i]);
      }
    }
    return length;
  }

  /// F V F' + I = (F R U) b^-1 (F R U)' must exceed I.
  [[nodiscard]] bool prior_is_positive(double relative) {
    linalg::multiply(whitened_, eigen_.vectors(), work_, threads_);
    work_ *= root_.cwiseSqrt().cwiseInverse().asDiagonal();
    prior_.resize(work_.rows(), work_.rows());
    linalg::multiply_symmetric_nt(work_, work_, prior_, threads_);
    prior_.diagonal().array() -= 1.0;
    // Far from the end V may still lack what it gains later.
    const double slack = relative > kClose ? std::sqrt(relative) : 0.0;
    work_ = prior_;
    work_.diagonal().array() += slack;
    Eigen::Ref<Eigen::MatrixXd> target(work_);
    return linalg::InPlaceCholesky(target).info() == Eigen::Success;
  }

  /// V = L L' with the columns of L along the eigenvectors of F V F'. False where V is not positive definite.
  [[nodiscard]] bool extract_prior(ReducedSolution& result) {
    linalg::RepeatedSymmetricEigen spectrum(prior_.rows());
    spectrum.compute(prior_, threads_);
    if (!(spectrum.eigenvalues().minCoeff() > 0.0)) {
      return false;
    }
    result.prior_factor.resize(inverse_.rows(), inverse_.cols());
    linalg::multiply(inverse_, spectrum.eigenvectors(), result.prior_factor, threads_);
    result.prior_factor *= spectrum.eigenvalues().cwiseSqrt().asDiagonal();
    result.multipliers = lambda_;
    return true;
  }

  /// Up to this size the Hessian is summed entry by entry, without taking memory.
  static constexpr Eigen::Index kLargestDirectHessian = 128;

  const ReducedProblem& problem_;
  unsigned threads_;
  bool separable_;
  Eigen::MatrixXd inverse_, whitened_, rows_, e_, weighted_, work_, prior_;
  linalg::GramEigen eigen_;
  Eigen::MatrixXd hessian_;
  linalg::Cholesky factor_;
  Eigen::MatrixXd storage_;
  Eigen::VectorXd information_use_, use_, lambda_, slack_, gradient_, root_, row_weight_, aim_;
  Eigen::VectorXd d_lambda_, d_slack_, d_lambda_2_, d_slack_2_;
  double gauss_markov_ = 0.0;
  double value_ = 0.0;
  double least_mu_ = 0.0;
};

/// One Newton step towards Sigma(V) = H(lambda) in coordinates where V = I, Q D G + G D Q = G - L'H L, given
/// the lower triangle of `slack` = L'H L - G, which it overwrites. False where it does not exist: the motion
/// is not well observed.
inline bool step_to_equality(const ReducedProblem& problem, Eigen::MatrixXd& slack, unsigned threads,
                             PriorState& state) {
  slack.triangularView<Eigen::StrictlyUpper>() = slack.transpose();
  // T with T'Q T = I and T'G T = diag(g): Q is the one of the two that is well conditioned.
  Eigen::MatrixXd triangle = state.curvature;
  Eigen::Ref<Eigen::MatrixXd> target(triangle);
  if (linalg::InPlaceCholesky(target).info() != Eigen::Success) {
    return false;
  }
  auto lower = triangle.triangularView<Eigen::Lower>();
  lower.solveInPlace(state.gradient);
  lower.transpose().solveInPlace<Eigen::OnTheRight>(state.gradient);
  linalg::RepeatedSymmetricEigen eigen(problem.size());
  eigen.compute(state.gradient, threads);
  const Eigen::VectorXd& g = eigen.eigenvalues();
  if (!(g[0] > 0.0)) {
    return false;
  }
  const Eigen::MatrixXd& X = eigen.eigenvectors();
  lower.solveInPlace(slack);
  lower.transpose().solveInPlace<Eigen::OnTheRight>(slack);
  linalg::multiply(slack, X, state.gradient, threads);
  slack.noalias() = X.transpose() * state.gradient;
  for (Eigen::Index j = 0; j < g.size(); ++j) {
    slack.col(j).array() /= -(g.array() + g[j]);
  }
  linalg::multiply(X, slack, state.gradient, threads);
  slack.noalias() = state.gradient * X.transpose();
  lower.transpose().solveInPlace(slack);
  lower.solveInPlace<Eigen::OnTheRight>(slack);
  slack.diagonal().array() += 1.0;
  Eigen::Ref<Eigen::MatrixXd> moved(slack);
  if (linalg::InPlaceCholesky(moved).info() != Eigen::Success) {
    return false;
  }
  state.factor = (state.factor * slack.triangularView<Eigen::Lower>()).eval();
  state.update(problem);
  return true;
}

}  // namespace detail

TRAMMEL_INLINE std::optional<ReducedProblem> directly_observed(const GuaranteedProblem& problem) {
  require_well_formed(problem);
  const Eigen::Index p = problem.parameters();
  if (problem.information_factor.rows() < p || problem.criterion_factor.rows() < p ||
      problem.ellipsoids.empty()) {
    return std::nullopt;
  }
  ReducedProblem direct;
  const Eigen::VectorXd length = problem.information_factor.colwise().norm();
  if (!(length.minCoeff() > 0.0)) {
    return std::nullopt;
  }
  const Eigen::VectorXd scale = length.cwiseInverse();
  direct.basis = scale.asDiagonal();
  direct.free_basis.resize(p, 0);
  linalg::Qr qr(problem.information_factor * scale.asDiagonal());
  direct.information = qr.matrixQR().topRows(p).triangularView<Eigen::Upper>();
  const Eigen::VectorXd diagonal = direct.information.diagonal().cwiseAbs();
  constexpr double kWorstCondition = 1e7;  // of F: beyond it J^-1 has lost the digits the method needs
  if (!(diagonal.minCoeff() * kWorstCondition > diagonal.maxCoeff())) {
    return std::nullopt;
  }
  linalg::Qr criterion(problem.criterion_factor * scale.asDiagonal());
  direct.criterion = criterion.matrixQR().topRows(p).triangularView<Eigen::Upper>();
  direct.first_row.push_back(0);
  Eigen::Index rows = 0;
  for (std::size_t l = 0; l < problem.ellipsoids.size(); ++l) {
    if (problem.ellipsoids[l].size() > 0) {
      rows += problem.ellipsoids[l].rows();
      direct.owner.push_back(l);
      direct.first_row.push_back(rows);
    }
  }
  direct.bounds.resize(rows, p);
  for (std::size_t i = 0; i < direct.owner.size(); ++i) {
    direct.bounds.middleRows(direct.first_row[i], direct.first_row[i + 1] - direct.first_row[i]) =
        problem.ellipsoids[direct.owner[i]] * scale.asDiagonal();
  }
  return rows > 0 ? std::optional(std::move(direct)) : std::nullopt;
}

TRAMMEL_INLINE ReducedSolution solve_in_multipliers(const ReducedProblem& problem,
                                                    const SolverSettings& settings,
                                                    const ProgressObserver& observe) {
  detail::MultiplierNewton newton(problem, static_cast<unsigned>(settings.threads));
  return newton.run(settings, observe);
}

TRAMMEL_INLINE void scale_into_bounds(const ReducedProblem& problem, const Eigen::VectorXd& use,
                                      Eigen::MatrixXd& prior_factor) {
  if (problem.bounds.rows() != problem.bounds.cols()) {
    return;
  }
  const Eigen::VectorXd scale = use.cwiseMax(1.0).cwiseSqrt().cwiseInverse();
  Eigen::VectorXd row_scale(problem.bounds.rows());
  per_row(scale, problem.first_row, row_scale);
  prior_factor = linalg::Lu(problem.bounds).solve(row_scale.asDiagonal() * (problem.bounds * prior_factor));
}

TRAMMEL_INLINE void certify_prior(const ReducedProblem& problem, const SolverSettings& settings,
                                  ReducedSolution& solution) {
  constexpr double kShare = 0.1;  // of the gap, for the inflation
  constexpr int kMostSteps = 4;   // each squares the error
  const auto threads = static_cast<unsigned>(settings.threads);
  PriorState state(problem);
  state.factor.swap(solution.prior_factor);
  state.update(problem);
  const double inflation = kShare * settings.relative_gap * state.value / solution.multipliers.sum();
  {
    Eigen::VectorXd row_weight(problem.bounds.rows());
    per_row(solution.multipliers, problem.first_row, row_weight);
    Eigen::MatrixXd slack(problem.size(), problem.size());
    Eigen::MatrixXd weighted;
    for (int step = 0; true; ++step) {
      weighted = row_weight.asDiagonal() * state.bounds;
      linalg::multiply_symmetric_tn(state.bounds, weighted, slack, threads);
      weighted = (1.0 + inflation) * slack - state.gradient;
      Eigen::Ref<Eigen::MatrixXd> target(weighted);
      if (linalg::InPlaceCholesky(target).info() == Eigen::Success && weighted.diagonal().allFinite()) {
        solution.multipliers *= 1.0 + inflation;
        solution.upper = state.noise + solution.multipliers.sum();
        break;
      }
      slack -= state.gradient;
      if (step == kMostSteps || !detail::step_to_equality(problem, slack, threads, state)) {
        break;
      }
    }
  }
  solution.gain = state.gain();
  // A common factor costs what the largest excess is, which may be too much.
  if (state.use.maxCoeff() > 1.0 + kShare * settings.relative_gap) {
    scale_into_bounds(problem, state.use, state.factor);
    state.update(problem);
  }
  const double excess = std::max(1.0, state.use.maxCoeff());
  solution.lower = state.value / excess;
  solution.prior_factor.swap(state.factor);
  solution.prior_factor /= std::sqrt(excess);
  const bool narrow = std::isfinite(solution.upper) &&
                      solution.upper - solution.lower <= settings.relative_gap * solution.upper;
  solution.status = narrow ? SolveStatus::kOptimal : SolveStatus::kNumericalTrouble;
}

}  // namespace trammel::inline TRAMMEL_ABI::minimax
