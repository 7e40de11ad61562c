// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of banded_problem.hpp.
#pragma once

#include <cmath>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/problem/banded_problem.hpp"
#include "trammel/trajectory/criterion_factor.hpp"
#include "trammel/trajectory/motion_parameters.hpp"

namespace trammel::inline TRAMMEL_ABI {

namespace banded_problem_detail {

inline constexpr const char* kOtherwise = "; method \"structured\" has no such limit";

/// Throws Error where a scenario has what the band cannot hold.
inline void require_banded(const Scenario& scenario) {
  require(scenario.criterion.kind == CriterionKind::kIntegral, "criterion.kind",
          "a criterion over part of the flight",
          std::string("the integral over the whole flight for a banded problem") + kOtherwise);
  require(bias_parameters(scenario).empty(), "station bias", "stations with biases",
          std::string("stations without biases for a banded problem") + kOtherwise);
  for (Eigen::Index l = 0; l < static_cast<Eigen::Index>(scenario.segments()) + 2; ++l) {
    const Eigen::Vector3d& axes = semi_axes(scenario.bounds, l);
    const bool usable = (axes.array() > 0.0).all() && (l < 2 || axes.allFinite());
    require(usable,
            l == 0   ? "bounds.position_m"
            : l == 1 ? "bounds.velocity_mps"
                     : "bounds.acceleration_mps2",
            usable
                ? ""
                : std::to_string(axes(0)) + ", " + std::to_string(axes(1)) + ", " + std::to_string(axes(2)),
            std::string("positive semi-axes, finite for accelerations, for a banded problem") + kOtherwise);
  }
}

/// Rows of the bounds over their semi-axes.
inline linalg::BandedMatrix bound_rows(const trajectory::SplineBasis& basis, const MotionBounds& bounds) {
  linalg::BandedMatrix D(3 * basis.coefficients(), 8, 8);
  for (Eigen::Index l = 0; l < basis.coefficients(); ++l) {
    const trajectory::MotionRow row = trajectory::motion_row_of_coefficients(basis, l);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      for (Eigen::Index k = 0; k < 3; ++k) {
        D.at(3 * l + axis, 3 * (row.first + k) + axis) = row.weight(k) / semi_axes(bounds, l)(axis);
      }
    }
  }
  return D;
}

}  // namespace banded_problem_detail

TRAMMEL_INLINE BandedProblem assemble_banded(const Scenario& scenario,
                                             const trajectory::QuadraticSpline<double>* about) {
  namespace detail = banded_problem_detail;
  detail::require_banded(scenario);
  TrajectoryProblem trajectory = describe_problem(scenario, about);
  const trajectory::SplineBasis basis = trajectory.coordinates.basis();
  const Eigen::Index p = 3 * basis.coefficients();
  BandedProblem result{
      .trajectory = std::move(trajectory),
      .measurements = linalg::BandedRows<9, 3>(basis.segments()),
      .criterion_rows = trajectory::integral_rows(basis, basis.begin_s(), basis.end_s()),
      .information_factor = linalg::BandedMatrix(p, 0, 8),
      .criterion_factor = linalg::BandedMatrix(p, 0, 6),
      .bounds = detail::bound_rows(basis, scenario.bounds),
      .rhs = Eigen::VectorXd::Zero(p),
      .residual = 0.0,
  };
  for_each_whitened_row(scenario, result.trajectory, [&](const WhitenedRow& row) {
    result.measurements.add(row.segment, row.coefficients, row.deviation);
  });
  Eigen::Index at = 0;
  result.residual = result.measurements.merge([&](Eigen::Index first, const auto& band, const auto& rest) {
    result.information_factor.add(at, first, band);
    result.rhs(at++) = rest(0);
  });
  at = 0;
  (void)result.criterion_rows.merge([&](Eigen::Index first, const auto& band, const auto& /*rest*/) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      for (Eigen::Index k = 0; k < 3 && first + k <= at + 2 && first + k < basis.coefficients(); ++k) {
        if (first + k >= at) {
          result.criterion_factor.at(3 * at + axis, 3 * (first + k) + axis) = band(k);
        }
      }
    }
    ++at;
  });
  constexpr double kDetermined = 1e-9;  // of a column's length: below it the motion is free but for rounding
  for (Eigen::Index i = 0; i < p; ++i) {
    double length = 0.0;
    for (Eigen::Index k = std::max<Eigen::Index>(0, i - 8); k <= i; ++k) {
      length = std::hypot(length, result.information_factor.at(k, i));
    }
    if (!(std::abs(result.information_factor.at(i, i)) > kDetermined * length)) {
      const Eigen::Index segment = std::clamp<Eigen::Index>(i / 3 - 1, 0, basis.segments() - 1);
      throw Error({"measurements",
                   "too few near " + std::to_string(basis.knot(segment)) + " s to determine the motion there",
                   std::string("measurements without gaps for a banded problem") + detail::kOtherwise});
    }
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI
