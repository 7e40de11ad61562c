// SPDX-License-Identifier: Apache-2.0
/// @file
/// The observer's optimal control problem solved without any of its theory: piecewise constant controls,
/// Gauss quadrature of the information, limited-memory BFGS. Its cost is that of a feasible path, so it can
/// approach the optimum only from above.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>

#include "trammel/observer/plan_problem.hpp"

namespace trammel::test {

class DirectTranscription {
 public:
  DirectTranscription(const observer::PlanProblem& problem, int steps)
      : problem_(problem),
        steps_(steps),
        step_(problem.time_to_go_s / steps),
        prior_(problem.covariance_m2.inverse()) {}

  /// Controls of a straight flight plus a sine weave of `periods` half waves.
  [[nodiscard]] Eigen::VectorXd weave(double amplitude_mps, double direction, int half_waves) const {
    Eigen::VectorXd u = Eigen::VectorXd::Zero(2 * steps_);
    for (int k = 0; k < steps_; ++k) {
      const double wave = amplitude_mps * std::cos(std::numbers::pi * half_waves * (k + 0.5) / steps_);
      u[2 * k] = wave * std::cos(direction);
      u[2 * k + 1] = wave * std::sin(direction);
    }
    return project(u);
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
      direction *=
          moves.empty() ? 0.5 / step_ : moves.back().dot(changes.back()) / changes.back().squaredNorm();
      for (std::size_t i = 0; i < moves.size(); ++i) {
        direction += (alphas[i] - changes[i].dot(direction) / moves[i].dot(changes[i])) * moves[i];
      }
      const double slope = gradient.dot(direction);
      double length = 1.0;
      bool moved = false;
      for (int halving = 0; halving < 40 && slope < 0.0; ++halving, length *= 0.5) {
        Eigen::VectorXd next_gradient;
        const Eigen::VectorXd next = u + length * direction;
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
  /// Shifts the controls so that the end point is met.
  [[nodiscard]] Eigen::VectorXd project(Eigen::VectorXd u) const {
    const Eigen::Vector2d goal =
        (problem_.terminal_m - problem_.position_m.tail<2>()) / problem_.time_to_go_s;
    for (int axis = 0; axis < 2; ++axis) {
      double mean = 0.0;
      for (int k = 0; k < steps_; ++k) {
        mean += u[2 * k + axis] / steps_;
      }
      for (int k = 0; k < steps_; ++k) {
        u[2 * k + axis] += goal[axis] - mean;
      }
    }
    return u;
  }

  /// Cost and its gradient within the controls that meet the end point.
  double evaluate(const Eigen::VectorXd& u, Eigen::VectorXd& gradient) const {
    constexpr std::array<double, 4> kNodes{0.06943184420297371, 0.33000947820757187, 0.6699905217924281,
                                           0.9305681557970263};
    constexpr std::array<double, 4> kWeights{0.17392742256872692, 0.32607257743127307, 0.32607257743127307,
                                             0.17392742256872692};
    const double variance = problem_.sigma0 * problem_.sigma0 * problem_.measurement_interval_s;
    const double speed = problem_.speed_mps;
    Eigen::Matrix3d information = prior_;
    Eigen::Vector2d position = problem_.position_m.tail<2>();
    std::vector<Eigen::Vector2d> starts(static_cast<std::size_t>(steps_));
    for (int k = 0; k < steps_; ++k) {
      starts[static_cast<std::size_t>(k)] = position;
      for (std::size_t g = 0; g < 4; ++g) {
        const double x = problem_.position_m.x() + speed * step_ * (k + kNodes[g]);
        const Eigen::Vector2d tangent = (position + u.segment<2>(2 * k) * step_ * kNodes[g]) / x;
        const double weight = step_ * kWeights[g] / (x * x * variance);
        information(0, 0) += weight * tangent.squaredNorm();
        information(1, 0) -= weight * tangent.x();
        information(2, 0) -= weight * tangent.y();
        information(1, 1) += weight;
        information(2, 2) += weight;
      }
      position += u.segment<2>(2 * k) * step_;
    }
    information(0, 1) = information(1, 0);
    information(0, 2) = information(2, 0);
    const Eigen::Matrix3d covariance = information.inverse();
    // d tr(beta Gamma) = -tr(W dD), W = Gamma beta Gamma.
    const Eigen::Matrix3d w = covariance * problem_.beta_per_s.asDiagonal() * covariance;
    gradient.resize(2 * steps_);
    Eigen::Vector2d later =
        Eigen::Vector2d::Zero();  // derivative with respect to the position after this step
    for (int k = steps_ - 1; k >= 0; --k) {
      Eigen::Vector2d by_control = later * step_;
      Eigen::Vector2d by_position = later;
      for (std::size_t g = 0; g < 4; ++g) {
        const double x = problem_.position_m.x() + speed * step_ * (k + kNodes[g]);
        const Eigen::Vector2d tangent =
            (starts[static_cast<std::size_t>(k)] + u.segment<2>(2 * k) * step_ * kNodes[g]) / x;
        const double weight = step_ * kWeights[g] / (x * x * variance);
        const Eigen::Vector2d by_tangent = -2.0 * weight * (w(0, 0) * tangent - w.col(0).tail<2>());
        by_position += by_tangent / x;
        by_control += by_tangent / x * step_ * kNodes[g];
      }
      gradient.segment<2>(2 * k) = by_control + 2.0 * step_ * u.segment<2>(2 * k);
      later = by_position;
    }
    for (int axis = 0; axis < 2; ++axis) {
      double mean = 0.0;
      for (int k = 0; k < steps_; ++k) {
        mean += gradient[2 * k + axis] / steps_;
      }
      for (int k = 0; k < steps_; ++k) {
        gradient[2 * k + axis] -= mean;
      }
    }
    return problem_.beta_per_s.dot(covariance.diagonal()) + step_ * u.squaredNorm();
  }

  observer::PlanProblem problem_;
  int steps_;
  double step_;
  Eigen::Matrix3d prior_;
};

/// Best of several starts.
inline double best_direct_cost(const observer::PlanProblem& problem, int steps) {
  const DirectTranscription direct(problem, steps);
  double best = direct.minimise(direct.weave(0.0, 0.0, 1));
  for (const double amplitude : {0.02, 0.2}) {
    for (int quarter = 0; quarter < 4; ++quarter) {
      best = std::min(best, direct.minimise(direct.weave(amplitude * problem.speed_mps,
                                                         (0.5 * std::numbers::pi) * quarter + 0.4, 1)));
    }
  }
  return best;
}

}  // namespace trammel::test
