// SPDX-License-Identifier: Apache-2.0
/// @file
/// Refinement of the solution of a linear system by preconditioned minimal residuals.
#pragma once

#include <cmath>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

/// Solves A x = b with a nearly exact preconditioner M^-1 from the right: `apply(v)` returns A v,
/// `precondition(v)` returns M^-1 v. Saad (2003), algorithm 9.5, without restart; the residual never grows.
/// Stops at
/// ||b - A x|| <= tolerance ||b||, after `max_steps` steps, or when the residual hardly
/// falls for many steps.
/// `relative_residual` receives the residual reached, evaluated from its definition.
template <class Scalar, class Apply, class Precondition>
[[nodiscard]] Eigen::Matrix<Scalar, Eigen::Dynamic, 1> gmres(
    const Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& b, Apply&& apply, Precondition&& precondition,
    int max_steps, Scalar tolerance, Scalar& relative_residual) {
  using std::abs;
  using std::sqrt;
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  constexpr double kSlow = 0.9;
  constexpr int kMaxSlowSteps = 12;  // a few tiny eigenvalues of A M^-1 let the residual wait, then fall
  const Scalar scale = b.norm();
  if (!(scale > Scalar(0))) {
    relative_residual = Scalar(0);
    return Vector::Zero(b.size());
  }
  Vector x = precondition(b);
  Vector residual = b - apply(x);
  Scalar start = residual.norm();
  relative_residual = start / scale;
  if (!(relative_residual > tolerance)) {
    return x;
  }
  Matrix basis(b.size(), max_steps + 1);
  Matrix images(b.size(), max_steps);
  Matrix hessenberg = Matrix::Zero(max_steps + 1, max_steps);
  Vector cosine(max_steps);
  Vector sine(max_steps);
  Vector right = Vector::Zero(max_steps + 1);
  right[0] = start;
  basis.col(0) = residual / start;
  int k = 0;
  int slow_steps = 0;
  Scalar previous = start;
  while (k < max_steps) {
    images.col(k) = precondition(basis.col(k));
    Vector next = apply(images.col(k));
    for (int pass = 0; pass < 2; ++pass) {
      for (int i = 0; i <= k; ++i) {
        const Scalar overlap = basis.col(i).dot(next);
        hessenberg(i, k) += overlap;
        next -= overlap * basis.col(i);
      }
    }
    const Scalar length = next.norm();
    for (int i = 0; i < k; ++i) {
      const Scalar upper = cosine[i] * hessenberg(i, k) + sine[i] * hessenberg(i + 1, k);
      hessenberg(i + 1, k) = cosine[i] * hessenberg(i + 1, k) - sine[i] * hessenberg(i, k);
      hessenberg(i, k) = upper;
    }
    const Scalar radius = sqrt(hessenberg(k, k) * hessenberg(k, k) + length * length);
    if (!(radius > Scalar(0))) {
      break;
    }
    cosine[k] = hessenberg(k, k) / radius;
    sine[k] = length / radius;
    hessenberg(k, k) = radius;
    right[k + 1] = -sine[k] * right[k];
    right[k] = cosine[k] * right[k];
    ++k;
    const Scalar now = abs(right[k]);
    slow_steps = now > previous * Scalar(kSlow) ? slow_steps + 1 : 0;
    if (!(now > tolerance * scale) || !(length > Scalar(0)) || slow_steps > kMaxSlowSteps) {
      break;
    }
    previous = now;
    basis.col(k) = next / length;
  }
  if (k > 0) {
    Vector better = x;
    for (int i = k - 1; i >= 0; --i) {  // back substitution in the triangular factor
      right[i] /= hessenberg(i, i);
      right.head(i) -= right[i] * hessenberg.col(i).head(i);
      better += right[i] * images.col(i);
    }
    const Scalar reached = (b - apply(better)).norm();
    if (reached < start) {
      x = better;
      relative_residual = reached / scale;
    }
  }
  return x;
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
