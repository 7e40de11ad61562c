// SPDX-License-Identifier: Apache-2.0
/// @file
/// Simulation of a plant with probes in the input, under any causal feedback and any noise.
#pragma once

#include <cmath>
#include <concepts>
#include <string>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"
#include "trammel/linalg/lu.hpp"
#include "trammel/region/plant.hpp"
#include "trammel/region/residuals.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// What a feedback and a noise that reacts may look at: everything up to now. Times before the start give
/// zero.
struct LoopView {
  const ProbedRecord& record;
  int time = 0;
  [[nodiscard]] double y(int lag) const { return record.y_at(time - lag); }
  /// Applied inputs; for a feedback lag is at least 1.
  [[nodiscard]] double u(int lag) const { return record.u_at(time - lag); }
};

/// u_t without probe from what is known at time t.
template <class F>
concept Feedback = requires(F& feedback, const LoopView& view) {
  { feedback(view) } -> std::convertible_to<double>;
};

/// v_t; the view shows outputs before t and inputs up to t - 1.
template <class F>
concept Noise = requires(F& noise, const LoopView& view) {
  { noise(view) } -> std::convertible_to<double>;
};

/// Runs the loop (Amelin 2013, section 2): times -delay ... samples - 1, rest before; u_t is the feedback's
/// value from t = 0 on, and record.gain Delta_n is added at t = period n - delay. `record` brings probe,
/// period and gain; the other members are filled. samples = period * probes.
/// Does not allocate once the sizes are the same. Error if the noise or the feedback is not finite.
template <Feedback F, Noise V>
void simulate_loop(const Plant& plant, F&& feedback, V&& noise, ProbedRecord& record) {
  const int delay = plant.delay;
  const int samples = record.period * static_cast<int>(record.probe.size());
  record.first_time = -delay;
  record.first_probe_time = -delay;
  record.y.setZero(samples + delay);
  record.u.setZero(samples + delay);
  LoopView view{record};
  for (int t = -delay; t < samples; ++t) {
    view.time = t;
    double input = 0.0;
    if (t >= 0) {
      double output = noise(static_cast<const LoopView&>(view));
      for (Eigen::Index j = 0; j < plant.a.size(); ++j) {
        output -= plant.a(j) * record.y_at(t - 1 - static_cast<int>(j));
      }
      for (Eigen::Index j = 0; j < plant.b.size(); ++j) {
        output += plant.b(j) * record.u_at(t - delay - static_cast<int>(j));
      }
      require(std::isfinite(output), [&] {
        return ErrorDetail{"simulate_loop: output at time " + std::to_string(t), "a value that is not finite",
                           "a feedback that keeps the loop bounded and a finite noise"};
      });
      record.y(t + delay) = output;
      input = feedback(static_cast<const LoopView&>(view));
    }
    if ((t + delay) % record.period == 0) {
      const int n = (t + delay) / record.period;
      input += n < record.probe.size() ? record.gain * record.probe(n) : 0.0;
    }
    record.u(t + delay) = input;
  }
}

/// u_t = sum_k output_k y_{t-k} (k from 0) + sum_k input_k u_{t-k} (k from 1).
struct LinearFeedback {
  Eigen::VectorXd output;
  Eigen::VectorXd input;

  double operator()(const LoopView& view) const {
    double value = 0.0;
    for (Eigen::Index k = 0; k < output.size(); ++k) {
      value += output(k) * view.y(static_cast<int>(k));
    }
    for (Eigen::Index k = 0; k < input.size(); ++k) {
      value += input(k) * view.u(static_cast<int>(k) + 1);
    }
    return value;
  }
};

/// Feedback that gives the closed loop A R + B S = P, R u_t = -S y_t (polynomials in the delay operator, R
/// and P start with 1), by solving the linear equations for the coefficients of R and S.
class PolePlacement {
 public:
  /// `characteristic`: P without its leading 1, ascending; missing coefficients are zero (dead-beat: empty).
  /// Error if P has more than na + nb - 1 coefficients. False where A and B have a common factor to working
  /// precision; `feedback` is then unchanged. Does not allocate once the orders are the same.
  bool place(const Plant& plant, const Eigen::VectorXd& characteristic, LinearFeedback& feedback) {
    const Eigen::Index na = plant.a.size();
    const Eigen::Index nb = plant.delay - 1 + plant.b.size();
    const Eigen::Index outputs = std::max<Eigen::Index>(na, 1);
    const Eigen::Index inputs = nb - 1;
    const Eigen::Index size = inputs + outputs;
    require(characteristic.size() <= size, [&] {
      return ErrorDetail{"PolePlacement::place: characteristic",
                         std::to_string(characteristic.size()) + " coefficients",
                         "at most " + std::to_string(size)};
    });
    matrix_.setZero(size, size);
    right_.setZero(size);
    right_.head(characteristic.size()) = characteristic;
    right_.head(na) -= plant.a;
    // Row k is the coefficient of z^(k+1).
    for (Eigen::Index r = 0; r < inputs; ++r) {
      matrix_(r, r) = 1.0;
      matrix_.col(r).segment(r + 1, na) = plant.a;
    }
    for (Eigen::Index s = 0; s < outputs; ++s) {
      matrix_.col(inputs + s).segment(s + plant.delay - 1, plant.b.size()) = plant.b;
    }
    lu_.compute(matrix_);
    solution_ = lu_.solve(right_);
    const double scale = matrix_.cwiseAbs().maxCoeff();
    right_.noalias() -= matrix_ * solution_;
    const double error = right_.cwiseAbs().maxCoeff();
    constexpr double kRegular = 1e-9;  // residual, relative, that a usable solution leaves
    if (!solution_.allFinite() || !(error <= kRegular * (scale * solution_.cwiseAbs().maxCoeff() + 1.0)) ||
        solution_.cwiseAbs().maxCoeff() > 1.0 / kRegular) {
      return false;
    }
    feedback.output = -solution_.tail(outputs);
    feedback.input = -solution_.head(inputs);
    return true;
  }

 private:
  Eigen::MatrixXd matrix_;
  Eigen::VectorXd right_;
  Eigen::VectorXd solution_;
  linalg::Lu lu_;
};

/// Coefficients of (1 - pole z)^count without the leading 1.
[[nodiscard]] inline Eigen::VectorXd repeated_pole(double pole, int count) {
  Eigen::VectorXd polynomial = Eigen::VectorXd::Zero(count + 1);
  polynomial(0) = 1.0;
  for (int k = 1; k <= count; ++k) {
    for (int power = k; power >= 1; --power) {
      polynomial(power) -= pole * polynomial(power - 1);
    }
  }
  return polynomial.tail(count);
}

}  // namespace trammel::inline TRAMMEL_ABI::region
