// SPDX-License-Identifier: Apache-2.0
/// @file
/// The reference path: a straight line or samples joined smoothly.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"

namespace trammel::inline TRAMMEL_ABI::trajectory {

/// Path that measurements are linearised about: it passes through samples and has a continuous velocity.
///
/// Samples are joined by the cubic spline with continuous acceleration whose first two and last two pieces
/// are one cubic each ("not a knot"; de Boor 1978, "A practical guide to splines", chapter IV): its error is
/// of fourth order in the spacing up to the ends. Two samples make a line, three a parabola; a straight line
/// is a path of its own that never ends. Cost: O(n) to make, O(log n) per time.
class NominalTrajectory {
 public:
  /// Uniform motion from `position_m` at `begin_s`, defined at all times.
  static NominalTrajectory line(double begin_s, const Eigen::Vector3d& position_m,
                                const Eigen::Vector3d& velocity_mps) {
    require(position_m.allFinite() && velocity_mps.allFinite() && std::isfinite(begin_s), "nominal",
            "a value that is not finite", "finite position and velocity");
    NominalTrajectory result;
    result.unlimited_ = true;
    result.times_s_ = {begin_s, begin_s + 1.0};
    result.pieces_.push_back({position_m, velocity_mps, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
    return result;
  }

  /// Through samples. Throws Error unless there are at least two, finite, with strictly increasing times;
  /// `whose` names them in messages.
  static NominalTrajectory through(std::vector<double> times_s,
                                   const std::vector<Eigen::Vector3d>& positions_m,
                                   const std::string& whose = "nominal") {
    check(times_s, positions_m, whose);
    NominalTrajectory result;
    result.times_s_ = std::move(times_s);
    result.join(positions_m);
    return result;
  }

  /// Whether the path is known at `t_s`, up to rounding of the times.
  [[nodiscard]] bool covers(double t_s) const noexcept {
    const double slack = kTimeRounding * (std::abs(times_s_.front()) + std::abs(times_s_.back()));
    return unlimited_ || (t_s >= times_s_.front() - slack && t_s <= times_s_.back() + slack);
  }
  [[nodiscard]] double begin_s() const noexcept { return times_s_.front(); }
  [[nodiscard]] double end_s() const noexcept { return times_s_.back(); }

  /// Position (m) at a time: float, double or a dual number. Only where covers(t).
  template <class Scalar>
  [[nodiscard]] Eigen::Matrix<Scalar, 3, 1> position(const Scalar& t_s) const {
    const std::size_t i = piece_at(t_s);
    const Scalar u = t_s - Scalar(times_s_[i]);
    return value<Scalar>(i, 0) +
           u * (value<Scalar>(i, 1) + u * (value<Scalar>(i, 2) + u * value<Scalar>(i, 3)));
  }
  /// Velocity (m/s).
  template <class Scalar>
  [[nodiscard]] Eigen::Matrix<Scalar, 3, 1> velocity(const Scalar& t_s) const {
    const std::size_t i = piece_at(t_s);
    const Scalar u = t_s - Scalar(times_s_[i]);
    return value<Scalar>(i, 1) + u * (Scalar(2) * value<Scalar>(i, 2) + Scalar(3) * u * value<Scalar>(i, 3));
  }
  /// Largest acceleration (m/s^2) between begin_s and end_s: it is linear on each piece.
  [[nodiscard]] double largest_acceleration_mps2() const {
    double largest = 0.0;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const Eigen::Vector3d begin = 2 * pieces_[i][2];
      const Eigen::Vector3d end = begin + 6 * (times_s_[i + 1] - times_s_[i]) * pieces_[i][3];
      largest = std::max({largest, begin.norm(), end.norm()});
    }
    return largest;
  }
  /// Acceleration (m/s^2).
  template <class Scalar>
  [[nodiscard]] Eigen::Matrix<Scalar, 3, 1> acceleration(const Scalar& t_s) const {
    const std::size_t i = piece_at(t_s);
    const Scalar u = t_s - Scalar(times_s_[i]);
    return Scalar(2) * value<Scalar>(i, 2) + Scalar(6) * u * value<Scalar>(i, 3);
  }

 private:
  /// Times that were meant to be equal may differ by a few units in the last place (steps, decimal files).
  static constexpr double kTimeRounding = 1e-12;

  /// x(t) = c_0 + c_1 u + c_2 u^2 + c_3 u^3, u = t - start of the piece.
  using Cubic = std::array<Eigen::Vector3d, 4>;

  NominalTrajectory() = default;

  static void check(const std::vector<double>& times_s, const std::vector<Eigen::Vector3d>& positions_m,
                    const std::string& whose) {
    require(times_s.size() >= 2, whose + " samples", std::to_string(times_s.size()), "at least 2");
    require(
        times_s.size() == positions_m.size(), whose + " samples",
        std::to_string(positions_m.size()) + " positions for " + std::to_string(times_s.size()) + " times",
        "as many positions as times");
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const bool finite = std::isfinite(times_s[i]) && positions_m[i].allFinite();
      if (!finite || (i > 0 && !(times_s[i] > times_s[i - 1]))) {
        throw Error({whose + " sample " + std::to_string(i + 1),
                     finite ? "time " + shortest(times_s[i]) + " s" : "a value that is not finite",
                     finite ? "a time after " + shortest(times_s[i - 1]) + " s" : "finite values"});
      }
    }
  }

  template <class Scalar>
  [[nodiscard]] std::size_t piece_at(const Scalar& t_s) const {
    const auto after = std::upper_bound(times_s_.begin() + 1, times_s_.end() - 1, t_s,
                                        [](const Scalar& t, double k) { return t < Scalar(k); });
    return static_cast<std::size_t>(after - times_s_.begin()) - 1;
  }

  template <class Scalar>
  [[nodiscard]] Eigen::Matrix<Scalar, 3, 1> value(std::size_t piece, std::size_t power) const {
    return pieces_[piece][power].template cast<Scalar>();
  }

  void join(const std::vector<Eigen::Vector3d>& x) {
    const std::size_t n = times_s_.size();
    std::vector<double> h(n - 1);
    std::vector<Eigen::Vector3d> slope(n - 1);
    for (std::size_t i = 0; i + 1 < n; ++i) {
      h[i] = times_s_[i + 1] - times_s_[i];
      slope[i] = (x[i + 1] - x[i]) / h[i];
    }
    const std::vector<Eigen::Vector3d> v = velocities(h, slope);
    for (std::size_t i = 0; i + 1 < n; ++i) {
      const Eigen::Vector3d bend = v[i] + v[i + 1] - 2 * slope[i];
      pieces_.push_back({x[i], v[i], (slope[i] - v[i] - bend) / h[i], bend / (h[i] * h[i])});
    }
  }

  /// Velocities at the samples that make the acceleration continuous: a tridiagonal system, by elimination.
  static std::vector<Eigen::Vector3d> velocities(const std::vector<double>& h,
                                                 const std::vector<Eigen::Vector3d>& slope) {
    const std::size_t n = h.size() + 1;
    if (n == 2) {
      return {slope[0], slope[0]};
    }
    std::vector<double> diagonal(n);
    std::vector<double> upper(n, 0.0);
    std::vector<double> lower(n, 0.0);
    std::vector<Eigen::Vector3d> v(n);
    for (std::size_t i = 1; i + 1 < n; ++i) {
      lower[i] = h[i];
      diagonal[i] = 2 * (h[i - 1] + h[i]);
      upper[i] = h[i - 1];
      v[i] = 3 * (h[i] * slope[i - 1] + h[i - 1] * slope[i]);
    }
    if (n == 3) {  // one parabola: the chord's slope is the mean of the end velocities
      diagonal[0] = upper[0] = 1.0;
      v[0] = 2 * slope[0];
      diagonal[2] = lower[2] = 1.0;
      v[2] = 2 * slope[1];
    } else {
      const auto end = [](double near, double far, const Eigen::Vector3d& s_near,
                          const Eigen::Vector3d& s_far) {
        const double both = near + far;
        return Eigen::Vector3d(((near + 2 * both) * far * s_near + near * near * s_far) / both);
      };
      diagonal[0] = h[1];
      upper[0] = h[0] + h[1];
      v[0] = end(h[0], h[1], slope[0], slope[1]);
      diagonal[n - 1] = h[n - 3];
      lower[n - 1] = h[n - 2] + h[n - 3];
      v[n - 1] = end(h[n - 2], h[n - 3], slope[n - 2], slope[n - 3]);
    }
    for (std::size_t i = 1; i < n; ++i) {
      const double factor = lower[i] / diagonal[i - 1];
      diagonal[i] -= factor * upper[i - 1];
      v[i] -= factor * v[i - 1];
    }
    v[n - 1] /= diagonal[n - 1];
    for (std::size_t i = n - 1; i-- > 0;) {
      v[i] = (v[i] - upper[i] * v[i + 1]) / diagonal[i];
    }
    return v;
  }

  bool unlimited_ = false;
  std::vector<double> times_s_;
  std::vector<Cubic> pieces_;
};

}  // namespace trammel::inline TRAMMEL_ABI::trajectory
