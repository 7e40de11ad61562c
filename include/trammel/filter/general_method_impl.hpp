// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of general_method.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/filter/design.hpp"
#include "trammel/filter/general_method.hpp"
#include "trammel/filter/require_order.hpp"
#include "trammel/linalg/lu.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

namespace detail {

/// Quotients and conditions are exact up to this part of the sizes involved.
inline constexpr double kExact = 1e-10;

inline double size_of(const PolynomialMatrix& matrix) {
  double sum = 0.0;
  for (const Eigen::MatrixXd& coefficient : matrix) {
    sum += coefficient.cwiseAbs().sum();
  }
  return sum;
}

inline void require_square(const PolynomialMatrix& matrix, Eigen::Index rows, const char* name) {
  require(!matrix.empty(), name, "no coefficients", "at least one");
  for (const Eigen::MatrixXd& coefficient : matrix) {
    require(coefficient.rows() == rows && coefficient.cols() == rows, name,
            std::to_string(coefficient.rows()) + " x " + std::to_string(coefficient.cols()),
            std::to_string(rows) + " x " + std::to_string(rows));
    require(coefficient.allFinite(), name, "a coefficient that is not finite", "finite coefficients");
  }
}

/// I - matrix.
inline PolynomialMatrix complement(const PolynomialMatrix& matrix) {
  PolynomialMatrix result = matrix;
  for (Eigen::MatrixXd& coefficient : result) {
    coefficient = -coefficient;
  }
  result[0].diagonal().array() += 1.0;
  return result;
}

inline void trim_matrix(PolynomialMatrix& matrix) {
  const double noise = kExact * std::max(size_of(matrix), 1e-300);
  while (matrix.size() > 1 && matrix.back().cwiseAbs().maxCoeff() <= noise) {
    matrix.pop_back();
  }
}

inline int degree_of(const PolynomialMatrix& matrix) { return static_cast<int>(matrix.size()) - 1; }

/// Without trailing coefficients that are zero up to kExact of the sum of all.
inline Polynomial exact_part(const Polynomial& p) {
  const double noise = kExact * p.cwiseAbs().sum();
  Eigen::Index size = p.size();
  while (size > 1 && std::abs(p[size - 1]) <= noise) {
    --size;
  }
  return p.head(size);
}

/// Numerators N_i = P x_i of a closure, of at most the given degree, from its pulse response.
inline GeneralTransfer transfer_functions(Polynomial denominator, const Eigen::MatrixXd& response) {
  GeneralTransfer transfer{std::move(denominator), {}};
  for (Eigen::Index i = 0; i < response.rows(); ++i) {
    const Polynomial product = multiply(transfer.denominator, response.row(i).transpose());
    transfer.numerators.push_back(exact_part(product.head(response.cols())));
  }
  return transfer;
}

/// Coefficients of the polynomial q -> det value(q) of at most the given degree, from its values at roots
/// of unity.
inline Polynomial interpolate_determinant(const std::function<Eigen::MatrixXcd(std::complex<double>)>& value,
                                          int degree) {
  const int count = degree + 1;
  std::vector<std::complex<double>> samples;
  const auto root = [&](int index) {
    return std::polar(1.0, 2.0 * std::numbers::pi * (index % count) / count);
  };
  for (int i = 0; i < count; ++i) {
    samples.push_back(linalg::ComplexLu(value(root(i))).determinant());
  }
  Polynomial coefficients(count);
  for (int k = 0; k < count; ++k) {
    std::complex<double> sum = 0.0;
    for (int i = 0; i < count; ++i) {
      sum += samples[static_cast<std::size_t>(i)] * std::conj(root(k * i));
    }
    coefficients[k] = sum.real() / count;
  }
  return exact_part(coefficients) / coefficients[0];
}

}  // namespace detail

TRAMMEL_INLINE Eigen::MatrixXcd evaluate(const PolynomialMatrix& matrix, std::complex<double> q) {
  Eigen::MatrixXcd value = matrix.back().cast<std::complex<double>>();
  for (std::size_t i = matrix.size() - 1; i-- > 0;) {
    value = (value * q + matrix[i].cast<std::complex<double>>()).eval();
  }
  return value;
}

TRAMMEL_INLINE PolynomialMatrix multiply_series(const PolynomialMatrix& left, const PolynomialMatrix& right,
                                                int terms) {
  PolynomialMatrix product(static_cast<std::size_t>(terms),
                           Eigen::MatrixXd::Zero(left[0].rows(), right[0].cols()));
  for (std::size_t i = 0; i < left.size(); ++i) {
    for (std::size_t j = 0; j < right.size() && i + j < product.size(); ++j) {
      product[i + j] += left[i] * right[j];
    }
  }
  return product;
}

TRAMMEL_INLINE PolynomialMatrix invert_series(const PolynomialMatrix& matrix, int terms) {
  const linalg::Lu lu(matrix[0]);
  PolynomialMatrix inverse;
  for (std::size_t n = 0; n < static_cast<std::size_t>(terms); ++n) {
    Eigen::MatrixXd rest = n == 0 ? Eigen::MatrixXd::Identity(matrix[0].rows(), matrix[0].rows()).eval()
                                  : Eigen::MatrixXd::Zero(matrix[0].rows(), matrix[0].rows()).eval();
    for (std::size_t j = 1; j <= std::min(n, matrix.size() - 1); ++j) {
      rest -= matrix[j] * inverse[n - j];
    }
    inverse.push_back(lu.solve(rest));
  }
  return inverse;
}

TRAMMEL_INLINE PolynomialMatrix difference_operator(int order, double sampling_s) {
  detail::require_order(order, order);
  Eigen::MatrixXd transition = Eigen::MatrixXd::Zero(order, order);
  for (int i = 0; i < order; ++i) {
    for (int j = i; j < order; ++j) {
      transition(i, j) = std::pow(sampling_s, j - i) / factorial(j - i);
    }
  }
  return {Eigen::MatrixXd::Identity(order, order), -transition};
}

TRAMMEL_INLINE double invariance_residual(const PolynomialMatrix& matrix, int order, double sampling_s) {
  const Eigen::Index rows = matrix[0].rows();
  double worst = 0.0;
  for (int power = 0; power < order; ++power) {
    // A polynomial of degree below `order` that vanishes at `order` times vanishes for ever.
    for (int n = 0; n < order; ++n) {
      Eigen::VectorXd sum = Eigen::VectorXd::Zero(rows);
      double size = 0.0;
      for (std::size_t s = 0; s < matrix.size(); ++s) {
        Eigen::VectorXd state = Eigen::VectorXd::Zero(rows);
        for (int i = 0; i <= std::min<int>(power, static_cast<int>(rows) - 1); ++i) {
          state[i] = std::pow(n - static_cast<double>(s), power - i) / factorial(power - i) /
                     std::pow(sampling_s, i);
        }
        const Eigen::VectorXd term = matrix[s] * state;
        sum += term;
        size = std::max(size, (matrix[s].cwiseAbs() * state.cwiseAbs()).maxCoeff());
      }
      worst = std::max(worst, size > 0.0 ? sum.cwiseAbs().maxCoeff() / size : 0.0);
    }
  }
  return worst;
}

TRAMMEL_INLINE RightQuotient divide_right(const PolynomialMatrix& b, const PolynomialMatrix& a) {
  // M A = B, coefficient by coefficient: M_n = B_n - sum_s M_(n-s) A_s.
  const int quotient_terms = std::max(detail::degree_of(b) - detail::degree_of(a), 0) + 1;
  const int terms = std::max(detail::degree_of(b), detail::degree_of(a)) + quotient_terms + 1;
  const PolynomialMatrix series = multiply_series(b, invert_series(a, terms), terms);
  RightQuotient result;
  result.quotient.assign(series.begin(), series.begin() + terms);
  detail::trim_matrix(result.quotient);
  const PolynomialMatrix product = multiply_series(result.quotient, a, terms + detail::degree_of(a));
  for (std::size_t i = 0; i < product.size(); ++i) {
    const Eigen::MatrixXd difference =
        i < b.size() ? Eigen::MatrixXd(product[i] - b[i]) : Eigen::MatrixXd(product[i]);
    result.remainder =
        std::max(result.remainder, difference.cwiseAbs().maxCoeff() / std::max(detail::size_of(b), 1e-300));
  }
  return result;
}

TRAMMEL_INLINE GeneralMethod::GeneralMethod(PolynomialMatrix a, int order, double sampling_s)
    : a_(std::move(a)) {
  require(!a_.empty(), "A", "no coefficients", "at least one");
  const Eigen::Index rows = a_[0].rows();
  detail::require_order(order, static_cast<int>(rows));
  require(std::isfinite(sampling_s) && sampling_s > 0.0, "sampling_s", shortest(sampling_s),
          "a positive number of seconds");
  detail::require_square(a_, rows, "A");
  require(a_[0].isIdentity(0.0), "A", "A(0) that is not the identity",
          "A(0) = I: otherwise the prediction would need the present estimate");
  const double residual = invariance_residual(a_, order, sampling_s);
  require(residual <= detail::kExact, "A", "a relative residual of " + std::to_string(residual),
          "A x = 0 for every polynomial trajectory of degree below the order");
  f_ = detail::complement(a_);
  d_.resize(rows);
  for (int i = 0; i < rows; ++i) {
    d_[i] = 1.0 / (factorial(i) * std::pow(sampling_s, i));
  }
}

TRAMMEL_INLINE GeneralMethod GeneralMethod::from_matrices(const PolynomialMatrix& a,
                                                          const PolynomialMatrix& b, int order,
                                                          double sampling_s) {
  GeneralMethod method(a, order, sampling_s);
  detail::require_square(b, method.rows(), "B");
  const double residual = invariance_residual(b, order, sampling_s);
  require(residual <= detail::kExact, "B", "a relative residual of " + std::to_string(residual),
          "B x = 0 for every polynomial trajectory of degree below the order");
  method.b_ = b;
  RightQuotient division = divide_right(b, a);
  if (division.remainder <= detail::kExact) {
    method.m_ = std::move(division.quotient);
  }
  const int terms = detail::degree_of(a) + detail::degree_of(b) + 1;
  const PolynomialMatrix left = multiply_series(a, b, terms);
  const PolynomialMatrix right = multiply_series(b, a, terms);
  double difference = 0.0;
  for (std::size_t i = 0; i < left.size(); ++i) {
    difference = std::max(difference, (left[i] - right[i]).cwiseAbs().maxCoeff());
  }
  method.commutes_ = difference <= detail::kExact * detail::size_of(left);
  if (method.commutes_) {
    method.s_ = method.m_;
  }
  return method;
}

TRAMMEL_INLINE GeneralMethod GeneralMethod::from_operator(const PolynomialMatrix& a,
                                                          const PolynomialMatrix& s, int order,
                                                          double sampling_s) {
  GeneralMethod method(a, order, sampling_s);
  detail::require_square(s, method.rows(), "S");
  method.s_ = s;
  return method;
}

TRAMMEL_INLINE Eigen::MatrixXcd GeneralMethod::middle(std::complex<double> q) const {
  if (!m_.empty()) {
    return evaluate(m_, q);
  }
  const linalg::ComplexLu lu(evaluate(a_, q).transpose());
  return lu.solve(evaluate(b_, q).transpose()).transpose();
}

TRAMMEL_INLINE Eigen::MatrixXcd GeneralMethod::characteristic(std::complex<double> q) const {
  if (!s_.empty()) {
    return Eigen::MatrixXcd::Identity(rows(), rows()) - evaluate(f_, q) * evaluate(s_, q);
  }
  return linalg::ComplexLu(inverse_characteristic(q)).inverse();
}

TRAMMEL_INLINE Eigen::MatrixXcd GeneralMethod::inverse_characteristic(std::complex<double> q) const {
  if (!s_.empty()) {
    return linalg::ComplexLu(characteristic(q)).inverse();
  }
  const int k = rows();
  const Eigen::MatrixXcd f = evaluate(f_, q);
  const Eigen::MatrixXcd m = middle(q);
  Eigen::MatrixXcd system = Eigen::MatrixXcd::Identity(k * k, k * k);
  for (int i = 0; i < k; ++i) {
    for (int j = 0; j < k; ++j) {
      system.block(i * k, j * k, k, k) -= m(j, i) * f;  // M' (x) F
    }
  }
  const Eigen::MatrixXcd identity = Eigen::MatrixXcd::Identity(k, k);
  const Eigen::VectorXcd x = linalg::ComplexLu(system).solve(identity.reshaped());
  return x.reshaped(k, k);
}

TRAMMEL_INLINE Eigen::MatrixXcd GeneralMethod::residual_operator(std::complex<double> q) const {
  if (!s_.empty()) {
    return evaluate(s_, q);
  }
  const Eigen::MatrixXcd x = inverse_characteristic(q);
  return x * middle(q) * linalg::ComplexLu(x).inverse();
}

TRAMMEL_INLINE Eigen::MatrixXcd GeneralMethod::estimate_accuracy(std::complex<double> q) const {
  if (!b_.empty()) {
    return evaluate(b_, q);
  }
  const Eigen::MatrixXcd c = characteristic(q);
  return c * evaluate(s_, q) * linalg::ComplexLu(c).inverse() * evaluate(a_, q);
}

TRAMMEL_INLINE PolynomialMatrix GeneralMethod::middle_series(int terms) const {
  if (!m_.empty()) {
    return m_;
  }
  if (!b_.empty()) {
    return multiply_series(b_, invert_series(a_, terms), terms);
  }
  // M = C S C^-1
  PolynomialMatrix c = detail::complement(multiply_series(f_, s_, terms));
  return multiply_series(multiply_series(c, s_, terms), invert_series(c, terms), terms);
}

TRAMMEL_INLINE PolynomialMatrix GeneralMethod::inverse_characteristic_series(int terms) const {
  if (!s_.empty()) {
    return invert_series(detail::complement(multiply_series(f_, s_, terms)), terms);
  }
  // X = I + F X M, and F has no constant term: each coefficient needs earlier ones only.
  const PolynomialMatrix m = middle_series(terms);
  PolynomialMatrix x(static_cast<std::size_t>(terms), Eigen::MatrixXd::Zero(rows(), rows()));
  x[0].setIdentity();
  for (std::size_t n = 1; n < x.size(); ++n) {
    for (std::size_t s = 1; s < f_.size() && s <= n; ++s) {
      for (std::size_t t = 0; t < m.size() && s + t <= n; ++t) {
        x[n] += f_[s] * x[n - s - t] * m[t];
      }
    }
  }
  return x;
}

TRAMMEL_INLINE PolynomialMatrix GeneralMethod::estimate_accuracy_series(int terms) const {
  return b_.empty() ? multiply_series(middle_series(terms), a_, terms) : b_;
}

TRAMMEL_INLINE PolynomialMatrix GeneralMethod::residual_operator_series(int terms) const {
  if (!s_.empty()) {
    return s_;
  }
  const PolynomialMatrix x = inverse_characteristic_series(terms);
  return multiply_series(multiply_series(x, middle_series(terms), terms), invert_series(x, terms), terms);
}

TRAMMEL_INLINE Eigen::VectorXcd GeneralMethod::vector_closure(std::complex<double> q) const {
  Eigen::VectorXcd noisy_state(rows());
  std::complex<double> power = 1.0;
  for (int i = 0; i < rows(); ++i, power *= 1.0 - q) {
    noisy_state[i] = power * d_[i];
  }
  return noisy_state - inverse_characteristic(q) * (estimate_accuracy(q) * noisy_state);
}

TRAMMEL_INLINE std::complex<double> GeneralMethod::scalar_innovation(std::complex<double> q) const {
  const Eigen::VectorXcd x = scalar_closure(q);
  return 1.0 - (evaluate(f_, q) * x)(0);
}

TRAMMEL_INLINE Eigen::VectorXcd GeneralMethod::scalar_closure(std::complex<double> q) const {
  const Eigen::MatrixXcd identity = Eigen::MatrixXcd::Identity(rows(), rows());
  const Eigen::VectorXcd gain = (identity - residual_operator(q)) * d_;
  const Eigen::MatrixXcd closed = evaluate(a_, q) + gain * evaluate(f_, q).row(0);
  return linalg::ComplexLu(closed).solve(gain);
}

TRAMMEL_INLINE Eigen::MatrixXd GeneralMethod::vector_closure_response(int count) const {
  // x = H_P g - X B H_P g
  PolynomialMatrix noisy_state;
  for (int n = 0; n < rows(); ++n) {
    Eigen::MatrixXd column = Eigen::MatrixXd::Zero(rows(), 1);
    for (int i = n; i < rows(); ++i) {
      const double sign = n % 2 == 0 ? 1.0 : -1.0;
      column(i, 0) = d_[i] * sign * factorial(i) / (factorial(n) * factorial(i - n));
    }
    noisy_state.push_back(column);
  }
  const PolynomialMatrix b = estimate_accuracy_series(count);
  const PolynomialMatrix residual =
      multiply_series(multiply_series(inverse_characteristic_series(count), b, count), noisy_state, count);
  Eigen::MatrixXd response = Eigen::MatrixXd::Zero(rows(), count);
  for (int n = 0; n < count; ++n) {
    response.col(n) = -residual[static_cast<std::size_t>(n)];
    if (n < rows()) {
      response.col(n) += noisy_state[static_cast<std::size_t>(n)];
    }
  }
  return response;
}

TRAMMEL_INLINE Eigen::MatrixXd GeneralMethod::scalar_closure_response(int count) const {
  const PolynomialMatrix gain_operator = detail::complement(residual_operator_series(count));
  Eigen::MatrixXd response = Eigen::MatrixXd::Zero(rows(), count);
  Eigen::VectorXd innovations(count);
  for (int n = 0; n < count; ++n) {
    Eigen::VectorXd predicted = Eigen::VectorXd::Zero(rows());
    for (int s = 1; s < static_cast<int>(f_.size()) && s <= n; ++s) {
      predicted += f_[static_cast<std::size_t>(s)] * response.col(n - s);
    }
    innovations[n] = (n == 0 ? 1.0 : 0.0) - predicted[0];
    response.col(n) = predicted;
    for (int s = 0; s < static_cast<int>(gain_operator.size()) && s <= n; ++s) {
      response.col(n) += gain_operator[static_cast<std::size_t>(s)] * d_ * innovations[n - s];
    }
  }
  return response;
}

TRAMMEL_INLINE Polynomial GeneralMethod::vector_denominator() const {
  const int k = rows();
  if (!s_.empty()) {
    const int degree = k * (detail::degree_of(f_) + detail::degree_of(s_));
    return detail::interpolate_determinant([this](std::complex<double> q) { return characteristic(q); },
                                           degree);
  }
  require(!m_.empty(), "B", "B that is not a polynomial matrix times A", "one that is");
  const int degree = k * k * (detail::degree_of(f_) + detail::degree_of(m_));
  return detail::interpolate_determinant(
      [this, k](std::complex<double> q) {
        const Eigen::MatrixXcd f = evaluate(f_, q);
        const Eigen::MatrixXcd m = evaluate(m_, q);
        Eigen::MatrixXcd system = Eigen::MatrixXcd::Identity(k * k, k * k);
        for (int i = 0; i < k; ++i) {
          for (int j = 0; j < k; ++j) {
            system.block(i * k, j * k, k, k) -= m(j, i) * f;
          }
        }
        return system;
      },
      degree);
}

TRAMMEL_INLINE Polynomial GeneralMethod::scalar_denominator() const {
  require(!s_.empty(), "S", "an operator S that is not a polynomial",
          "from_operator, or A and B that commute with a polynomial quotient");
  const int degree =
      rows() * (std::max(detail::degree_of(a_), detail::degree_of(f_)) + detail::degree_of(s_));
  return detail::interpolate_determinant(
      [this](std::complex<double> q) {
        const Eigen::MatrixXcd identity = Eigen::MatrixXcd::Identity(rows(), rows());
        const Eigen::VectorXcd gain = (identity - residual_operator(q)) * d_;
        return Eigen::MatrixXcd(evaluate(a_, q) + gain * evaluate(f_, q).row(0));
      },
      degree);
}

TRAMMEL_INLINE GeneralTransfer GeneralMethod::vector_transfer() const {
  // x = H_P - X B H_P: X has the denominator and a numerator of one factor less, or X B = S C^-1 A.
  const int k = rows();
  const int f = detail::degree_of(f_);
  const int closed = s_.empty() ? k * k * (f + detail::degree_of(m_)) + detail::degree_of(b_)
                                : k * (f + detail::degree_of(s_)) + detail::degree_of(a_);
  return detail::transfer_functions(vector_denominator(), vector_closure_response(closed + k));
}

TRAMMEL_INLINE GeneralTransfer GeneralMethod::scalar_transfer() const {
  const Polynomial denominator = scalar_denominator();
  const int degree = rows() * (detail::degree_of(a_) + detail::degree_of(s_));
  return detail::transfer_functions(denominator, scalar_closure_response(degree + 1));
}

}  // namespace trammel::inline TRAMMEL_ABI::filter
