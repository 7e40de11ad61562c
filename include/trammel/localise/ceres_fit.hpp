// SPDX-License-Identifier: Apache-2.0
/// @file
/// Constrained fits on Ceres: needs the component trammel::ceres. As for every library that was compiled with
/// Eigen, compile with the instruction set that Ceres was compiled with (no -march): Eigen's memory alignment
/// depends on it.
#pragma once

#include <cmath>

#include <Eigen/Core>

#include <ceres/ceres.h>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/localise/fit_problem.hpp"
#include "trammel/localise/levenberg_marquardt.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

namespace detail {

/// F(., mu) but for a constant as half a sum of squares, smooth within the bounds:
///
/// | term of F               | residuals                                  | why                          |
/// |-------------------------|--------------------------------------------|------------------------------|
/// | |r|^2/2                 | r                                          |                              |
/// | -mu ln(1 - |T|^2)       | (2 mu phi(|T|^2))^(1/2) T, T = a_l z       | phi(u) = -ln(1 - u)/u smooth |
/// | -mu (s/n) ln(x_3 - h)   | (2 mu (s/n) ln(R_j/(x_3 - h)))^(1/2)       | R_j above every height tried |
class CeresCost final : public ceres::CostFunction {
 public:
  CeresCost(const FitProblem& problem, const Eigen::VectorXd& start, double mu)
      : problem_(problem), mu_(mu), highest_room_m_(kHighest * room_m(start)) {
    rows_ = 3 * static_cast<Eigen::Index>(problem.scenario().observations.size());
    for (const Eigen::MatrixXd& a : problem.trajectory().problem.ellipsoids) {
      rows_ += a.rows();
    }
    rows_ += highest_room_m_.size();
    set_num_residuals(static_cast<int>(rows_));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(problem.parameters()));
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::VectorXd z = Eigen::Map<const Eigen::VectorXd>(parameters[0], problem_.parameters());
    const Eigen::VectorXd room = room_m(z);
    if (!problem_.inside(z) || (highest_room_m_ - room).array().minCoeff() <= 0.0) {
      return false;
    }
    Eigen::Map<Eigen::VectorXd> out(residuals, rows_);
    const bool derivatives = jacobians != nullptr && jacobians[0] != nullptr;
    Eigen::MatrixXd J(derivatives ? rows_ : 0, z.size());
    Eigen::Index at = 3 * static_cast<Eigen::Index>(problem_.scenario().observations.size());
    try {
      Eigen::MatrixXd A;
      out.head(at) = problem_.residuals(z, derivatives ? &A : nullptr);
      if (derivatives) {
        J.topRows(at) = -A;
      }
    } catch (const Error&) {  // a sensor is not differentiable at this trial point
      return false;
    }
    for (const Eigen::MatrixXd& a : problem_.trajectory().problem.ellipsoids) {
      const Eigen::VectorXd T = a * z;
      const double u = T.squaredNorm();
      const bool small = u < kSmall;
      const double phi = small ? 1 + u / 2 + u * u / 3 : -std::log1p(-u) / u;
      const double slope = small ? 0.5 + 2 * u / 3 : (1 / (1 - u) - phi) / u;
      const double size = std::sqrt(2 * mu_ * phi);
      out.segment(at, a.rows()) = size * T;
      if (derivatives) {
        J.middleRows(at, a.rows()) = size * a + (2 * mu_ * slope / size) * T * (T.transpose() * a);
      }
      at += a.rows();
    }
    if (room.size() > 0) {
      const double weight = floor_weight();
      const Eigen::VectorXd level =
          (2 * weight * (highest_room_m_.array() / room.array()).log()).sqrt().matrix();
      out.tail(room.size()) = level;
      if (derivatives) {
        J.bottomRows(room.size()) =
            (-weight * room.cwiseProduct(level).cwiseInverse()).asDiagonal() * problem_.height_rows();
      }
    }
    if (derivatives) {
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::Map<RowMajor>(jacobians[0], rows_, z.size()) = J;
    }
    return true;
  }

 private:
  static constexpr double kHighest = 100.0;  // times the room above the floor at the start
  static constexpr double kSmall = 1e-4;     // beyond, the series would lose more than the logarithm

  [[nodiscard]] Eigen::VectorXd room_m(const Eigen::VectorXd& z) const {
    return problem_.minimum_height_m()
               ? Eigen::VectorXd(problem_.heights_m(z).array() - *problem_.minimum_height_m())
               : Eigen::VectorXd();
  }
  [[nodiscard]] double floor_weight() const {
    return mu_ * static_cast<double>(problem_.trajectory().coordinates.basis().coefficients()) /
           static_cast<double>(highest_room_m_.size());
  }

  const FitProblem& problem_;
  double mu_;
  Eigen::VectorXd highest_room_m_;  ///< R_j; empty without a floor
  Eigen::Index rows_ = 0;
};

}  // namespace detail

/// Minimises F(., mu) like fit_levenberg_marquardt, by the trust region of Ceres: the same minimum from the
/// same start wherever both end in one valley. `systems` counts its iterations.
/// Throws Error unless `start` is strictly inside.
[[nodiscard]] inline Fit fit_ceres(const FitProblem& problem, const Eigen::VectorXd& start, double mu,
                                   const FitSettings& settings = {}) {
  require(std::isfinite(problem.cost(start, mu)), "start", "a point outside the bounds",
          "a point strictly inside");
  Fit fit{.z = start};
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem model(ownership);
  detail::CeresCost cost(problem, start, mu);
  model.AddResidualBlock(&cost, nullptr, fit.z.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = settings.max_systems;
  options.max_num_consecutive_invalid_steps = settings.max_systems;  // outside the bounds: a shorter step
  // Its test compares the last decrease, ours what a step still promises: linear convergence needs more.
  constexpr double kSharper = 1e-4;
  options.function_tolerance = kSharper * settings.relative_decrease;
  options.gradient_tolerance = 0.0;
  options.parameter_tolerance = 0.0;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &model, &summary);
  fit.systems = static_cast<int>(summary.iterations.size());
  fit.converged = summary.termination_type == ceres::CONVERGENCE;
  fit.cost = problem.cost(fit.z, mu);
  fit.chi2 = problem.chi2(fit.z);
  const Quadratic at = problem.expand(fit.z, mu);
  const linalg::Cholesky cholesky(at.hessian);
  if (cholesky.info() == Eigen::Success) {
    fit.decrement = at.gradient.dot(cholesky.solve(at.gradient)) / 2;
  }
  return fit;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
