// SPDX-License-Identifier: Apache-2.0
/// @file
/// What must hold for every solution of a guaranteed problem, whichever solver made it.
#pragma once

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "trammel/linalg/qr.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/minimax/solution.hpp"
#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::test {

/// tr S K J K' + sum lambda, recomputed from the definition.
inline double upper_value(const GuaranteedProblem& problem, const minimax::Solution& solution) {
  const Eigen::MatrixXd noise =
      problem.criterion_factor * solution.gain * problem.information_factor.transpose();
  return noise.squaredNorm() + solution.multipliers.sum();
}

/// Checks shapes, feasibility of both sides and that the values are those of the points returned.
inline void expect_solution_laws(const GuaranteedProblem& problem, const minimax::Solution& solution,
                                 double tolerance = 1e-9) {
  const Eigen::Index p = problem.parameters();
  ASSERT_EQ(solution.gain.rows(), p);
  ASSERT_EQ(solution.gain.cols(), p);
  ASSERT_EQ(solution.prior_factor.rows(), p);
  ASSERT_EQ(solution.multipliers.size(), static_cast<Eigen::Index>(problem.ellipsoids.size()));
  EXPECT_GE(solution.multipliers.minCoeff(), 0.0);
  EXPECT_LE(solution.lower, solution.upper * (1 + 1e-15));
  EXPECT_NEAR(upper_value(problem, solution), solution.upper, tolerance * solution.upper);

  for (std::size_t l = 0; l < problem.ellipsoids.size(); ++l) {
    EXPECT_LE((problem.ellipsoids[l] * solution.prior_factor).squaredNorm(), 1 + 1e-9) << "bound " << l;
  }
  // lower = tr C L (I + L'J L)^-1 L'C', through the QR factorisation of [F L; I].
  const Eigen::Index columns = solution.prior_factor.cols();
  Eigen::MatrixXd stacked(problem.information_factor.rows() + columns, columns);
  stacked << problem.information_factor * solution.prior_factor, Eigen::MatrixXd::Identity(columns, columns);
  const linalg::Qr qr(stacked);
  const Eigen::MatrixXd triangle = qr.matrixQR().topRows(columns).triangularView<Eigen::Upper>();
  const Eigen::MatrixXd rows = triangle.transpose().triangularView<Eigen::Lower>().solve(
      (problem.criterion_factor * solution.prior_factor).transpose());
  EXPECT_NEAR(rows.squaredNorm(), solution.lower, tolerance * solution.lower);

  // H(lambda) - (KJ - I)'S(KJ - I) >= 0 up to rounding, where the bounds are one.
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(p, p);
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(p, p);
  for (std::size_t l = 0; l < problem.ellipsoids.size(); ++l) {
    const Eigen::MatrixXd square = problem.ellipsoids[l].transpose() * problem.ellipsoids[l];
    H += solution.multipliers[static_cast<Eigen::Index>(l)] * square;
    all += square;
  }
  const linalg::SymmetricEigen bounds(all);
  if (bounds.eigenvalues().minCoeff() < 1e-10 * bounds.eigenvalues().maxCoeff()) {
    return;  // unbounded directions: the inequality is checked in reduced coordinates by the verifier
  }
  const Eigen::MatrixXd to_unit =
      bounds.eigenvectors() * bounds.eigenvalues().cwiseSqrt().cwiseInverse().asDiagonal();
  const Eigen::MatrixXd error =
      problem.criterion_factor *
      (solution.gain * problem.information_factor.transpose() * problem.information_factor * to_unit -
       to_unit);
  const Eigen::MatrixXd slack = to_unit.transpose() * H * to_unit - error.transpose() * error;
  EXPECT_GE(linalg::SymmetricEigen(slack).eigenvalues().minCoeff(), -tolerance * solution.upper);
}

}  // namespace trammel::test
