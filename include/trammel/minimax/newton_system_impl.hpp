// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of newton_system.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "trammel/minimax/bound_gram.hpp"
#include "trammel/minimax/newton_system.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

namespace detail {

inline void symmetrise(Eigen::MatrixXd& matrix) {
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    for (Eigen::Index i = j + 1; i < matrix.rows(); ++i) {
      const double mean = 0.5 * (matrix(i, j) + matrix(j, i));
      matrix(i, j) = mean;
      matrix(j, i) = mean;
    }
  }
}

}  // namespace detail

TRAMMEL_INLINE NewtonSystem::NewtonSystem(const ReducedProblem& problem)
    : first_row_(&problem.first_row),
      eigen_(problem.size()),
      woodbury_(static_cast<Eigen::Index>(problem.ellipsoids())) {
  const Eigen::Index q = problem.size();
  const auto s = static_cast<Eigen::Index>(problem.ellipsoids());
  const Eigen::Index rows = problem.bounds.rows();
  for (Eigen::MatrixXd* matrix :
       {&T_, &Q_, &G_, &N_, &den_, &residual_, &direction_, &image_, &z_, &X_, &work_, &work2_}) {
    matrix->setZero(q, q);
  }
  for (Eigen::MatrixXd* matrix : {&h_, &weighted_h_, &product_}) {
    matrix->setZero(rows, q);
  }
  for (Eigen::VectorXd* vector : {&weight_, &root_, &rho_, &y_direction_, &y_z_}) {
    vector->setZero(s);
  }
  row_weight_.setZero(rows);
  score_.setZero(q);
  order_.setZero(q);
  gram_.setZero(s, s);
  chunk_ = bound_gram_storage(s, q);
  if (q <= kDenseLimit) {
    dense_.setZero(q * (q + 1) / 2, q * (q + 1) / 2);
    packed_.setZero(q * (q + 1) / 2);
  }
}

TRAMMEL_INLINE void NewtonSystem::set_up(const ReducedProblem& problem, const PriorState& state, double mu,
                                         const Eigen::VectorXd& weight) {
  first_row_ = &problem.first_row;
  mu_ = mu;
  weight_ = weight;
  root_ = weight.cwiseSqrt();
  choose_basis(state, mu);
  diagonalise_range();
  h_.noalias() = state.bounds * T_;
  if (dense()) {
    set_up_dense_base();
  } else {
    set_up_base();
  }
  set_up_woodbury();
}

TRAMMEL_INLINE void NewtonSystem::choose_basis(const PriorState& state, double mu) {
  const double q_norm = state.curvature.norm();
  const double g_norm = state.gradient.norm();
  work_ = state.curvature * (q_norm > 0.0 ? 1.0 / q_norm : 0.0);
  work_ += state.gradient * (g_norm > 0.0 ? 1.0 / g_norm : 0.0);
  eigen_.compute(work_);
  const Eigen::MatrixXd& U = eigen_.eigenvectors();
  work_.noalias() = state.curvature * U;
  work2_.noalias() = state.gradient * U;
  for (Eigen::Index i = 0; i < score_.size(); ++i) {
    score_[i] = std::max(U.col(i).dot(work_.col(i)), 0.0) * std::max(U.col(i).dot(work2_.col(i)), 0.0);
    order_[i] = static_cast<int>(i);
  }
  std::sort(order_.data(), order_.data() + order_.size(),
            [this](int a, int b) { return score_[a] > score_[b] || (score_[a] == score_[b] && a < b); });
  range_ = 0;
  while (range_ < score_.size() && 2.0 * score_[order_[range_]] > mu) {
    ++range_;
  }
  for (Eigen::Index i = 0; i < order_.size(); ++i) {
    T_.col(i) = U.col(order_[i]);
  }
  work_.noalias() = state.curvature * T_;
  Q_.noalias() = T_.transpose() * work_;
  work_.noalias() = state.gradient * T_;
  G_.noalias() = T_.transpose() * work_;
}

TRAMMEL_INLINE void NewtonSystem::diagonalise_range() {
  N_.setIdentity();
  const Eigen::Index k = range_;
  const Eigen::Index q = T_.rows();
  if (k == 0) {
    return;
  }
  auto triangle = work2_.topLeftCorner(k, k);
  // Where the criterion sees less than the range, G is singular there: shifted just enough to factorise.
  double shift = std::numeric_limits<double>::epsilon() * G_.topLeftCorner(k, k).trace();
  constexpr double kRaise = 10.0;
  while (true) {
    triangle = G_.topLeftCorner(k, k);
    triangle.diagonal().array() += shift;
    Eigen::Ref<Eigen::MatrixXd> target(triangle);
    if (linalg::InPlaceCholesky(target).info() == Eigen::Success || !(shift < G_.norm())) {
      break;
    }
    shift *= kRaise;
  }
  // Eigenvectors of Lg^-1 Q Lg^-T in the lower right block; the upper left one is padded with negative
  // numbers, so that the solver always has one size and the wanted eigenvalues come last.
  work_.setZero();
  auto pencil = work_.bottomRightCorner(k, k);
  pencil = Q_.topLeftCorner(k, k);
  triangle.triangularView<Eigen::Lower>().solveInPlace(pencil);
  triangle.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(pencil);
  const double size = std::max(pencil.cwiseAbs().maxCoeff(), std::numeric_limits<double>::min());
  for (Eigen::Index i = 0; i < q - k; ++i) {
    work_(i, i) = -size * (1.0 + static_cast<double>(i) / static_cast<double>(q));
  }
  eigen_.compute(work_);
  auto X = z_.topLeftCorner(k, k);
  X = eigen_.eigenvectors().bottomRightCorner(k, k);
  triangle.triangularView<Eigen::Lower>().transpose().solveInPlace(X);
  for (Eigen::Index j = 0; j < k; ++j) {
    X.col(j) /= X.col(j).norm();
  }
  N_.topLeftCorner(k, k).noalias() = X.transpose() * X;
  work_.leftCols(k).noalias() = T_.leftCols(k) * X;
  T_.leftCols(k) = work_.leftCols(k);
  for (Eigen::MatrixXd* matrix : {&Q_, &G_}) {
    work_.leftCols(k).noalias() = matrix->leftCols(k) * X;
    matrix->leftCols(k) = work_.leftCols(k);
    work_.topRows(k).noalias() = X.transpose() * matrix->topRows(k);
    matrix->topRows(k) = work_.topRows(k);
  }
}

TRAMMEL_INLINE void NewtonSystem::set_up_base() {
  const Eigen::Index q = T_.rows();
  for (Eigen::Index j = 0; j < q; ++j) {
    for (Eigen::Index i = 0; i < q; ++i) {
      den_(i, j) = mu_ * N_(i, i) * N_(j, j) + std::max(Q_(i, i), 0.0) * std::max(G_(j, j), 0.0) +
                   std::max(G_(i, i), 0.0) * std::max(Q_(j, j), 0.0);
    }
  }
}

TRAMMEL_INLINE void NewtonSystem::set_up_dense_base() {
  const Eigen::Index q = T_.rows();
  Eigen::Index column = 0;
  for (Eigen::Index j = 0; j < q; ++j) {
    for (Eigen::Index i = j; i < q; ++i, ++column) {
      X_.setZero();
      X_(i, j) = i == j ? 1.0 : std::sqrt(0.5);
      X_(j, i) = X_(i, j);
      apply_base(X_, image_);
      Eigen::Index row = 0;
      for (Eigen::Index b = 0; b < q; ++b) {
        for (Eigen::Index a = b; a < q; ++a, ++row) {
          dense_(row, column) = a == b ? image_(a, a) : std::sqrt(2.0) * image_(a, b);
        }
      }
    }
  }
  Eigen::Ref<Eigen::MatrixXd> target(dense_);
  const linalg::InPlaceCholesky factorised(target);  // positive definite by construction, mu > 0
}

TRAMMEL_INLINE void NewtonSystem::solve_base(const Eigen::MatrixXd& rhs, Eigen::MatrixXd& z) {
  if (!dense()) {
    z = rhs.cwiseQuotient(den_);
    return;
  }
  const Eigen::Index q = T_.rows();
  Eigen::Index row = 0;
  for (Eigen::Index b = 0; b < q; ++b) {
    for (Eigen::Index a = b; a < q; ++a, ++row) {
      packed_[row] = a == b ? rhs(a, a) : std::sqrt(0.5) * (rhs(a, b) + rhs(b, a));
    }
  }
  dense_.triangularView<Eigen::Lower>().solveInPlace(packed_);
  dense_.triangularView<Eigen::Lower>().transpose().solveInPlace(packed_);
  row = 0;
  for (Eigen::Index b = 0; b < q; ++b) {
    for (Eigen::Index a = b; a < q; ++a, ++row) {
      z(a, b) = a == b ? packed_[row] : std::sqrt(0.5) * packed_[row];
      z(b, a) = z(a, b);
    }
  }
}

TRAMMEL_INLINE void NewtonSystem::set_up_woodbury() {
  const Eigen::Index s = weight_.size();
  if (dense()) {
    for (Eigen::Index l = 0; l < s; ++l) {
      y_z_.setZero();
      y_z_[l] = 1.0;
      bound_terms(y_z_, work_);
      solve_base(work_, image_);
      bound_products(image_, y_direction_);
      gram_.col(l) = y_direction_;
    }
  } else {
    bound_gram(
        h_, *first_row_, [this](Eigen::Index i, Eigen::Index j) { return 1.0 / den_(i, j); }, chunk_, gram_);
  }
  for (Eigen::Index j = 0; j < s; ++j) {
    for (Eigen::Index i = j; i < s; ++i) {
      gram_(i, j) *= root_[i] * root_[j];
    }
    gram_(j, j) += 1.0;
  }
  woodbury_.compute(gram_);
}

/// (z_, y_z_) = the preconditioner's answer to the residual (residual_, rho_): z = base^-1 (R + sum eta_l
/// h_l), y = rho - eta, (W^-1 + Gram) eta = W^-1 rho - h(base^-1 R).
TRAMMEL_INLINE void NewtonSystem::precondition() {
  solve_base(residual_, z_);
  bound_products(z_, y_z_);
  y_z_ = rho_.cwiseQuotient(weight_) - y_z_;
  y_z_.array() *= root_.array();
  woodbury_.solveInPlace(y_z_);
  y_z_.array() *= root_.array();
  bound_terms(y_z_, work_);
  solve_base(work_, work2_);
  z_ += work2_;
  y_z_ = rho_ - y_z_;
}

/// |R + sum rho_l h_l|.
TRAMMEL_INLINE double NewtonSystem::residual_norm() {
  bound_terms(rho_, work_);
  work_ += residual_;
  return work_.norm();
}

TRAMMEL_INLINE void NewtonSystem::apply_base(const Eigen::MatrixXd& X, Eigen::MatrixXd& out) {
  work_.noalias() = Q_ * X;
  work2_.noalias() = work_ * G_;
  out = work2_ + work2_.transpose();
  const Eigen::Index k = range_;
  work_ = X;
  if (k > 0) {
    work2_.topRows(k).noalias() = N_.topLeftCorner(k, k) * X.topRows(k);
    work_.topRows(k) = work2_.topRows(k);
    work2_.leftCols(k).noalias() = work_.leftCols(k) * N_.topLeftCorner(k, k);
    work_.leftCols(k) = work2_.leftCols(k);
  }
  out += mu_ * work_;
}

TRAMMEL_INLINE void NewtonSystem::bound_terms(const Eigen::VectorXd& y, Eigen::MatrixXd& out) {
  per_row(y, *first_row_, row_weight_);
  weighted_h_.noalias() = row_weight_.asDiagonal() * h_;
  out.noalias() = h_.transpose() * weighted_h_;
}

TRAMMEL_INLINE void NewtonSystem::bound_products(const Eigen::MatrixXd& X, Eigen::VectorXd& out) {
  product_.noalias() = h_ * X;
  for (Eigen::Index l = 0; l < out.size(); ++l) {
    const auto at = static_cast<std::size_t>(l);
    const Eigen::Index first = (*first_row_)[at];
    const Eigen::Index rows = (*first_row_)[at + 1] - first;
    out[l] = h_.middleRows(first, rows).cwiseProduct(product_.middleRows(first, rows)).sum();
  }
}

TRAMMEL_INLINE double NewtonSystem::solve(const Eigen::MatrixXd& rhs, const Eigen::VectorXd& rho,
                                          Tolerance tolerance, Eigen::MatrixXd& D, Eigen::VectorXd& y) {
  constexpr int kMostSteps = 400;  // the hardest cases take most of them
  work_.noalias() = rhs * T_;
  residual_.noalias() = T_.transpose() * work_;
  detail::symmetrise(residual_);
  rho_ = rho;
  X_.setZero();
  y.setZero();
  double squared_step = 0.0;
  const auto inner = [this] {  // <residual, z>; <h_l, z> is y_z / w exactly
    return residual_.cwiseProduct(z_).sum() + (rho_.array() * y_z_.array() / weight_.array()).sum();
  };
  precondition();
  direction_ = z_;
  y_direction_ = y_z_;
  double rz = inner();
  const double start = rz;
  converged_ = false;
  for (int step = 0; step < kMostSteps; ++step) {
    const double left = residual_norm();
    if ((rz <= tolerance.relative * tolerance.relative * start && left <= tolerance.most) ||
        left <= tolerance.enough) {
      converged_ = true;
      break;
    }
    if (!(rz > 0.0)) {  // rounding errors have the upper hand
      break;
    }
    apply_base(direction_, image_);
    const double curvature =
        direction_.cwiseProduct(image_).sum() + (y_direction_.array().square() / weight_.array()).sum();
    const double length = rz / curvature;
    X_ += length * direction_;
    y += length * y_direction_;
    residual_ -= length * image_;
    rho_ -= length * y_direction_;
    squared_step += length * rz;
    precondition();
    const double next = inner();
    const double ratio = next / rz;
    direction_ = z_ + ratio * direction_;
    y_direction_ = y_z_ + ratio * y_direction_;
    rz = next;
    ++steps_;
  }
  work_.noalias() = X_ * T_.transpose();
  D.noalias() = T_ * work_;
  detail::symmetrise(D);
  return squared_step;
}

}  // namespace trammel::inline TRAMMEL_ABI::minimax
