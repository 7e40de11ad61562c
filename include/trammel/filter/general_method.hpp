// SPDX-License-Identifier: Apache-2.0
/// @file
/// The general synthesis from polynomial matrices A and B: characteristic matrix, both closures, stability.
#pragma once

#include <complex>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/filter/polynomial.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

/// Coefficients of a polynomial (or truncated power series) matrix in q, ascending; all of one size.
using PolynomialMatrix = std::vector<Eigen::MatrixXd>;

/// Value at a complex point.
[[nodiscard]] Eigen::MatrixXcd evaluate(const PolynomialMatrix& matrix, std::complex<double> q);
/// First `terms` coefficients of a product.
[[nodiscard]] PolynomialMatrix multiply_series(const PolynomialMatrix& left, const PolynomialMatrix& right,
                                               int terms);
/// First `terms` coefficients of the inverse; the constant coefficient must be invertible.
[[nodiscard]] PolynomialMatrix invert_series(const PolynomialMatrix& matrix, int terms);

/// I - q Phi(T): the simplest A of a filter with k = v rows; every admissible A or B is a polynomial matrix
/// times it.
[[nodiscard]] PolynomialMatrix difference_operator(int order, double sampling_s);

/// Largest |(M x)(n)| over all trajectories x(t) = (t^p/p!, t^(p-1)/(p-1)!, ...), p < order: the invariance
/// condition, eq. (14) of Pichugin, Zimchuk, Kankin (2004), relative to the sizes of the terms.
[[nodiscard]] double invariance_residual(const PolynomialMatrix& matrix, int order, double sampling_s);

/// Quotient B A^-1 where it is a polynomial matrix (A(0) = I), and the largest remainder relative to B.
struct RightQuotient {
  PolynomialMatrix quotient;
  double remainder = 0.0;
};
[[nodiscard]] RightQuotient divide_right(const PolynomialMatrix& b, const PolynomialMatrix& a);

/// A closure as transfer functions from the measurement. Factors that cancel may be left in them.
struct GeneralTransfer {
  Polynomial denominator;              ///< P(q), P(0) = 1
  std::vector<Polynomial> numerators;  ///< estimate of row i: N_i(q) / P(q), unit s^-i
};

/// The general method: characteristic matrix C from eq. (17) of Pichugin, Zimchuk, Kankin (2004).
///
/// | symbol | meaning                                              | shape      |
/// |--------|------------------------------------------------------|------------|
/// | A, B   | accuracy of prediction and estimate, A(0) = I        | k x k in q |
/// | F      | predictor I - A, their eq. (18)                      | k x k in q |
/// | M      | B A^-1                                               | k x k in q |
/// | X      | C^-1                                                 | k x k      |
/// | S      | C^-1 B A^-1 C, their eq. (12): residual = S innovation | k x k    |
/// | H_P    | (d^i / (i! T^i)): measurement to noisy state         | k          |
/// | D      | (1 / (i! T^i))                                       | k          |
///
/// Their eq. (17), I - F = X A - F X B, is the Stein equation X - F X M = I. With A(0) = I it has exactly
/// one causal solution, X = sum_j F^j M^j, computed as a power series or, at one q, from the linear system
/// (I - M' (x) F) vec X = vec I. Given S instead of B there is no equation to solve: C = I - F S,
/// B = C S C^-1 A. If A and B commute, C = I - F B A^-1, which is eq. (20).
///
/// Two closures, which the publication does not tell apart:
/// - vector innovation, eqs. (5)-(8): x = (I - X B) H_P g, every row compares its own noisy derivative;
///   characteristic polynomial det(I - M' (x) F). With A = I - q Phi and constant S its poles are 1 - alpha
///   and 1 - beta: it is not the alpha-beta filter.
/// - scalar innovation, eqs. (13), (19), (22): A x = (I - S) D u, u = g - H F x; characteristic polynomial
///   det(A + (I - S) D H F). With S = diag(1 - alpha, 1 - beta) it is the alpha-beta filter.
///
/// Guarantee: the results solve eq. (17) to rounding. Throws Error for shapes that do not fit, A(0) != I, or
/// matrices that violate eq. (14). Cost: one LU of size k^2 per point; series O(terms^2 k^3).
class GeneralMethod {
 public:
  /// From A and B (their eqs. (14)-(18)).
  static GeneralMethod from_matrices(const PolynomialMatrix& a, const PolynomialMatrix& b, int order,
                                     double sampling_s);
  /// From A and the operator S from innovation to residual (polynomial).
  static GeneralMethod from_operator(const PolynomialMatrix& a, const PolynomialMatrix& s, int order,
                                     double sampling_s);

  /// X = C^-1 and C = I - F S at a point.
  [[nodiscard]] Eigen::MatrixXcd inverse_characteristic(std::complex<double> q) const;
  [[nodiscard]] Eigen::MatrixXcd characteristic(std::complex<double> q) const;
  /// S = X M X^-1 at a point.
  [[nodiscard]] Eigen::MatrixXcd residual_operator(std::complex<double> q) const;
  /// B at a point (for from_operator: C S C^-1 A).
  [[nodiscard]] Eigen::MatrixXcd estimate_accuracy(std::complex<double> q) const;

  /// First coefficients of X, of B and of S (all of them where these are polynomials that were given).
  [[nodiscard]] PolynomialMatrix inverse_characteristic_series(int terms) const;
  [[nodiscard]] PolynomialMatrix estimate_accuracy_series(int terms) const;
  [[nodiscard]] PolynomialMatrix residual_operator_series(int terms) const;

  /// Estimates for unit g at a point: transfer functions of the two closures.
  [[nodiscard]] Eigen::VectorXcd vector_closure(std::complex<double> q) const;
  [[nodiscard]] Eigen::VectorXcd scalar_closure(std::complex<double> q) const;
  /// Innovation u / g of the scalar closure at a point.
  [[nodiscard]] std::complex<double> scalar_innovation(std::complex<double> q) const;

  /// Pulse responses: k x count.
  [[nodiscard]] Eigen::MatrixXd vector_closure_response(int count) const;
  [[nodiscard]] Eigen::MatrixXd scalar_closure_response(int count) const;

  /// Characteristic polynomial of the vector closure, normalised at q = 0: det(I - M' (x) F), or
  /// det(I - F S) where S was given; may contain powers of the true one. Needs a polynomial M or S; Error
  /// otherwise.
  [[nodiscard]] Polynomial vector_denominator() const;
  /// The same of the scalar closure, det(A + (I - S) D H F); needs from_operator or commuting A and B.
  [[nodiscard]] Polynomial scalar_denominator() const;
  /// Both closures as transfer functions; need what their denominators need.
  [[nodiscard]] GeneralTransfer vector_transfer() const;
  [[nodiscard]] GeneralTransfer scalar_transfer() const;
  /// True where vector_denominator (M or S polynomial) and scalar_denominator (S polynomial) exist.
  [[nodiscard]] bool has_vector_denominator() const { return !s_.empty() || !m_.empty(); }
  [[nodiscard]] bool has_scalar_denominator() const { return !s_.empty(); }
  /// True if A and B commute, so that S = M.
  [[nodiscard]] bool commutes() const { return commutes_; }

 private:
  GeneralMethod(PolynomialMatrix a, int order, double sampling_s);
  [[nodiscard]] Eigen::MatrixXcd middle(std::complex<double> q) const;
  [[nodiscard]] PolynomialMatrix middle_series(int terms) const;
  [[nodiscard]] int rows() const { return static_cast<int>(d_.size()); }

  PolynomialMatrix a_;
  PolynomialMatrix f_;
  PolynomialMatrix b_;  ///< empty for from_operator
  PolynomialMatrix m_;  ///< polynomial M, empty if M is not a polynomial
  PolynomialMatrix s_;  ///< polynomial S, empty if not given and A, B do not commute
  bool commutes_ = false;
  Eigen::VectorXd d_;
};

}  // namespace trammel::inline TRAMMEL_ABI::filter

#ifndef TRAMMEL_COMPILED
#include "trammel/filter/general_method_impl.hpp"
#endif
