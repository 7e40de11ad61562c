// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of general_weight.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "trammel/linalg/lu.hpp"
#include "trammel/linalg/small_cholesky.hpp"
#include "trammel/observer/general_weight.hpp"
#include "trammel/observer/single_weight.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

TRAMMEL_INLINE GeneralWeightDual::GeneralWeightDual(const ChannelProblem& problem,
                                                    const Eigen::Vector3d& beta)
    : problem_(problem),
      beta_(beta),
      root_(beta.cwiseSqrt()),
      critical_(problem.critical_frequency()),
      scale_(problem.sigma * problem.gain) {
  const Eigen::Vector2d precision = problem.prior_precision + Eigen::Vector2d::Constant(problem.gain);
  const Eigen::Matrix2d lateral = problem.rotation.to_axes_matrix(precision.cwiseInverse());
  constant_ = beta.y() * lateral(0, 0) + beta.z() * lateral(1, 1);
}

TRAMMEL_INLINE Eigen::Vector2d GeneralWeightDual::force(const Eigen::Vector3d& p) const {
  const Eigen::Vector2d pull =
      problem_.rotation.to_channels(Eigen::Vector2d(root_.y() * p.y(), root_.z() * p.z()) / p.squaredNorm());
  return problem_.prior_precision.cwiseProduct(problem_.offset) - pull;
}

TRAMMEL_INLINE DualPoint GeneralWeightDual::complete(const Eigen::Vector3d& p, const Frequency& f,
                                                     const Eigen::Vector2d& wave) const {
  ++evaluations_;
  const PathValue value = evaluate(problem_, f, wave);
  const Eigen::Vector2d b = problem_.rotation.to_axes(value.slope);
  const Eigen::Vector3d aim(root_.x(), root_.y() * b.x(), root_.z() * b.y());
  DualPoint point;
  point.p = p;
  point.shape = {f.xi, wave};
  point.gradient = aim - value.range_information * p;
  point.value =
      2.0 * aim.dot(p) - p.squaredNorm() * value.range_information + value.control_energy + constant_;
  return point;
}

TRAMMEL_INLINE DualPoint GeneralWeightDual::at(const Eigen::Vector3d& p) const {
  const Frequency f(scale_ * p.norm());
  const Eigen::Vector2d pulled = force(p);
  const Eigen::Vector2d v = problem_.stiffness(f);
  Eigen::Vector2d wave;
  for (int i = 0; i < 2; ++i) {
    wave[i] = pulled[i] == 0.0 ? 0.0 : pulled[i] / v[i];
  }
  return complete(p, f, wave);
}

TRAMMEL_INLINE DualPoint GeneralWeightDual::at_boundary(const Eigen::Vector3d& p) const {
  const Frequency f(critical_);
  const Eigen::Vector2d pulled = force(p);
  const Eigen::Vector2d v = problem_.stiffness(f);
  Eigen::Vector2d wave = Eigen::Vector2d::Zero();
  for (int i = 0; i < 2; ++i) {
    // g does not depend on the amplitude of a channel whose v and force are both zero.
    if (i != problem_.weak_channel() &&
        v[i] > detail::kSingularStiffness * (problem_.prior_precision[i] + problem_.gain)) {
      wave[i] = pulled[i] / v[i];
    }
  }
  return complete(p, f, wave);
}

TRAMMEL_INLINE DualPoint GeneralWeightDual::best_on_boundary() const {
  constexpr int kSamples = 64;
  constexpr double kGolden = 0.38196601125010515;
  constexpr int kGoldenSteps = 60;
  DualPoint best;
  best.value = -std::numeric_limits<double>::infinity();
  const int weak = problem_.weak_channel();
  const Eigen::Vector2d axis = problem_.rotation.to_axes(Eigen::Vector2d::Unit(weak));
  const Eigen::Vector2d target = problem_.prior_precision.cwiseProduct(problem_.offset) * radius() * radius();
  Eigen::Vector3d normal(0.0, root_.y() * axis.x(), root_.z() * axis.y());
  const Eigen::Vector2d v = problem_.stiffness(Frequency(critical_));
  const bool both =
      v[1 - weak] <= detail::kSingularStiffness * (problem_.prior_precision[1 - weak] + problem_.gain);
  double offset = 0.0;
  if (both) {
    // Equal precisions: both forces must vanish, which fixes p up to the sign of its first component.
    const Eigen::Vector2d goal = problem_.rotation.to_axes(target);
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    for (int i = 0; i < 2; ++i) {
      if (goal[i] != 0.0) {
        p[i + 1] = goal[i] / root_[i + 1];  // infinite without a weight: not feasible
      }
    }
    const double rest = radius() * radius() - p.squaredNorm();
    if (rest >= 0.0) {
      p[0] = std::sqrt(rest);
      best = at_boundary(p);
    }
    return best;
  }
  const double length = normal.norm();
  if (length > 0.0) {
    normal /= length;
    offset = target[weak] / length;
  } else if (target[weak] != 0.0) {
    return best;
  } else {
    // The weak channel lies along an axis without weight: nothing pulls p off the plane of the other two.
    normal = Eigen::Vector3d(0.0, axis.x(), axis.y());
  }
  const double ring_square = radius() * radius() - offset * offset;
  if (!(ring_square >= 0.0)) {
    return best;
  }
  const double ring = std::sqrt(ring_square);
  const Eigen::Vector3d across(0.0, normal.z(), -normal.y());
  const auto value_at = [&](double angle) {
    const DualPoint point = at_boundary(
        offset * normal + ring * (std::cos(angle) * Eigen::Vector3d::UnitX() + std::sin(angle) * across));
    if (point.value > best.value) {
      best = point;
    }
    return point.value;
  };
  // p_1 >= 0 at the maximum; the best sample and its neighbours bracket it.
  const double width = std::numbers::pi / kSamples;
  double centre = 0.0;
  double largest = -std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kSamples; ++i) {
    const double angle = width * i - 0.5 * std::numbers::pi;
    const double value = value_at(angle);
    if (value > largest) {
      largest = value;
      centre = angle;
    }
  }
  double low = centre - width;
  double high = centre + width;
  for (int step = 0; step < kGoldenSteps; ++step) {
    const double first = low + kGolden * (high - low);
    const double second = high - kGolden * (high - low);
    if (value_at(first) < value_at(second)) {
      low = first;
    } else {
      high = second;
    }
  }
  return best;
}

TRAMMEL_INLINE Eigen::Matrix3d GeneralWeightDual::curvature(const Eigen::Vector3d& p) const {
  // Balances truncation and rounding of a central difference.
  constexpr double kRelativeStep = 6e-6;
  const double step = kRelativeStep * p.norm();
  Eigen::Matrix3d jacobian;
  for (int j = 0; j < 3; ++j) {
    Eigen::Vector3d forward = p;
    Eigen::Vector3d backward = p;
    forward[j] += step;
    backward[j] -= step;
    jacobian.col(j) = (at(forward).gradient - at(backward).gradient) / (2.0 * step);
  }
  return 0.5 * (jacobian + jacobian.transpose());
}

TRAMMEL_INLINE Eigen::Vector3d GeneralWeightDual::multipliers(const PathShape& shape) const {
  const PathValue value = evaluate(problem_, Frequency(shape.xi), shape.wave);
  const Eigen::Vector2d b = problem_.rotation.to_axes(value.slope);
  return Eigen::Vector3d(root_.x(), root_.y() * b.x(), root_.z() * b.y()) / value.range_information;
}

TRAMMEL_INLINE double GeneralWeightDual::cost(const PathShape& shape) const {
  const PathValue value = evaluate(problem_, Frequency(shape.xi), shape.wave);
  const Eigen::Vector2d b = problem_.rotation.to_axes(value.slope);
  const double information =
      (beta_.x() + beta_.y() * b.x() * b.x() + beta_.z() * b.y() * b.y()) / value.range_information;
  return information + value.control_energy + constant_;
}

namespace detail {

/// Ascent direction: Newton's, with the curvature shifted until it is negative definite. Scaled variables.
inline Eigen::Vector3d newton_direction(const Eigen::Matrix3d& curvature, const Eigen::Vector3d& gradient) {
  constexpr int kMaxShifts = 60;
  constexpr double kFirstShift = 1e-10;  // of the largest entry
  const double size = curvature.cwiseAbs().maxCoeff();
  double shift = 0.0;
  for (int attempt = 0; attempt < kMaxShifts; ++attempt) {
    const linalg::Cholesky3 factor(shift * Eigen::Matrix3d::Identity() - curvature);
    if (factor.info() == Eigen::Success) {
      const Eigen::Vector3d direction = factor.solve(gradient);
      if (direction.allFinite()) {
        return direction;
      }
    }
    shift = shift == 0.0 ? kFirstShift * size : 4.0 * shift;
  }
  return gradient / std::max(size, std::numeric_limits<double>::min());
}

/// Damped Newton on g inside the ball; returns the best point.
inline DualPoint maximise_dual(const GeneralWeightDual& dual, const Eigen::Vector3d& start) {
  constexpr int kMaxSteps = 100;
  constexpr int kMaxHalvings = 50;
  constexpr double kToBoundary = 0.95;  // of the way to the boundary at most
  constexpr double kArmijo = 1e-4;
  constexpr double kStationary = 1e-15;  // Newton decrement relative to |g|
  const double radius = dual.radius();
  DualPoint point = dual.at(start);
  int polish = 0;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Eigen::Vector3d direction = newton_direction(dual.curvature(point.p), point.gradient);
    const double rise = point.gradient.dot(direction);
    if (!(rise > 0.0)) {
      break;
    }
    // Length at which p + t direction meets the boundary.
    const double dd = direction.squaredNorm();
    const double pd = point.p.dot(direction);
    const double room = std::max(radius * radius - point.p.squaredNorm(), 0.0);
    const double limit = room / (std::sqrt(pd * pd + dd * room) + pd);
    double length = std::min(1.0, kToBoundary * limit);
    // Near the optimum g no longer resolves the rise: full steps polish p by its gradient.
    const bool resolved = rise > kStationary * std::abs(point.value);
    if (!resolved) {
      const DualPoint next = dual.at(point.p + length * direction);
      const bool better = next.gradient.norm() < point.gradient.norm();
      if (better) {
        point = next;
      }
      if (!better || ++polish > 3) {
        break;
      }
      continue;
    }
    bool moved = false;
    for (int halving = 0; halving < kMaxHalvings; ++halving, length *= 0.5) {
      const DualPoint next = dual.at(point.p + length * direction);
      if (next.value >= point.value + kArmijo * length * 2.0 * rise) {
        moved = (next.p - point.p).norm() > 0.0;
        point = next;
        break;
      }
    }
    if (!moved) {
      break;
    }
  }
  return point;
}

/// Local minimisation of the closed form of the cost over (xi, w) by Newton's method with differences. `unit`
/// is the natural size of w; variables are xi and w/unit.
class CostDescent {
 public:
  CostDescent(const GeneralWeightDual& dual, double unit) : dual_(dual), unit_(unit) {}

  [[nodiscard]] double cost(const Eigen::Vector3d& x) const {
    if (!(x[0] >= 0.0 && x[0] < 2.0 * std::numbers::pi)) {
      return std::numeric_limits<double>::infinity();
    }
    const double value = dual_.cost(shape(x));
    return std::isfinite(value) ? value : std::numeric_limits<double>::infinity();
  }
  [[nodiscard]] PathShape shape(const Eigen::Vector3d& x) const { return {x[0], unit_ * x.tail<2>()}; }

  [[nodiscard]] Eigen::Vector3d minimise(Eigen::Vector3d x) const {
    constexpr int kMaxSteps = 80;
    constexpr int kMaxHalvings = 40;
    constexpr double kConverged = 1e-15;
    double here = cost(x);
    for (int step = 0; step < kMaxSteps; ++step) {
      Eigen::Vector3d gradient;
      Eigen::Matrix3d hessian;
      differences(x, here, gradient, hessian);
      if (!gradient.allFinite() || !hessian.allFinite()) {
        break;
      }
      const Eigen::Vector3d direction = newton_direction(-hessian, -gradient);
      const double drop = -gradient.dot(direction);
      if (!(drop > kConverged * std::abs(here))) {
        break;
      }
      double length = 1.0;
      bool moved = false;
      for (int halving = 0; halving < kMaxHalvings; ++halving, length *= 0.5) {
        const Eigen::Vector3d next = x + length * direction;
        const double there = cost(next);
        if (there < here) {
          x = next;
          here = there;
          moved = true;
          break;
        }
      }
      if (!moved) {
        break;
      }
    }
    return x;
  }

 private:
  void differences(const Eigen::Vector3d& x, double here, Eigen::Vector3d& gradient,
                   Eigen::Matrix3d& hessian) const {
    constexpr double kRelativeStep = 1e-4;
    Eigen::Vector3d h;
    h[0] = kRelativeStep * std::min({1.0, x[0], 2.0 * std::numbers::pi - x[0]});
    h[1] = h[2] = kRelativeStep * std::max(x.tail<2>().norm(), kRelativeStep);
    std::array<double, 3> plus{};
    std::array<double, 3> minus{};
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d move = h[i] * Eigen::Vector3d::Unit(i);
      plus[static_cast<std::size_t>(i)] = cost(x + move);
      minus[static_cast<std::size_t>(i)] = cost(x - move);
      const double up = plus[static_cast<std::size_t>(i)];
      const double down = minus[static_cast<std::size_t>(i)];
      gradient[i] = (up - down) / (2.0 * h[i]);
      hessian(i, i) = (up - 2.0 * here + down) / (h[i] * h[i]);
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < i; ++j) {
        const Eigen::Vector3d a = h[i] * Eigen::Vector3d::Unit(i);
        const Eigen::Vector3d b = h[j] * Eigen::Vector3d::Unit(j);
        hessian(i, j) =
            (cost(x + a + b) - cost(x + a - b) - cost(x - a + b) + cost(x - a - b)) / (4.0 * h[i] * h[j]);
        hessian(j, i) = hessian(i, j);
      }
    }
  }

  const GeneralWeightDual& dual_;
  double unit_;
};

/// Undamped Newton on grad(p) = 0, valid also beyond xi_1; empty-handed (returns the input) unless it lowers
/// the cost or keeps it within rounding.
inline PathShape polish_shape(const GeneralWeightDual& dual, const PathShape& shape) {
  constexpr int kMaxSteps = 20;
  constexpr double kRounding = 1e-12;
  constexpr double kConverged = 1e-14;
  DualPoint point = dual.at(dual.multipliers(shape));
  for (int step = 0; step < kMaxSteps; ++step) {
    const linalg::Lu3 factor(dual.curvature(point.p));
    const Eigen::Vector3d correction = factor.solve(point.gradient);
    const Eigen::Vector3d next = point.p - correction;
    if (!next.allFinite() || !(dual.frequency_scale() * next.norm() < 2.0 * std::numbers::pi)) {
      return shape;
    }
    point = dual.at(next);
    if (correction.norm() < kConverged * point.p.norm()) {
      break;
    }
  }
  const double before = dual.cost(shape);
  return dual.cost(point.shape) <= before + kRounding * std::abs(before) ? point.shape : shape;
}

/// Multi-start minimisation for maxima on the boundary of the ball.
inline PathShape minimise_cost(const ChannelProblem& problem, const GeneralWeightDual& dual,
                               const PathShape& dual_shape) {
  const Frequency straight(0.0);
  const double straight_energy = evaluate(problem, straight, Eigen::Vector2d::Zero()).control_energy;
  const double straight_cost = dual.cost(PathShape{});
  PathShape best;
  double best_cost = straight_cost;
  const auto attempt = [&](const PathShape& start) {
    if (!(start.xi > 0.0 && start.xi < 2.0 * std::numbers::pi && start.wave.allFinite())) {
      return;
    }
    // |w| for which the control energy of the wave alone uses up what the straight path could save.
    const Frequency f(start.xi);
    const double xi2 = start.xi * start.xi;
    const double stiffness = 0.5 * problem.speed * xi2 * xi2 * f.cubic_remainder / problem.span;
    const double unit = std::sqrt(std::max(straight_cost - straight_energy, 0.0) / stiffness);
    if (!(unit > 0.0)) {
      return;
    }
    const CostDescent descent(dual, unit);
    Eigen::Vector3d x;
    x << start.xi, start.wave / unit;
    // A start further out than any optimum can be is pulled in.
    const double length = x.tail<2>().norm();
    if (length > 1.0) {
      x.tail<2>() /= length;
    }
    const PathShape shape = descent.shape(descent.minimise(x));
    const double cost = dual.cost(shape);
    if (cost < best_cost) {
      best_cost = cost;
      best = shape;
    }
  };
  attempt(dual_shape);
  constexpr std::array<double, 4> kFrequencies{0.5, 0.9, 1.0, 1.25};  // of xi_1
  constexpr std::array<double, 3> kAmplitudes{0.01, 0.1, 0.6};        // of the largest useful one
  constexpr int kDirections = 8;
  for (const double part : kFrequencies) {
    const double xi = std::min(part * dual.critical(), 2.0 * std::numbers::pi * 0.98);
    const Frequency f(xi);
    const double stiffness = 0.5 * problem.speed * xi * xi * xi * xi * f.cubic_remainder / problem.span;
    const double unit = std::sqrt(std::max(straight_cost - straight_energy, 0.0) / stiffness);
    for (const double amplitude : kAmplitudes) {
      for (int k = 0; k < kDirections; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / kDirections;
        attempt({xi, unit * amplitude * Eigen::Vector2d(std::cos(angle), std::sin(angle))});
      }
    }
  }
  return polish_shape(dual, best);
}

}  // namespace detail

TRAMMEL_INLINE GeneralWeightSolution solve_general_weight(const ChannelProblem& problem,
                                                          const Eigen::Vector3d& beta) {
  constexpr double kGap = 1e-10;         // a tenth of what counts as certified
  constexpr double kTrivialGap = 1e-15;  // the straight path meets its own bound
  constexpr double kStart = 0.6;         // of the ball at most
  const GeneralWeightDual dual(problem, beta);
  GeneralWeightSolution solution;
  solution.critical = dual.critical();
  const PathShape straight;
  const PathValue straight_value = evaluate(problem, Frequency(0.0), straight.wave);
  const double straight_cost = dual.cost(straight);
  // Control energy is least on the straight path and the part `constant` is common to all.
  const double straight_bound = straight_value.control_energy + dual.constant();
  const Eigen::Vector3d multipliers = dual.multipliers(straight);
  const double length = multipliers.norm();
  if (!(problem.gain > 0.0) || !(length > 0.0) ||
      straight_cost - straight_bound <= kTrivialGap * std::abs(straight_cost)) {
    // Without measurements every path gives the same information.
    solution.lower_bound = problem.gain > 0.0 ? straight_bound : straight_cost;
    return solution;
  }
  const DualPoint point =
      detail::maximise_dual(dual, multipliers * std::min(1.0, kStart * dual.radius() / length));
  // An optimum that is straight to rounding is better described by the straight path itself.
  solution.shape = dual.cost(point.shape) < straight_cost ? point.shape : straight;
  solution.lower_bound = std::max(point.value, straight_bound);
  const double cost = dual.cost(solution.shape);
  if (!(cost - solution.lower_bound <= kGap * std::abs(cost))) {
    solution.lower_bound = std::max(solution.lower_bound, dual.best_on_boundary().value);
    const PathShape found = detail::minimise_cost(problem, dual, point.shape);
    if (!(cost <= dual.cost(found))) {
      solution.shape = found;
    }
  }
  solution.evaluations = dual.evaluations();
  return solution;
}

}  // namespace trammel::inline TRAMMEL_ABI::observer
