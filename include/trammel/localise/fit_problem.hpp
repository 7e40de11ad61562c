// SPDX-License-Identifier: Apache-2.0
/// @file
/// The measurements of a scenario as a nonlinear least-squares problem within bounds.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/problem/assemble.hpp"
#include "trammel/problem/scenario.hpp"
#include "trammel/sensor/any_sensor.hpp"
#include "trammel/trajectory/spline_basis.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

namespace detail {

/// The columns of a matrix between the first and the last that are not zero.
struct NonzeroColumns {
  Eigen::Index first = 0;
  Eigen::Index count = 0;
};

[[nodiscard]] NonzeroColumns nonzero_columns(const Eigen::Ref<const Eigen::MatrixXd>& rows);

}  // namespace detail

/// Value, gradient and curvature of a cost at one deviation.
struct Quadratic {
  double cost = 0.0;         ///< F
  double chi2 = 0.0;         ///< |r|^2
  Eigen::VectorXd gradient;  ///< of F, p
  Eigen::MatrixXd hessian;   ///< Gauss-Newton part A'A plus the barriers' Hessian, p x p
};

/// Deviations from the reference within the bounds, fitted to the observations: minimise over z
///
///   F(z) = |r(z)|^2/2 - mu sum_l ln(1 - |a_l z|^2) - mu (s/n) sum_j ln(x_3(tau_j) - h_min).
///
/// | symbol | meaning                                                                         | shape |
/// |--------|---------------------------------------------------------------------------------|-------|
/// | z      | deviation, in the coordinates of assemble(scenario)                             | p     |
/// | r      | L_k^-1 (y_k - h(x(u_k) - q_k(u_k)) - b_k) stacked, azimuth differences in       | -     |
/// |        | (-pi, pi]; u_k = t_k + time offset of the station, q_k its position, b_k its    |       |
/// |        | biases                                                                          |       |
/// | A      | minus the derivative of r: what a linearisation about z whitens                 | - x p |
/// | a_l    | bound l of the motion (s = segments + 2) or of a station's biases               | - x p |
/// | tau_j  | four times per segment and the end, n = 4 segments + 1                          | n     |
/// | h_min  | height floor (m) in the scenario's frame; the last term only where there is one | -     |
/// | mu     | weight of the barriers                                                          | -     |
///
/// Cost of an evaluation: O(n_k + p) for the value, O(n_k + p^2) with derivatives (where motion parameters
/// are removed, rows are dense and cost p times as much).
class FitProblem {
 public:
  /// Throws Error as assemble does, and for a scenario without observations.
  explicit FitProblem(const Scenario& scenario, std::optional<double> minimum_height_m = {});

  /// The same measurements and bounds with another floor.
  [[nodiscard]] FitProblem with_minimum_height(double height_m) const;

  [[nodiscard]] const TrajectoryProblem& trajectory() const noexcept { return trajectory_; }
  [[nodiscard]] const Scenario& scenario() const noexcept { return scenario_; }
  [[nodiscard]] std::optional<double> minimum_height_m() const noexcept { return minimum_height_m_; }
  [[nodiscard]] const std::vector<double>& grid_s() const noexcept { return grid_s_; }
  [[nodiscard]] Eigen::Index parameters() const { return trajectory_.coordinates.parameters(); }

  /// F; infinite outside the bounds, at or below the floor, and where a sensor is not differentiable.
  [[nodiscard]] double cost(const Eigen::VectorXd& z, double mu) const;
  /// F with derivatives; where F is infinite, that alone.
  [[nodiscard]] Quadratic expand(const Eigen::VectorXd& z, double mu) const;
  /// r at z, three numbers per measurement with zeros past its last component; `A`: minus the derivative,
  /// 3 n x p. Throws Error where a sensor is not differentiable.
  [[nodiscard]] Eigen::VectorXd residuals(const Eigen::VectorXd& z, Eigen::MatrixXd* A = nullptr) const;
  /// |r|^2; infinite where a sensor is not differentiable.
  [[nodiscard]] double chi2(const Eigen::VectorXd& z) const;
  /// -sum_l ln(1 - |a_l z|^2); infinite outside.
  [[nodiscard]] double ellipsoid_barrier(const Eigen::VectorXd& z) const;
  /// Lowest height (m) on the grid.
  [[nodiscard]] double lowest_height_m(const Eigen::VectorXd& z) const;
  /// Whether all bounds and the floor hold strictly.
  [[nodiscard]] bool inside(const Eigen::VectorXd& z) const;
  /// |C (a - b)|: root mean square distance over the criterion, m.
  [[nodiscard]] double distance_m(const Eigen::VectorXd& a, const Eigen::VectorXd& b) const;
  /// Every bound shrunk to at most `share` of its ellipsoid, then all towards `centre` (strictly inside)
  /// until above the floor.
  [[nodiscard]] Eigen::VectorXd pull_inside(const Eigen::VectorXd& z, double share,
                                            const Eigen::VectorXd& centre) const;

 private:
  /// A measurement and what it is compared with.
  struct Site {
    SensorKind kind = SensorKind::kRange;
    std::size_t station = 0;
    double t_s = 0.0;
    RelativeMotion reference;  ///< at t_s
    trajectory::LocalBasis<double> local;
    Eigen::Matrix3d whiten;  ///< L^-1
    sensor::Padded value;
  };
  /// Rows in z without their zero columns left and right.
  struct LocalRows {
    Eigen::Index first = 0;
    Eigen::MatrixXd rows;
    Eigen::MatrixXd gram;  ///< rows' rows

    [[nodiscard]] Eigen::VectorXd times(const Eigen::VectorXd& z) const {
      return rows * z.segment(first, rows.cols());
    }
  };
  /// A deviation as the measurements see it.
  struct Deviation {
    Eigen::MatrixXd coefficients;  ///< 3 x (r + 2)
    Eigen::VectorXd biases;
    std::vector<double> time_offsets_s;  ///< per station
  };
  /// What one measurement is made of.
  struct Sighting {
    trajectory::LocalBasis<double> local;  ///< when it is made
    RelativeMotion motion;
    sensor::Padded bias = sensor::Padded::Zero();
  };

  void set_minimum_height(std::optional<double> height_m);
  [[nodiscard]] static LocalRows localise_rows(const Eigen::MatrixXd& rows);
  [[nodiscard]] Deviation unpack(const Eigen::VectorXd& z) const;
  [[nodiscard]] Sighting see(const Site& site, const Deviation& deviation) const;
  /// Heights (m) on the grid.
  [[nodiscard]] Eigen::VectorXd heights_m(const Eigen::VectorXd& z) const;
  [[nodiscard]] double floor_barrier(const Eigen::VectorXd& z) const;
  /// |r|^2; A'A is added to `normal` and r'A to `descent`, before parameters are removed. Throws Error where
  /// a sensor is not differentiable.
  [[nodiscard]] double expand_misfit(const Deviation& deviation, Eigen::MatrixXd& normal,
                                     Eigen::MatrixXd& descent) const;

  Scenario scenario_;
  std::optional<double> minimum_height_m_;
  TrajectoryProblem trajectory_;
  std::vector<Site> sites_;
  std::vector<double> grid_s_;
  std::vector<LocalRows> bounds_;       ///< a_l
  std::vector<LocalRows> height_rows_;  ///< of the deviation's height on the grid
  Eigen::VectorXd height_offset_m_;     ///< the reference's height there
};

}  // namespace trammel::inline TRAMMEL_ABI::localise

#ifndef TRAMMEL_COMPILED
#include "trammel/localise/fit_problem_impl.hpp"
#endif
