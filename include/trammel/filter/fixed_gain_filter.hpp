// SPDX-License-Identifier: Apache-2.0
/// @file
/// The alpha-beta family at run time: constant gains, uniform sampling, any number of axes.
#pragma once

#include <array>
#include <cmath>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

namespace detail {

/// x_i += sum_{j > i} dt^(j-i)/(j-i)! x_j for the rows of `state`; powers[m] = dt^m/m!.
template <class Scalar, int Order, int Axes>
inline void advance(Eigen::Matrix<Scalar, Order, Axes>& state, const std::array<Scalar, Order>& powers) {
  for (int axis = 0; axis < Axes; ++axis) {
    for (int i = 0; i + 1 < Order; ++i) {
      Scalar value = state(i, axis);
      for (int j = i + 1; j < Order; ++j) {
        value += powers[static_cast<std::size_t>(j - i)] * state(j, axis);
      }
      state(i, axis) = value;
    }
  }
}

/// dt^m / m!, m = 0..Order-1.
template <class Scalar, int Order>
inline std::array<Scalar, Order> taylor_powers(Scalar dt) {
  std::array<Scalar, Order> powers{};
  Scalar power{1};
  for (int m = 0; m < Order; ++m) {
    powers[static_cast<std::size_t>(m)] = power;
    power *= dt / Scalar(m + 1);
  }
  return powers;
}

}  // namespace detail

/// Predictor-corrector with constant gains for `Axes` independent coordinates:
///
///   x <- Phi(T) x,   u = z - x_0,   x_i <- x_i + kappa_i / (i! T^i) u.
///
/// The same filter on every axis; state row i, column a is the i-th derivative on axis a. A value type: copy
/// it to branch a track. Takes no memory from the heap. Cost: Order (Order + 3) / 2 multiplications per axis.
/// Source: Pichugin, Zimchuk, Kankin (2004), last formulas, for any order (see synthesise).
template <class Scalar, int Order, int Axes = 1>
requires(Order >= 1 && Axes >= 1) class FixedGainFilter {
 public:
  using State = Eigen::Matrix<Scalar, Order, Axes>;
  using Measurement = Eigen::Matrix<Scalar, Axes, 1>;
  using Gains = Eigen::Matrix<Scalar, Order, 1>;

  /// `gains`: dimensionless kappa as the rules give them. Throws Error for gains that are not finite or an
  /// interval that is not positive; stability is the design's business (analyse).
  FixedGainFilter(const Gains& gains, Scalar sampling_s)
      : powers_(detail::taylor_powers<Scalar, Order>(sampling_s)) {
    require(std::isfinite(sampling_s) && sampling_s > Scalar(0), "sampling_s",
            "a number that is not positive", "a positive number of seconds");
    require(gains.allFinite(), "gains", "a number that is not finite", "finite gains");
    Scalar factor{1};
    for (int i = 0; i < Order; ++i) {
      correction_[static_cast<std::size_t>(i)] = gains[i] * factor;
      factor /= sampling_s * Scalar(i + 1);
    }
  }

  /// One interval forward without a measurement (also: coasting over a missing sample).
  void predict() { detail::advance<Scalar, Order, Axes>(state_, powers_); }

  /// Corrects the prediction; returns the innovation. Call after predict.
  Measurement correct(const Measurement& measurement) {
    Measurement innovation;
    for (int axis = 0; axis < Axes; ++axis) {
      const Scalar u = measurement[axis] - state_(0, axis);
      for (int i = 0; i < Order; ++i) {
        state_(i, axis) += correction_[static_cast<std::size_t>(i)] * u;
      }
      innovation[axis] = u;
    }
    return innovation;
  }

  /// predict and correct.
  Measurement update(const Measurement& measurement) {
    predict();
    return correct(measurement);
  }

  [[nodiscard]] const State& state() const { return state_; }
  void set_state(const State& state) { state_ = state; }

 private:
  State state_ = State::Zero();
  std::array<Scalar, Order> powers_;
  std::array<Scalar, Order> correction_;
};

}  // namespace trammel::inline TRAMMEL_ABI::filter
