// SPDX-License-Identifier: Apache-2.0
/// @file
/// The observer's optimal control problem solved without any of its theory: piecewise constant controls and
/// limited-memory BFGS. Its cost is that of a feasible path, so it approaches the optimum only from above.
///
/// While the control is constant, the tangents are linear in s = 1/x and dt/x^2 = -ds/V: two Gauss points in
/// s give the information of a step exactly, however close the beacon. The steps are equal in s, which
/// resolves the path's waves.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>

#include "trammel/linalg/extended_double.hpp"
#include "trammel/observer/plan_problem.hpp"

namespace trammel::test {

class DirectTranscription {
 public:
  /// Covariances come so close to singular that an inverse in 19 digits errs in the sixth.
  using Extended = linalg::ExtendedDouble;
  using ExtendedMatrix = Eigen::Matrix<Extended, 3, 3>;

  DirectTranscription(const observer::PlanProblem& problem, int steps)
      : problem_(problem),
        steps_(steps),
        inverse_x_(static_cast<std::size_t>(steps) + 1),
        step_(steps),
        root_step_(2 * steps),
        prior_(problem.covariance_m2.cast<Extended>().inverse()) {
    const double first = 1.0 / problem.position_m.x();
    const double last = 1.0 / problem.final_x_m();
    for (int k = 0; k <= steps; ++k) {
      inverse_x_[static_cast<std::size_t>(k)] = first + (last - first) * k / steps;
    }
    for (int k = 0; k < steps; ++k) {
      const auto i = static_cast<std::size_t>(k);
      step_[k] =
          (inverse_x_[i] - inverse_x_[i + 1]) / (inverse_x_[i] * inverse_x_[i + 1] * problem.speed_mps);
      root_step_.segment<2>(2 * k).setConstant(std::sqrt(step_[k]));
    }
  }

  /// Controls (times the roots of their durations) of a straight flight plus a weave of `half_waves`.
  [[nodiscard]] Eigen::VectorXd weave(double amplitude_mps, double direction, int half_waves) const {
    Eigen::VectorXd u(2 * steps_);
    for (int k = 0; k < steps_; ++k) {
      const double wave = amplitude_mps * std::cos(std::numbers::pi * half_waves * (k + 0.5) / steps_);
      u[2 * k] = wave * std::cos(direction);
      u[2 * k + 1] = wave * std::sin(direction);
    }
    return project(u.cwiseProduct(root_step_));
  }

  /// Mean controls of a given path, times the roots of the steps' durations.
  template <class Path>
  [[nodiscard]] Eigen::VectorXd from_path(const Path& path) const {
    Eigen::VectorXd u(2 * steps_);
    Eigen::Vector2d before = problem_.position_m.tail<2>();
    for (int k = 0; k < steps_; ++k) {
      const Eigen::Vector2d after = path.position(1.0 / inverse_x_[static_cast<std::size_t>(k) + 1]);
      u.segment<2>(2 * k) = (after - before) / step_[k];
      before = after;
    }
    return project(u.cwiseProduct(root_step_));
  }

  /// Local minimum from `u`; returns the cost.
  [[nodiscard]] double minimise(Eigen::VectorXd u) const {
    constexpr std::size_t kMemory = 20;
    constexpr int kMaxIterations = 3000;
    std::deque<Eigen::VectorXd> moves;
    std::deque<Eigen::VectorXd> changes;
    Eigen::VectorXd gradient;
    double cost = evaluate(u, gradient);
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      Eigen::VectorXd direction = -gradient;
      std::vector<double> alphas(moves.size());
      for (std::size_t i = moves.size(); i-- > 0;) {
        alphas[i] = moves[i].dot(direction) / moves[i].dot(changes[i]);
        direction -= alphas[i] * changes[i];
      }
      direction *= moves.empty() ? 0.5 : moves.back().dot(changes.back()) / changes.back().squaredNorm();
      for (std::size_t i = 0; i < moves.size(); ++i) {
        direction += (alphas[i] - changes[i].dot(direction) / moves[i].dot(changes[i])) * moves[i];
      }
      const double slope = gradient.dot(direction);
      double length = 1.0;
      bool moved = false;
      for (int halving = 0; halving < 40 && slope < 0.0; ++halving, length *= 0.5) {
        Eigen::VectorXd next_gradient;
        const Eigen::VectorXd next = project(u + length * direction);
        const double next_cost = evaluate(next, next_gradient);
        if (next_cost <= cost + 1e-4 * length * slope) {
          const Eigen::VectorXd move = next - u;
          const Eigen::VectorXd change = next_gradient - gradient;
          moved = cost - next_cost > 1e-14 * cost;
          u = next;
          gradient = next_gradient;
          cost = next_cost;
          if (move.dot(change) > 0.0) {
            moves.push_back(move);
            changes.push_back(change);
            if (moves.size() > kMemory) {
              moves.pop_front();
              changes.pop_front();
            }
          }
          break;
        }
      }
      if (!moved) {
        break;
      }
    }
    return cost;
  }

 private:
  /// The part of `u` along the controls that shift the end point of one axis.
  [[nodiscard]] double along(const Eigen::VectorXd& u, int axis) const {
    double sum = 0.0;
    for (int k = 0; k < steps_; ++k) {
      sum += u[2 * k + axis] * root_step_[2 * k + axis];
    }
    return sum / step_.sum();
  }
  void shift(Eigen::VectorXd& u, int axis, double change) const {
    for (int k = 0; k < steps_; ++k) {
      u[2 * k + axis] += change * root_step_[2 * k + axis];
    }
  }

  /// Shifts the controls so that the end point is met.
  [[nodiscard]] Eigen::VectorXd project(Eigen::VectorXd u) const {
    const Eigen::Vector2d goal = (problem_.terminal_m - problem_.position_m.tail<2>()) / step_.sum();
    for (int axis = 0; axis < 2; ++axis) {
      shift(u, axis, goal[axis] - along(u, axis));
    }
    return u;
  }

  /// Cost and its gradient within the controls that meet the end point.
  double evaluate(const Eigen::VectorXd& scaled, Eigen::VectorXd& gradient) const {
    constexpr std::array<double, 2> kNodes{0.21132486540518713, 0.7886751345948129};
    const double noise = problem_.sigma0 * problem_.sigma0 * problem_.measurement_interval_s;
    const double speed = problem_.speed_mps;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    Eigen::Vector2d position = problem_.position_m.tail<2>();
    // At the Gauss points, two per step.
    std::vector<Eigen::Vector2d> tangents(2 * static_cast<std::size_t>(steps_));
    const auto node = [&](int k, std::size_t g) {
      const auto i = static_cast<std::size_t>(k);
      return inverse_x_[i] + kNodes[g] * (inverse_x_[i + 1] - inverse_x_[i]);
    };
    const auto flown = [&](int k, double s) {
      const double s0 = inverse_x_[static_cast<std::size_t>(k)];
      return (s0 - s) / (s * s0 * speed);  // time since the start of the step
    };
    const double weight = 0.5 * (inverse_x_.front() - inverse_x_.back()) / (steps_ * speed * noise);
    for (int k = 0; k < steps_; ++k) {
      const Eigen::Vector2d u = scaled.segment<2>(2 * k) / root_step_[2 * k];
      for (std::size_t g = 0; g < 2; ++g) {
        const double s = node(k, g);
        const Eigen::Vector2d tangent = (position + u * flown(k, s)) * s;
        tangents[2 * static_cast<std::size_t>(k) + g] = tangent;
        mean += tangent / (2.0 * steps_);
      }
      position += u * step_[k];
    }
    // In the coordinates x, y - mean x, z - mean x the flight's information is diagonal and nothing cancels.
    double variance = 0.0;
    for (Eigen::Vector2d& tangent : tangents) {
      tangent -= mean;
      variance += tangent.squaredNorm();
    }
    ExtendedMatrix shear = ExtendedMatrix::Identity();
    shear.block<2, 1>(1, 0) = mean.cast<Extended>();
    ExtendedMatrix information = shear.transpose() * prior_ * shear;
    information(0, 0) += weight * variance;
    information(1, 1) += 2.0 * weight * steps_;
    information(2, 2) += 2.0 * weight * steps_;
    const ExtendedMatrix covariance = information.inverse();
    const ExtendedMatrix beta = shear.transpose() * problem_.beta_per_s.cast<Extended>().asDiagonal() * shear;
    // d tr(beta Gamma) = -tr(W dD), W = Gamma beta Gamma.
    const Eigen::Matrix3d w = (covariance * beta * covariance).cast<double>();
    gradient.resize(2 * steps_);
    Eigen::Vector2d later =
        Eigen::Vector2d::Zero();  // derivative with respect to the position after this step
    for (int k = steps_ - 1; k >= 0; --k) {
      Eigen::Vector2d by_control = later * step_[k];
      for (std::size_t g = 0; g < 2; ++g) {
        const double s = node(k, g);
        const Eigen::Vector2d by_tangent =
            -2.0 * weight * (w(0, 0) * tangents[2 * static_cast<std::size_t>(k) + g] - w.col(0).tail<2>());
        later += by_tangent * s;
        by_control += by_tangent * (s * flown(k, s));
      }
      gradient.segment<2>(2 * k) = by_control / root_step_[2 * k] + 2.0 * scaled.segment<2>(2 * k);
    }
    for (int axis = 0; axis < 2; ++axis) {
      shift(gradient, axis, -along(gradient, axis));
    }
    return static_cast<double>((beta * covariance).trace()) + scaled.squaredNorm();
  }

  observer::PlanProblem problem_;
  int steps_;
  std::vector<double> inverse_x_;  ///< at the ends of the steps, 1/m
  Eigen::VectorXd step_;           ///< durations, s
  Eigen::VectorXd root_step_;      ///< their roots, once per axis
  ExtendedMatrix prior_;
};

/// Best of several starts at a vehicle's `speed`.
inline double best_direct_cost(const DirectTranscription& direct, double speed_mps) {
  double best = direct.minimise(direct.weave(0.0, 0.0, 1));
  for (const double amplitude : {0.02, 0.2}) {
    for (int quarter = 0; quarter < 4; ++quarter) {
      best = std::min(best, direct.minimise(direct.weave(amplitude * speed_mps,
                                                         (0.5 * std::numbers::pi) * quarter + 0.4, 1)));
    }
  }
  return best;
}

}  // namespace trammel::test
