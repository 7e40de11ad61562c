// SPDX-License-Identifier: Apache-2.0
/// @file
/// The dense time grid of results.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/estimate/path_table.hpp"
#include "trammel/trajectory/nominal_trajectory.hpp"
#include "trammel/trajectory/spline_basis.hpp"

namespace trammel::inline TRAMMEL_ABI::estimate {

/// Rows of the dense grid when no step is asked for.
inline constexpr Eigen::Index kGridRows = 200;

/// Times of the dense grid: EstimateSettings::output_step_s.
[[nodiscard]] inline std::vector<double> output_grid(const trajectory::SplineBasis& basis, double step_s) {
  std::vector<double> times;
  if (step_s > 0.0) {
    // A last step shorter than this part of the others is joined to the one before.
    constexpr double kShort = 1e-6;
    for (Eigen::Index i = 0;; ++i) {
      const double t = basis.begin_s() + static_cast<double>(i) * step_s;
      if (t >= basis.end_s() - kShort * step_s) {
        break;
      }
      times.push_back(t);
    }
  } else {
    const Eigen::Index parts = (kGridRows + basis.segments() - 1) / basis.segments();
    for (Eigen::Index i = 0; i < basis.segments(); ++i) {
      for (Eigen::Index k = 0; k < parts; ++k) {
        times.push_back(basis.knot(i) +
                        basis.length_s(i) * static_cast<double>(k) / static_cast<double>(parts));
      }
    }
  }
  times.push_back(basis.end_s());
  return times;
}

/// The reference path on a grid.
[[nodiscard]] inline PathTable nominal_on_grid(const trajectory::NominalTrajectory& nominal,
                                               const std::vector<double>& times_s) {
  const auto count = static_cast<Eigen::Index>(times_s.size());
  PathTable table{
      .times_s = times_s, .position_m = Eigen::MatrixXd(count, 3), .velocity_mps = Eigen::MatrixXd(count, 3)};
  for (Eigen::Index i = 0; i < count; ++i) {
    table.position_m.row(i) = nominal.position(times_s[static_cast<std::size_t>(i)]).transpose();
    table.velocity_mps.row(i) = nominal.velocity(times_s[static_cast<std::size_t>(i)]).transpose();
  }
  return table;
}

/// rms_m(t) of a guarantee on a grid, with progress told.
template <class Guarantee>
[[nodiscard]] std::vector<double> guaranteed_on_grid(const Guarantee& guarantee,
                                                     const std::vector<double>& times_s,
                                                     const ProgressObserver& observe) {
  std::vector<double> rms_m;
  for (const double t_s : times_s) {
    rms_m.push_back(guarantee.rms_m(t_s));
    if (observe) {
      observe({.phase = "bounds per time",
               .fraction = static_cast<double>(rms_m.size()) / static_cast<double>(times_s.size())});
    }
  }
  return rms_m;
}

}  // namespace trammel::inline TRAMMEL_ABI::estimate
