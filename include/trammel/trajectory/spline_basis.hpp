// SPDX-License-Identifier: Apache-2.0
/// @file
/// Quadratic B-splines: the basis of the motions with piecewise constant acceleration.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"

namespace trammel::inline TRAMMEL_ABI::trajectory {

/// The three basis functions that are not zero at one time.
template <class Scalar>
struct LocalBasis {
  Eigen::Index first = 0;                   ///< index of the first of the three coefficients = the segment
  Eigen::Matrix<Scalar, 1, 3> value;        ///< B_j(t)
  Eigen::Matrix<Scalar, 1, 3> rate;         ///< B_j'(t), 1/s
  Eigen::Matrix<Scalar, 1, 3> second_rate;  ///< B_j''(t), 1/s^2
};

/// Splines of order two and defect one on knots T_0 < T_1 < ... < T_r: continuous position and velocity,
/// acceleration constant on each of the r segments. Per axis
///
///   x(t) = sum_j c_j B_j(t),  j = 0..r+1,
///
/// | symbol | meaning                                                                | shape |
/// |--------|------------------------------------------------------------------------|-------|
/// | T_i    | knots, s                                                               | r + 1 |
/// | B_j    | quadratic B-spline on T_{j-2}..T_{j+1}, the end segments repeated      | r + 2 |
/// |        | beyond both ends                                                       |       |
/// | c_j    | coefficient, m: the motion stays within the hull of three neighbours   | r + 2 |
///
/// At any time only B_i, B_{i+1}, B_{i+2} of segment i differ from zero, so design rows, criterion and bounds
/// are banded; and the basis stays well conditioned however long the flight (de Boor 1978, "A practical guide
/// to splines", chapter XI), unlike the truncated powers in which start, velocity and accelerations enter.
/// Cost: O(log r) per time to find the segment.
class SplineBasis {
 public:
  /// Throws Error unless there are at least two knots, finite and strictly increasing.
  explicit SplineBasis(std::vector<double> knots_s) : knots_s_(std::move(knots_s)) {
    require(knots_s_.size() >= 2, "knots_s", std::to_string(knots_s_.size()) + " knots", "at least 2");
    for (std::size_t i = 0; i < knots_s_.size(); ++i) {
      if (!std::isfinite(knots_s_[i]) || (i > 0 && !(knots_s_[i] > knots_s_[i - 1]))) {
        throw Error({"knots_s[" + std::to_string(i) + "]", std::to_string(knots_s_[i]),
                     i == 0 ? "a finite time"
                            : "a finite time after the knot before, " + std::to_string(knots_s_[i - 1])});
      }
    }
  }

  [[nodiscard]] const std::vector<double>& knots_s() const noexcept { return knots_s_; }
  [[nodiscard]] Eigen::Index segments() const noexcept {
    return static_cast<Eigen::Index>(knots_s_.size()) - 1;
  }
  /// Coefficients per axis, r + 2.
  [[nodiscard]] Eigen::Index coefficients() const noexcept { return segments() + 2; }
  [[nodiscard]] double begin_s() const noexcept { return knots_s_.front(); }
  [[nodiscard]] double end_s() const noexcept { return knots_s_.back(); }
  [[nodiscard]] double duration_s() const noexcept { return end_s() - begin_s(); }
  [[nodiscard]] double length_s(Eigen::Index segment) const { return knot(segment + 1) - knot(segment); }

  /// T_i for i = -1..r+1, the two outer ones repeating the length of the end segments.
  [[nodiscard]] double knot(Eigen::Index i) const {
    if (i < 0) {
      return 2 * knots_s_[0] - knots_s_[1];
    }
    const auto at = static_cast<std::size_t>(i);
    const std::size_t last = knots_s_.size() - 1;
    return at <= last ? knots_s_[at] : 2 * knots_s_[last] - knots_s_[last - 1];
  }

  /// Whether t lies between the first and the last knot, up to rounding of the times.
  [[nodiscard]] bool covers(double t_s) const noexcept {
    const double slack = kTimeRounding * (duration_s() + std::abs(begin_s()) + std::abs(end_s()));
    return t_s >= begin_s() - slack && t_s <= end_s() + slack;
  }

  /// Throws Error naming `where` unless covers(t).
  void require_covers(double t_s, std::string_view where) const {
    if (!covers(t_s)) {
      throw Error({std::string(where), shortest(t_s) + " s",
                   "a time between the first and the last knot, " + std::to_string(begin_s()) + " to " +
                       std::to_string(end_s()) + " s"});
    }
  }

  /// Segment that holds t: i with T_i <= t < T_{i+1}; the last one also at the end. Times before the first
  /// knot belong to the first segment, after the last knot to the last.
  template <class Scalar>
  [[nodiscard]] Eigen::Index segment_at(const Scalar& t_s) const {
    const auto after = std::upper_bound(knots_s_.begin() + 1, knots_s_.end() - 1, t_s,
                                        [](const Scalar& t, double k) { return t < Scalar(k); });
    return static_cast<Eigen::Index>(after - knots_s_.begin()) - 1;
  }

  /// The basis at a time (float, double or a dual number): de Boor's recurrence.
  template <class Scalar>
  [[nodiscard]] LocalBasis<Scalar> at(const Scalar& t_s) const {
    return on_segment(segment_at(t_s), t_s);
  }

  /// The polynomials of `segment` at a time, e.g. its acceleration at its right end.
  template <class Scalar>
  [[nodiscard]] LocalBasis<Scalar> on_segment(Eigen::Index segment, const Scalar& t_s) const {
    // Differences of knots in double, so that float times late in a long flight cost no digits there.
    const double h = length_s(segment);
    const double before = knot(segment + 1) - knot(segment - 1);
    const double after = knot(segment + 2) - knot(segment);
    const Scalar u = (t_s - Scalar(knot(segment))) / Scalar(h);  // 0..1 on the segment
    const Scalar w = Scalar(1) - u;
    const Scalar left = Scalar(h / before);
    const Scalar right = Scalar(h / after);
    const Scalar rate = Scalar(2 / h);
    LocalBasis<Scalar> basis;
    basis.first = segment;
    basis.value << left * w * w, Scalar(1) - left * w * w - right * u * u, right * u * u;
    basis.rate << -rate * left * w, rate * (left * w - right * u), rate * right * u;
    const Scalar second = Scalar(2 / (h * h));
    basis.second_rate << second * left, -second * (left + right), second * right;
    return basis;
  }

 private:
  /// Times that were meant to be equal may differ by a few units in the last place (steps, decimal files).
  static constexpr double kTimeRounding = 1e-12;

  std::vector<double> knots_s_;
};

}  // namespace trammel::inline TRAMMEL_ABI::trajectory
