// SPDX-License-Identifier: Apache-2.0
/// @file
/// Constrained fits by the Ceres Solver: link the CMake target trammel::ceres.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

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
/// A step that leaves the bounds is evaluated where it is shortened until strictly inside. Where Ceres takes
/// it, it has to begin anew from there. (A ceres::Manifold could shorten it, but has Ceres multiply every
/// Jacobian by a matrix of p x p, and Ceres would take the bounds for a fault of the model.)
class FitResidual final : public ::ceres::CostFunction {
 public:
  /// Throws Error unless `start` is strictly inside.
  FitResidual(const FitProblem& problem, double mu, const Eigen::VectorXd& start)
      : problem_(problem), mu_(mu) {
    at_.z = start;
    at_.cost = problem.cost(start, mu);
    require(std::isfinite(at_.cost), "start", "a point outside the bounds", "a point strictly inside");
    const auto size = static_cast<int>(problem.parameters());
    mutable_parameter_block_sizes()->push_back(size);
    set_num_residuals(size + 1);
    const TrajectoryProblem& trajectory = problem.trajectory();
    constant_ = mu * static_cast<double>(trajectory.problem.ellipsoids.size()) / 2;
    if (problem.minimum_height_m()) {
      constexpr double kRise = 10.0;  // the path may come e^10 times as far above the floor as it starts
      const double floor = at_.cost - problem.chi2(start) / 2 - mu * problem.ellipsoid_barrier(start);
      constant_ += mu * static_cast<double>(trajectory.coordinates.basis().coefficients()) * (0.5 + kRise) +
                   std::max(0.0, -floor);
    }
  }

  /// From now on the squares are those of the decrement.
  void descend_by_decrement() { by_decrement_ = true; }
  [[nodiscard]] bool by_decrement() const { return by_decrement_; }
  /// The last point whose derivatives Ceres asked for, which is where it stands; `systems` counts
  /// factorisations.
  [[nodiscard]] const Fit& at() const { return at_; }
  /// Whether the step there was shortened: Ceres stands elsewhere.
  [[nodiscard]] bool shortened_step() const { return shortened_step_; }

  /// False, which Ceres takes as a step too long, where F is infinite.
  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Index size = problem_.parameters();
    const Eigen::Map<const Eigen::VectorXd> x(parameters[0], size);
    const Eigen::VectorXd step = shortened(problem_, at_.z, x - at_.z);
    const Eigen::VectorXd z = at_.z + step;
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
      shortened_step_ = step != x - at_.z;
      at_.z = z;
      at_.cost = cost_;
      at_.decrement = definite_ ? squares / 2 : std::numeric_limits<double>::infinity();
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
    Quadratic local = problem_.expand(z, mu_);
    cost_ = local.cost;
    factored_at_ = z;
    if (!std::isfinite(cost_)) {
      return false;
    }
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
    return true;
  }

  const FitProblem& problem_;
  double mu_ = 0.0;
  double constant_ = 0.0;
  bool by_decrement_ = false;
  // Ceres evaluates without changing its functions; what it asked for last is kept here.
  mutable Fit at_;
  mutable bool shortened_step_ = false;
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
    const double radius = std::exchange(radius_, now.trust_region_radius);
    if (now.step_is_successful) {
      converged_ = at.decrement <= enough(settings_, at.cost);
      constexpr double kUndamped = 0.0;
      given_up_ = !converged_ && (hopeless(settings_, at.cost, at.decrement, kUndamped) ||
                                  (settings_.stop && settings_.stop(at.z)));
      const bool rounded = !residual_.by_decrement() && at.decrement <= rounding_slack(at.cost);
      if (residual_.shortened_step()) {
        radius_ = std::min(radius / kLess, 1 / kLeastDamping);
      }
      if (converged_ || given_up_ || rounded || residual_.shortened_step()) {
        return SOLVER_TERMINATE_SUCCESSFULLY;
      }
    }
    return solved_ + now.iteration + at.systems < settings_.max_systems ? SOLVER_CONTINUE : SOLVER_ABORT;
  }

  /// After a descent of so many linear systems.
  void add(int systems) { solved_ += systems; }

  /// What the next descent begins with: after a shortened step as the built-in method goes on.
  [[nodiscard]] double radius() const { return radius_; }
  [[nodiscard]] bool converged() const { return converged_; }
  /// Converged, given up (or told to stop) or spent.
  [[nodiscard]] bool ended() const { return converged_ || given_up_ || systems() >= settings_.max_systems; }
  [[nodiscard]] int systems() const { return solved_ + residual_.at().systems; }

 private:
  const FitResidual& residual_;
  const FitSettings& settings_;
  double radius_ = 1 / kFirstDamping;
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
  options.initial_trust_region_radius = watch.radius();
  options.max_trust_region_radius = 1 / kLeastDamping;
  options.min_trust_region_radius = 1 / kMostDamping;
  options.min_relative_decrease = 0.0;
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

/// Minimises F(., mu) from `start` by the trust region method of the Ceres Solver (Agarwal, Mierle and
/// others, version 2.1), with the Hessian and the stopping rules of fit_levenberg_marquardt: the same minimum
/// where there is only one nearby. Steps are shortened until strictly inside the bounds and above the floor;
/// where F cannot tell steps apart any more the decrement does. Prints nothing. `systems` counts the systems
/// that Ceres solves and the factorisations that it is given. Throws Error unless `start` is strictly inside.
[[nodiscard]] inline Fit fit_ceres(const FitProblem& problem, const Eigen::VectorXd& start, double mu,
                                   const FitSettings& settings = {}) {
  detail::FitResidual residual(problem, mu, start);
  detail::FitWatch watch(residual, settings);
  ::ceres::Problem::Options kept;
  kept.cost_function_ownership = ::ceres::DO_NOT_TAKE_OWNERSHIP;
  ::ceres::Problem descent(kept);
  Eigen::VectorXd x = start;
  descent.AddResidualBlock(&residual, nullptr, x.data());
  const Fit& at = residual.at();
  bool again = true;
  while (again) {
    x = at.z;
    ::ceres::Solver::Summary summary;
    ::ceres::Solve(detail::ceres_options(watch, settings), &descent, &summary);
    watch.add(std::max(0, summary.num_linear_solves));
    again = !watch.ended() && residual.shortened_step();
    if (!watch.ended() && !residual.by_decrement() && at.decrement <= detail::rounding_slack(at.cost)) {
      residual.descend_by_decrement();
      again = true;
    }
  }
  Fit fit = residual.at();
  fit.chi2 = problem.chi2(fit.z);
  fit.systems = watch.systems();
  fit.converged = watch.converged();
  return fit;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
