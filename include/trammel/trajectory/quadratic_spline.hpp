// SPDX-License-Identifier: Apache-2.0
/// @file
/// A motion in space with piecewise constant acceleration.
#pragma once

#include <string>
#include <utility>

#include <Eigen/Core>

#include "trammel/trajectory/spline_basis.hpp"

namespace trammel::inline TRAMMEL_ABI::trajectory {

template <class Scalar>
using Vector3 = Eigen::Matrix<Scalar, 3, 1>;

/// x(t) = sum_j c_j B_j(t) in three dimensions, scalars float, double or dual numbers (SplineBasis has the
/// formulas). Evaluation outside the knots continues the end segments.
template <class Scalar>
class QuadraticSpline {
 public:
  using Coefficients = Eigen::Matrix<Scalar, 3, Eigen::Dynamic>;

  /// `coefficients`: 3 x (r + 2), m. Throws Error for another shape.
  QuadraticSpline(SplineBasis basis, Coefficients coefficients)
      : basis_(std::move(basis)), coefficients_(std::move(coefficients)) {
    if (coefficients_.cols() != basis_.coefficients()) {
      throw Error({"coefficients", std::to_string(coefficients_.cols()) + " columns",
                   std::to_string(basis_.coefficients()) + " columns, segments + 2"});
    }
  }

  [[nodiscard]] const SplineBasis& basis() const noexcept { return basis_; }
  [[nodiscard]] const Coefficients& coefficients() const noexcept { return coefficients_; }

  [[nodiscard]] Vector3<Scalar> position(const Scalar& t_s) const {
    const LocalBasis<Scalar> local = basis_.at(t_s);
    return neighbours(local.first) * local.value.transpose();
  }
  [[nodiscard]] Vector3<Scalar> velocity(const Scalar& t_s) const {
    const LocalBasis<Scalar> local = basis_.at(t_s);
    return neighbours(local.first) * local.rate.transpose();
  }
  /// At an inner knot that of the segment on its right.
  [[nodiscard]] Vector3<Scalar> acceleration(const Scalar& t_s) const {
    const LocalBasis<Scalar> local = basis_.at(t_s);
    return neighbours(local.first) * local.second_rate.transpose();
  }

 private:
  [[nodiscard]] auto neighbours(Eigen::Index first) const {
    return coefficients_.template middleCols<3>(first);
  }

  SplineBasis basis_;
  Coefficients coefficients_;
};

}  // namespace trammel::inline TRAMMEL_ABI::trajectory
