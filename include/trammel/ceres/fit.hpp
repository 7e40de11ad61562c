// SPDX-License-Identifier: Apache-2.0
/// @file
/// Constrained fits by the Ceres Solver: link the CMake target trammel::ceres.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <ceres/ceres.h>
#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/localise/fit.hpp"
#include "trammel/localise/fit_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

namespace detail {

/// F as a sum of squares with the gradient g and the Hessian H = L L' of FitProblem::expand:
///
///   f = (L^-1 g, rest), J = (L', 0), rest^2 = 2 (F + constant) - |L^-1 g|^2,
///
/// hence J'f = g, J'J = H and |f|^2/2 = F + constant: barriers and floor are exact, and a linear system costs
/// the same however many measurements there are. The constant makes room for the square: |L^-1 g|^2 is at
/// most |r|^2 + mu (number of bounds + s), as -ln(1 - |x|^2) and -ln x are self-concordant barriers of
/// parameter 1 (Nesterov, Nemirovskii, 1994, section 2.3). Without `rest` half the sum of squares is the
/// decrement g'H^-1 g/2, which tells steps apart where rounding hides what they change in F.
///
/// A step that leaves the bounds is shortened until strictly inside. Ceres takes it as made in full: its
/// variable x and the deviation z = x + shift part there. (A ceres::Manifold can say the same, but has Ceres
/// multiply every Jacobian by a matrix of p x p.)
class FitResidual final : public ::ceres::CostFunction {
 public:
  /// Throws Error unless `start` is strictly inside.
  FitResidual(const FitProblem& problem, double mu, const Eigen::VectorXd& start)
      : problem_(problem), mu_(mu) {
    at_.z = start;
    shift_ = Eigen::VectorXd::Zero(start.size());
    at_.cost = problem.cost(start, mu);
    require(std::isfinite(at_.cost), "start", "a point outside the bounds", "a point strictly inside");
    const auto size = static_cast<int>(problem.parameters());
    mutable_parameter_block_sizes()->push_back(size);
    set_num_residuals(size + 1);
    const TrajectoryProblem& trajectory = problem.trajectory();
    constant_ = mu * static_cast<double>(trajectory.problem.ellipsoids.size()) / 2;
    if (problem.minimum_height_m()) {
      constexpr double kRise =
          10.0;  // ln of how many times as far above the floor as the start a path may be
      const double floor = at_.cost - problem.chi2(start) / 2 - mu * problem.ellipsoid_barrier(start);
      constant_ += mu * static_cast<double>(trajectory.coordinates.basis().coefficients()) * (0.5 + kRise) +
                   std::max(0.0, -floor);
    }
  }

  /// From now on the squares are those of the decrement. Begin at x = at().z.
  void descend_by_decrement() {
    by_decrement_ = true;
    shift_.setZero();
  }
  [[nodiscard]] bool by_decrement() const { return by_decrement_; }
  /// The last point whose derivatives Ceres asked for, which is where it stands; `systems` counts
  /// factorisations.
  [[nodiscard]] const Fit& at() const { return at_; }

  /// False, which Ceres takes as a step too long, where F is infinite.
  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Index size = problem_.parameters();
    const Eigen::Map<const Eigen::VectorXd> x(parameters[0], size);
    const Eigen::VectorXd z = at_.z + shortened(problem_, at_.z, x + shift_ - at_.z);
    Eigen::Map<Eigen::VectorXd> f(residuals, size + 1);
    f.setZero();
    if (jacobians == nullptr && !by_decrement_) {
      const double cost = problem_.cost(z, mu_);
      f(size) = rest(cost, 0.0);
      return std::isfinite(cost);
    }
    if (!factor(z)) {
      return false;
    }
    f.head(size) = whitened_;
    const double squares = whitened_.squaredNorm();
    f(size) = by_decrement_ ? 0.0 : rest(cost_, squares);
    if (jacobians != nullptr) {
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::Map<RowMajor> J(jacobians[0], size + 1, size);
      J.topRows(size) = factor_;
      J.row(size).setZero();
      at_.z = z;
      at_.cost = cost_;
      at_.decrement = definite_ ? squares / 2 : std::numeric_limits<double>::infinity();
      shift_ = z - x;
    }
    return true;
  }

 private:
  /// What squares and rest^2 add up to is 2 (F + constant); rounding may leave no room far from the minimum.
  [[nodiscard]] double rest(double cost, double squares) const {
    return std::sqrt(std::max(0.0, 2 * (cost + constant_) - squares));
  }

  /// Sets F, L' and L^-1 g at z; false where a sensor is not differentiable.
  bool factor(const Eigen::VectorXd& z) const {
    if (factored_at_.size() == z.size() && factored_at_ == z) {
      return std::isfinite(cost_);
    }
    Quadratic local;
    try {
      local = problem_.expand(z, mu_);
    } catch (const Error&) {
      return false;
    }
    cost_ = local.cost;
    factored_at_ = z;
    definite_ = true;
    constexpr double kMore = 10.0;
    const Eigen::VectorXd diagonal = local.hessian.diagonal();
    const Eigen::VectorXd most = diagonal.cwiseMax(kLeastDamping * diagonal.maxCoeff());
    linalg::Cholesky cholesky(local.hessian);
    ++at_.systems;
    for (double damping = kLeastDamping; cholesky.info() != Eigen::Success && damping < kMostDamping;
         damping *= kMore) {  // some parameters are held by neither bounds nor measurements
      definite_ = false;
      local.hessian.diagonal() = diagonal + damping * most;
      cholesky.compute(local.hessian);
      ++at_.systems;
    }
    factor_ = cholesky.matrixU();
    whitened_ = cholesky.matrixL().solve(local.gradient);
    return std::isfinite(cost_);
  }

  const FitProblem& problem_;
  double mu_ = 0.0;
  double constant_ = 0.0;
  bool by_decrement_ = false;
  // Ceres evaluates without changing its functions; what it asked for last is kept here.
  mutable Fit at_;
  mutable Eigen::VectorXd shift_;
  mutable Eigen::VectorXd factored_at_;
  mutable double cost_ = 0.0;
  mutable Eigen::MatrixXd factor_;
  mutable Eigen::VectorXd whitened_;
  mutable bool definite_ = false;
};

/// Ends a descent by the rules of the built-in method.
class FitWatch final : public ::ceres::IterationCallback {
 public:
  FitWatch(const FitResidual& residual, const FitSettings& settings)
      : residual_(residual), settings_(settings) {}

  ::ceres::CallbackReturnType operator()(const ::ceres::IterationSummary& now) override {
    using enum ::ceres::CallbackReturnType;
    const Fit& at = residual_.at();
    if (now.step_is_successful) {
      converged_ = at.decrement <= enough(settings_, at.cost);
      const double damping = 1 / now.trust_region_radius;
      given_up_ = !converged_ && hopeless(settings_, at.cost, at.decrement, damping);
      const bool rounded = !residual_.by_decrement() && at.decrement <= rounding_slack(at.cost);
      if (converged_ || given_up_ || rounded) {
        return SOLVER_TERMINATE_SUCCESSFULLY;
      }
    }
    return solved_ + now.iteration + at.systems < settings_.max_systems ? SOLVER_CONTINUE : SOLVER_ABORT;
  }

  /// After a descent of so many linear systems.
  void add(int systems) { solved_ += systems; }

  [[nodiscard]] bool converged() const { return converged_; }
  [[nodiscard]] bool given_up() const { return given_up_; }
  [[nodiscard]] int systems() const { return solved_ + residual_.at().systems; }

 private:
  const FitResidual& residual_;
  const FitSettings& settings_;
  int solved_ = 0;
  bool converged_ = false;
  bool given_up_ = false;
};

/// Ceres' own rules never end a descent before FitWatch does, save where no step is left.
inline ::ceres::Solver::Options ceres_options(FitWatch& watch, const FitSettings& settings) {
  ::ceres::Solver::Options options;
  options.minimizer_type = ::ceres::TRUST_REGION;
  options.trust_region_strategy_type = ::ceres::LEVENBERG_MARQUARDT;
  options.linear_solver_type = ::ceres::DENSE_NORMAL_CHOLESKY;
  options.initial_trust_region_radius = 1 / kFirstDamping;
  options.max_trust_region_radius = 1 / kLeastDamping;
  options.min_trust_region_radius = 1 / kMostDamping;
  options.min_lm_diagonal = std::numeric_limits<double>::min();
  options.max_num_iterations = settings.max_systems;
  options.max_num_consecutive_invalid_steps = settings.max_systems;
  options.function_tolerance = 0.0;
  options.gradient_tolerance = 0.0;
  options.parameter_tolerance = 0.0;
  options.logging_type = ::ceres::SILENT;
  options.callbacks.push_back(&watch);
  return options;
}

}  // namespace detail

/// The same minimum as fit_levenberg_marquardt finds, by the trust region method of the Ceres Solver
/// (Agarwal, Mierle and others): F and its derivatives are handed over as one block of residuals
/// (detail::FitResidual), steps that leave the bounds or the floor are refused. The search falls back on the
/// decrement where F cannot tell any more. Stops and throws as fit_levenberg_marquardt does; `systems` counts
/// the linear systems that Ceres solved and the factorisations that they are made from.
[[nodiscard]] inline Fit fit_ceres(const FitProblem& problem, const Eigen::VectorXd& start, double mu,
                                   const FitSettings& settings = {}) {
  detail::FitResidual residual(problem, mu, start);
  detail::FitWatch watch(residual, settings);
  const ::ceres::Solver::Options options = detail::ceres_options(watch, settings);
  ::ceres::Problem::Options kept;
  kept.cost_function_ownership = ::ceres::DO_NOT_TAKE_OWNERSHIP;
  ::ceres::Problem descent(kept);
  Eigen::VectorXd z = start;
  descent.AddResidualBlock(&residual, nullptr, z.data());
  const auto run = [&] {
    z = residual.at().z;
    ::ceres::Solver::Summary summary;
    ::ceres::Solve(options, &descent, &summary);
    watch.add(std::max(0, summary.num_linear_solves));
  };
  run();
  const Fit& at = residual.at();
  const double slack = detail::rounding_slack(at.cost);
  if (!watch.converged() && !watch.given_up() && at.decrement <= slack) {
    residual.descend_by_decrement();
    run();
  }
  Fit fit = residual.at();
  fit.chi2 = problem.chi2(fit.z);
  fit.systems = watch.systems();
  fit.converged = watch.converged();
  return fit;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
