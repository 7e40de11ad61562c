// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of local_window.hpp.
#pragma once

#include <cmath>
#include <utility>

#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/minimax/newton_multipliers.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/trajectory/criterion_factor.hpp"
#include "trammel/window/local_window.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

namespace local_window_detail {

/// The start of a window inside the flight is bounded by this many standard deviations of what its
/// measurements say: hardly at all.
inline constexpr double kWeak = 30.0;
/// M^-1/2 is replaced by (M + e^2 I)^-1/2, e this share of the mean of M^1/2: see solve_windows. From 0.005
/// to 0.02 the certified interval hardly changes.
inline constexpr double kSmooth = 0.01;
/// V may lack this share of its size without counting as indefinite; the joint V is repaired afterwards.
inline constexpr double kIndefinite = 1e-3;

}  // namespace local_window_detail

TRAMMEL_INLINE LocalWindow::LocalWindow(const BandedProblem& problem, const WindowRange& range)
    : range_(range), segments_(problem.segments()) {
  const Eigen::Index count = range.behind - range.first;
  const Eigen::Index p = 3 * (count + 2);
  information_ = problem.measurements.part(range.first, count).reduce().factor;
  inverse_.setIdentity(p, p);
  information_.triangularView<Eigen::Upper>().solveInPlace(inverse_);
  criterion_ = trajectory::for_three_axes(problem.criterion_rows.part(range.first, count).reduce().factor);
  first_bound_ = range.first == 0 ? 0 : range.first + 2;
  bound_rows_ =
      problem.bounds.block(3 * first_bound_, 3 * range.first, 3 * (range.behind + 2 - first_bound_), p);
  const trajectory::SplineBasis& basis = problem.trajectory.coordinates.basis();
  const trajectory::LocalBasis<double> start = basis.on_segment(range.first, basis.knot(range.first));
  start_rows_ = Eigen::MatrixXd::Zero(6, p);
  for (Eigen::Index k = 0; k < 3; ++k) {
    start_rows_.block<3, 3>(0, 3 * k).diagonal().setConstant(start.value(k));
    start_rows_.block<3, 3>(3, 3 * k).diagonal().setConstant(start.rate(k));
  }
}

TRAMMEL_INLINE Eigen::Index LocalWindow::core_first() const noexcept {
  return range_.core_first == 0 ? 0 : range_.core_first + 1;
}

TRAMMEL_INLINE Eigen::Index LocalWindow::core_behind() const noexcept {
  return range_.core_behind == segments_ ? segments_ + 2 : range_.core_behind + 1;
}

TRAMMEL_INLINE Eigen::Index LocalWindow::core_bound_first() const noexcept {
  return range_.core_first == 0 ? 0 : range_.core_first + 2;
}

TRAMMEL_INLINE std::vector<Eigen::Index> LocalWindow::finite_rows(Eigen::Index l) const {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 3 * l; i < 3 * l + 3; ++i) {
    if (!bound_rows_.row(i).isZero(0.0)) {
      rows.push_back(i);
    }
  }
  return rows;
}

TRAMMEL_INLINE std::pair<GuaranteedProblem, std::vector<Eigen::Index>> LocalWindow::weakly_bounded() const {
  GuaranteedProblem problem{
      .information_factor = information_, .criterion_factor = criterion_, .ellipsoids = {}};
  std::vector<Eigen::Index> places;
  for (Eigen::Index l = 0; l < bounds(); ++l) {
    const std::vector<Eigen::Index> rows = finite_rows(l);
    places.push_back(rows.empty() ? -1 : static_cast<Eigen::Index>(problem.ellipsoids.size()));
    if (!rows.empty()) {
      problem.ellipsoids.emplace_back(bound_rows_(rows, Eigen::all));
    }
  }
  if (first_bound_ > 0) {
    for (const Eigen::Index at : {0, 3}) {
      const Eigen::MatrixXd rows = start_rows_.middleRows(at, 3);
      const double deviation = (rows * inverse_).norm() / std::sqrt(3.0);
      problem.ellipsoids.emplace_back(rows / (local_window_detail::kWeak * deviation));
    }
  }
  return {std::move(problem), std::move(places)};
}

TRAMMEL_INLINE Eigen::VectorXd LocalWindow::per_bound(const std::vector<Eigen::Index>& places,
                                                      const Eigen::VectorXd& multipliers) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(bounds());
  for (Eigen::Index l = 0; l < bounds(); ++l) {
    if (const Eigen::Index place = places[static_cast<std::size_t>(l)]; place >= 0) {
      result(l) = multipliers(place);
    }
  }
  return result;
}

TRAMMEL_INLINE WindowMultipliers LocalWindow::solve(const minimax::SolverSettings& settings) const {
  const auto [problem, places] = weakly_bounded();
  WindowMultipliers result;
  if (const std::optional<minimax::ReducedProblem> direct = minimax::directly_observed(problem)) {
    const minimax::ReducedSolution near = minimax::solve_in_multipliers(*direct, settings, {});
    result.iterations = near.iterations;
    if (near.status == SolveStatus::kOptimal) {
      result.multipliers = per_bound(places, near.multipliers);
    }
  }
  return result;
}

TRAMMEL_INLINE WindowMultipliers LocalWindow::solve_fully(const minimax::SolverSettings& settings) const {
  const auto [problem, places] = weakly_bounded();
  const minimax::Solution solution = minimax::solve(problem, settings);
  const Eigen::MatrixXd moved = bound_rows_ * solution.prior_factor;
  return {.multipliers = per_bound(places, solution.multipliers),
          .moments = moved * moved.transpose(),
          .iterations = solution.iterations};
}

TRAMMEL_INLINE std::optional<EstimatorRows> LocalWindow::from_multipliers(const Eigen::VectorXd& root) const {
  std::vector<Eigen::Index> finite;
  for (Eigen::Index l = 0; l < bounds(); ++l) {
    for (const Eigen::Index row : finite_rows(l)) {
      finite.push_back(row);
    }
  }
  const Eigen::MatrixXd D = bound_rows_(finite, Eigen::all);
  const Eigen::VectorXd weight = root(finite);
  const Eigen::MatrixXd seen = inverse_.transpose() * D.transpose();     // F^-T D'
  const Eigen::MatrixXd spread = inverse_ * seen * weight.asDiagonal();  // J^-1 D' Lambda^1/2
  const Eigen::MatrixXd rows = criterion_ * spread;
  const linalg::SymmetricEigen eigen(rows.transpose() * rows);
  if (eigen.info() != Eigen::Success || !(eigen.eigenvalues()(0) > 0.0)) {
    return std::nullopt;
  }
  const Eigen::MatrixXd& Q = eigen.eigenvectors();
  const Eigen::VectorXd size = eigen.eigenvalues().cwiseSqrt();
  const Eigen::VectorXd inverse_weight = weight.cwiseInverse();
  Eigen::MatrixXd moments = Q * size.asDiagonal() * Q.transpose();
  moments = inverse_weight.asDiagonal() * moments * inverse_weight.asDiagonal();
  moments.noalias() -= seen.transpose() * seen;
  Eigen::MatrixXd shifted = moments;
  shifted.diagonal().array() += local_window_detail::kIndefinite;
  if (linalg::Cholesky(shifted).info() != Eigen::Success) {
    return std::nullopt;
  }
  const double floor = local_window_detail::kSmooth * size.mean();
  const Eigen::VectorXd smoothed = (size.array().square() + floor * floor).rsqrt();
  const Eigen::Index row = 3 * (core_first() - first());
  const Eigen::Index count = 3 * (core_behind() - core_first());
  EstimatorRows result;
  result.bias = Eigen::MatrixXd::Zero(count, bound_rows_.rows());
  result.bias(Eigen::all, finite) =
      -(spread.middleRows(row, count) * Q * smoothed.asDiagonal()) * Q.transpose();
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(bound_rows_.rows(), bound_rows_.rows());
  all(finite, finite) = moments;
  result.moments =
      all.middleRows(3 * (core_bound_first() - first_bound_), 3 * (core_bound_behind() - core_bound_first()));
  return result;
}

TRAMMEL_INLINE PriorRows LocalWindow::from_moments(const Eigen::MatrixXd& moments) const {
  const Eigen::MatrixXd precise = linalg::Cholesky(moments).solve(bound_rows_);  // V^-1 D
  Eigen::MatrixXd joint = bound_rows_.transpose() * precise;
  joint.noalias() += information_.transpose() * information_;
  const Eigen::Index row = 3 * (core_first() - first());
  const Eigen::Index count = 3 * (core_behind() - core_first());
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(joint.rows(), joint.rows());
  const Eigen::MatrixXd columns = linalg::Cholesky(joint).solve(identity.middleCols(row, count));
  return {.posterior = columns.transpose(), .image = (precise * columns).transpose()};
}

}  // namespace trammel::inline TRAMMEL_ABI::window
