// SPDX-License-Identifier: Apache-2.0
/// @file
/// Proof of the bounds of a guaranteed problem, independent of what produced them.
#pragma once

#include <limits>
#include <string>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/status.hpp"
#include "trammel/minimax/solution.hpp"
#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// What verify() proved. Bounds that were not proved are NaN.
struct Certificate {
  /// kVerified: both bounds hold for the stored numbers, rounding errors enclosed. kApproximate: both were
  /// computed, but the arithmetic does not deserve the proof (see `remark`). kNone: a bound is missing.
  Claim claim = Claim::kNone;
  double upper = std::numeric_limits<double>::quiet_NaN();  ///< the estimator K F'y never errs more
  double lower = std::numeric_limits<double>::quiet_NaN();  ///< no linear estimator guarantees less
  /// Multipliers lambda' with which the upper bound was proved (s).
  Eigen::VectorXd multipliers;
  /// t > 0: lambda' = lambda (1 + t) + t c, c = upper / s or, where that is cheaper, a hundredth of it;
  /// 1e-12: the multipliers were feasible as they stood, but for what rounding errors may amount to.
  double inflation = std::numeric_limits<double>::quiet_NaN();
  /// Multiplier of the envelope, already contained in `upper`; 0 where no envelope is needed.
  double envelope_multiplier = 0.0;
  /// k x p, empty where the ellipsoids bound everything: the upper bound also assumes |envelope theta| <= 1.
  /// It confines the directions no ellipsoid bounds, by far more than any physical motion.
  Eigen::MatrixXd envelope;
  std::string remark;  ///< why the claim is not kVerified; empty if it is

  [[nodiscard]] double relative_gap() const { return upper == lower ? 0.0 : (upper - lower) / upper; }
};

/// The point of which the bounds are to be proved. p parameters, s ellipsoids, F: m x p.
///
/// | symbol | member       | shape | meaning                                                        |
/// |--------|--------------|-------|----------------------------------------------------------------|
/// | K      | gain         | p x p | estimator theta = K F'y                                         |
/// | lambda | multipliers  | s     | >= 0 (negative ones are set to zero)                           |
/// | L      | prior_factor | p x k | V = L L' of the lower bound; scaled to satisfy the bounds exactly |
struct CandidatePoint {
  Eigen::MatrixXd gain;
  Eigen::VectorXd multipliers;
  Eigen::MatrixXd prior_factor;
};

/// Bounds of max over the ellipsoids of the mean-square error of theta -> C theta, for the problem exactly as
/// stored in binary64. With E = K J - I, J = F'F, S = C'C, H(lambda) = sum lambda_l a_l'a_l:
///
///   upper: H(lambda') - E'SE positive definite  =>  error <= |C K F'|_F^2 + sum lambda',
///   lower: <a_l'a_l, V> <= 1 for V = sigma^2 L L'  =>
///          error >= |C K F'|_F^2 + sigma^2 |C E L|_F^2 - |C (K F' + sigma^2 E L (F L)')|_F^2,
///          whose last term vanishes for the K that is best for V (least squares and their dual problem).
///
/// The matrix inequality is proved after the congruence with a square basis W: W'(H - E'SE)W is enclosed and
/// its definiteness proved by positive_definite(); a point that just fails is repaired by inflating the
/// multipliers. W is next to L where that is square and well conditioned, but has so few bits that E W costs
/// two plain products (QuickProof). Only where that is not enough, and more may help, the products are
/// repeated in double-double arithmetic, also for L regularised by the bounds. Method: Jansson, Chaykin, Keil
/// (2007), "Rigorous error bounds for the optimal value in semidefinite programming"; Rump (2006).
///
/// Directions that no ellipsoid bounds need K J N = N exactly, which no rounded K satisfies: an envelope is
/// added for them and reported.
///
/// Guarantee: where claim is kVerified, lower <= true value of the optimum <= upper and K itself attains
/// upper, as statements about the stored F, C, a_l, K. Modelling errors and the bounds themselves are
/// outside. Cost: about six plain p x p products where F, C and a_l are sparse and the point is good, half
/// a product for each inflation tried otherwise. Throws Error for shapes that do not fit.
[[nodiscard]] Certificate verify(const GuaranteedProblem& problem, const CandidatePoint& point);

/// See apply().
inline constexpr double kStalledSlack = 100.0;

/// The same for the answer of a solver; kNone with infinite upper bound where its status is kUnbounded.
[[nodiscard]] Certificate verify(const GuaranteedProblem& problem, const minimax::Solution& solution);

/// Writes the proved bounds, claim and multipliers into a solution. Its status becomes, or remains, kOptimal
/// if the proved interval is as narrow as the settings ask for, and also, where the claim is kVerified, if it
/// is at most kStalledSlack times as wide: on the hardest problems double precision allows no more, and the
/// result states the gap. Otherwise kOptimal becomes kNumericalTrouble.
void apply(const Certificate& certificate, const minimax::SolverSettings& settings,
           minimax::Solution& solution);

/// The whole way from a solver's answer to a proved one: verify(); where the interval is wider than the
/// settings ask for, once more with K of round_gain(), if that proves more; apply(). Returns the certificate
/// of what `solution` then holds.
[[nodiscard]] Certificate certify(const GuaranteedProblem& problem, const minimax::SolverSettings& settings,
                                  minimax::Solution& solution);

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/certificate_impl.hpp"
#endif
