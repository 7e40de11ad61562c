// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of newton_multipliers.hpp.
#pragma once

#include <algorithm>
#include <cmath>

#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/qr.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/minimax/bound_gram.hpp"
#include "trammel/minimax/newton_multipliers.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

namespace detail {

/// The iteration's data; allocated once.
class MultiplierNewton {
 public:
  explicit MultiplierNewton(const ReducedProblem& problem)
      : problem_(problem),
        R_(problem.size(), problem.size()),
        eigen_(problem.size()),
        hessian_(slack_size(), slack_size()),
        factor_(slack_size()),
        storage_(bound_gram_storage(slack_size(), problem.size())) {
    const Eigen::Index p = problem.size();
    // J^-1 = T T', T the inverse of the triangular information factor.
    inverse_.setIdentity(p, p);
    problem.information.triangularView<Eigen::Upper>().solveInPlace(inverse_);
    const Eigen::MatrixXd seen = problem.criterion * inverse_;  // C T
    gauss_markov_ = seen.squaredNorm();
    whitened_ = seen.transpose();  // F R = T' C'
    R_.noalias() = inverse_ * whitened_;
    rows_ = problem.bounds * R_;
    e_.resizeLike(rows_);
    const Eigen::MatrixXd prior_rows = problem.bounds * inverse_;
    information_use_.resize(slack_size());
    squared_norms(prior_rows, problem.first_row, information_use_);
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
    for (Eigen::Index l = 0; l < lambda_.size(); ++l) {
      const auto at = static_cast<std::size_t>(l);
      row_weight_.segment(problem_.first_row[at], problem_.first_row[at + 1] - problem_.first_row[at])
          .setConstant(lambda_[l]);
    }
    weighted_.noalias() = row_weight_.asDiagonal() * rows_;
    work_.noalias() = rows_.transpose() * weighted_;
    eigen_.compute(work_);
    root_ = eigen_.eigenvalues().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt();
    e_.noalias() = rows_ * eigen_.eigenvectors();
    value_ = lambda_.sum() + gauss_markov_ + lambda_.dot(information_use_) - 2.0 * root_.sum();
    weighted_.noalias() = e_ * root_.cwiseSqrt().cwiseInverse().asDiagonal();
    squared_norms(weighted_, problem_.first_row, use_);
    use_ -= information_use_;
    gradient_ = 1.0 - use_.array();
  }

  /// Mehrotra's predictor-corrector for (Hessian + diag(t / lambda)) d lambda = sigma mu / lambda - gradient.
  void step() {
    bound_gram(
        e_, problem_.first_row,
        [this](Eigen::Index i, Eigen::Index j) {
          return 1.0 / (root_[i] * root_[j] * (root_[i] + root_[j]));
        },
        storage_, hessian_);
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
    work_.noalias() = whitened_ * eigen_.eigenvectors();
    work_ *= root_.cwiseSqrt().cwiseInverse().asDiagonal();
    prior_.setZero(work_.rows(), work_.rows());
    prior_.selfadjointView<Eigen::Lower>().rankUpdate(work_);
    prior_.diagonal().array() -= 1.0;
    // Far from the end V may still lack what it gains later.
    const double slack = relative > kClose ? std::sqrt(relative) : 0.0;
    work_ = prior_;
    work_.diagonal().array() += slack;
    return linalg::Cholesky(work_).info() == Eigen::Success;
  }

  /// V = L L' with the columns of L along the eigenvectors of F V F'. False where V is not positive definite.
  [[nodiscard]] bool extract_prior(ReducedSolution& result) {
    const linalg::SymmetricEigen spectrum(prior_);
    if (!(spectrum.eigenvalues().minCoeff() > 0.0)) {
      return false;
    }
    result.prior_factor = inverse_ * spectrum.eigenvectors();
    result.prior_factor *= spectrum.eigenvalues().cwiseSqrt().asDiagonal();
    result.multipliers = lambda_;
    return true;
  }

  const ReducedProblem& problem_;
  Eigen::MatrixXd inverse_, whitened_, R_, rows_, e_, weighted_, work_, prior_;
  linalg::RepeatedSymmetricEigen eigen_;
  Eigen::MatrixXd hessian_;
  linalg::Cholesky factor_;
  Eigen::MatrixXd storage_;
  Eigen::VectorXd information_use_, use_, lambda_, slack_, gradient_, root_, row_weight_, aim_;
  Eigen::VectorXd d_lambda_, d_slack_, d_lambda_2_, d_slack_2_;
  double gauss_markov_ = 0.0;
  double value_ = 0.0;
  double least_mu_ = 0.0;
};

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
  detail::MultiplierNewton newton(problem);
  return newton.run(settings, observe);
}

}  // namespace trammel::inline TRAMMEL_ABI::minimax
