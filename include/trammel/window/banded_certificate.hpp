// SPDX-License-Identifier: Apache-2.0
/// @file
/// Proof of the bounds of a banded problem, at a cost linear in its length.
#pragma once

#include <limits>
#include <string>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/status.hpp"
#include "trammel/linalg/banded_matrix.hpp"
#include "trammel/problem/banded_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

/// Places from the diagonal up to which J^-1 is kept: about fourteen coefficients per axis. What is left out
/// enters the certificate squared.
inline constexpr Eigen::Index kInverseReach = 42;

/// An estimator of the banded problem: with Sigma = diag(root),
///
///   K = (I + W Sigma D) J^-1,   K J - I = W Sigma D exactly:
///
/// the least-squares estimate, moved by a banded combination of its own bounded quantities. Whatever D does
/// not see (uniform motion, far from the start) is estimated without bias, however long the flight.
struct BandedEstimator {
  linalg::BandedMatrix bias;  ///< W, one row per coefficient, one column per row of D
  Eigen::VectorXd root;       ///< sqrt(lambda) per row of D
};

/// A prior of the banded problem: the bounded quantities D c have second moments V, V = `moments` > 0.
struct BandedPrior {
  linalg::BandedMatrix moments;    ///< V, symmetric, block traces about 1 at most
  linalg::BandedMatrix posterior;  ///< X, near (J + D'V^-1 D)^-1
  linalg::BandedMatrix image;      ///< G, near X D'V^-1
};

/// What certify_bands proved; NaN where nothing was.
struct BandedCertificate {
  Claim claim = Claim::kNone;
  double upper = std::numeric_limits<double>::quiet_NaN();
  double lower = std::numeric_limits<double>::quiet_NaN();
  Eigen::VectorXd multipliers;                                  ///< one per bound; upper = noise + their sum
  double inflation = std::numeric_limits<double>::quiet_NaN();  ///< largest relative growth of a multiplier
  std::string remark;  ///< why the claim is not kVerified; empty if it is
};

/// Bounds of the guaranteed squared error of a banded problem, for F, C, D, W, Sigma, V as stored. With S =
/// C'C, J = F'F >= j I, A = C (I + W Sigma D), Z near J^-1 within a band, B = A Z, R = A - B J, and the
/// remainder Q = X D' - G V:
///
///   upper: diag(kappa) - W'SW positive definite  =>
///          error <= |B F'|_F^2 + 2 <B, R> + |R|_F^2 / j + sum_l kappa_l lambda_l,
///   lower: V - s I positive definite, <H_l, V> <= t  =>
///          t error >= 2 <C X, C> - |C X F'|_F^2 - 2 <C G D, C X> + <C G V, C G> - |C Q|_F^2 / s.
///
/// The first is C K = A J^-1 = B + R J^-1 written out; the second max over X of 2 tr S X - tr S X (J + D'V^-1
/// D) X' with V^-1 replaced by 2 x'g - g'V g + |x - V g|^2 / s from above. Both lose the square of what the
/// band leaves out. kappa is the cheapest that covers W'SW (cheapest_cover, started from block Gershgorin
/// sums), raised by no more than rounding errors until the factorisation proves it.
///
/// Guarantee: kVerified bounds hold with all rounding errors enclosed (EnclosedBand). Cost: p b^2 operations
/// for a band of b, memory p b.
[[nodiscard]] BandedCertificate certify_bands(const BandedProblem& problem, const BandedEstimator& estimator,
                                              const BandedPrior& prior);

}  // namespace trammel::inline TRAMMEL_ABI::window

#ifndef TRAMMEL_COMPILED
#include "trammel/window/banded_certificate_impl.hpp"
#endif
