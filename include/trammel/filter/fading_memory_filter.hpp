// SPDX-License-Identifier: Apache-2.0
/// @file
/// Least squares with fading memory for samples at any times: start-up without a prior, irregular sampling.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"
#include "trammel/filter/fixed_gain_filter.hpp"
#include "trammel/linalg/cholesky.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

/// Fits a polynomial of degree Order - 1 to all samples so far with weight exp(-age/tau):
///
///   Z <- exp(-dt/tau) Phi(-dt)' Z Phi(-dt) + e_0 e_0',   K = Z^-1 e_0,   x <- Phi(dt) x + K u.
///
/// | symbol | meaning                                              | shape, unit             |
/// |--------|------------------------------------------------------|-------------------------|
/// | x      | coordinate and derivatives, one column per axis      | Order x Axes            |
/// | Z      | information, in units of `unit_s`                    | Order x Order           |
/// | K      | gain, the same for all axes                          | Order                   |
/// | tau    | memory; infinite: all samples count alike            | s                       |
/// | u      | innovation                                           | Axes                    |
///
/// Method: Morrison (1969), in information form. The first samples fit polynomials of lower degree, so no
/// prior is needed: after m < Order different times the estimate is the interpolating polynomial of degree
/// m - 1 and the higher derivatives are zero. Uniform sampling with theta = exp(-T/tau) tends to the gains
/// of fading_memory; tau infinite gives expanding_memory.
/// Guarantee: equals the direct weighted least-squares fit. Takes no memory from the heap; a value type.
/// Cost: one Cholesky factorisation of size Order per sample.
template <class Scalar, int Order, int Axes = 1>
requires(Order >= 1 && Axes >= 1) class FadingMemoryFilter {
 public:
  using State = Eigen::Matrix<Scalar, Order, Axes>;
  using Measurement = Eigen::Matrix<Scalar, Axes, 1>;
  using Vector = Eigen::Matrix<Scalar, Order, 1>;

  /// `memory_s`: tau, may be infinite. `unit_s`: typical interval, the unit of time of Z.
  FadingMemoryFilter(Scalar memory_s, Scalar unit_s) : memory_s_(memory_s), unit_s_(unit_s) {
    require(memory_s > Scalar(0), "memory_s", "a number that is not positive",
            "a positive number of seconds");
    require(std::isfinite(unit_s) && unit_s > Scalar(0), "unit_s", "a number that is not positive",
            "a positive number of seconds");
  }

  /// Moves on by dt_s >= 0 without a measurement.
  void predict(Scalar dt_s) {
    require(std::isfinite(dt_s) && dt_s >= Scalar(0), "dt_s", "a negative or not finite number",
            "zero or a positive number of seconds");
    detail::advance<Scalar, Order, Axes>(state_, detail::taylor_powers<Scalar, Order>(dt_s));
    elapsed_s_ += dt_s;
  }

  /// Uses a measurement of the present time; returns the innovation (the measurement itself at the first).
  Measurement correct(const Measurement& measurement) {
    age_information();
    information_(0, 0) += Scalar(1);
    if (elapsed_s_ > Scalar(0) || times_ == 0) {
      times_ = std::min(times_ + 1, Order);
    }
    elapsed_s_ = Scalar(0);
    const Vector gain = solve_gain();
    const Measurement innovation = measurement - state_.row(0).transpose();
    state_ += gain * innovation.transpose();
    return innovation;
  }

  [[nodiscard]] const State& state() const { return state_; }
  /// Different sample times used so far, at most Order; the estimate has degree min(times, Order) - 1.
  [[nodiscard]] int times() const { return times_; }
  /// True once the estimate has its full degree.
  [[nodiscard]] bool complete() const { return times_ == Order; }
  /// Gains of the latest correction, unit s^-i.
  [[nodiscard]] const Vector& gain() const { return gain_; }
  /// Variance of the coordinate after the latest correction for unit measurement variance: exact for
  /// infinite memory, an upper bound otherwise.
  [[nodiscard]] Scalar noise_gain() const { return times_ > 0 ? gain_[0] : infinity(); }
  /// The same for the coordinate predicted to the present time; infinite before the estimate is complete.
  [[nodiscard]] Scalar prediction_noise_gain() const {
    if (!complete()) {
      return infinity();
    }
    const auto powers = detail::taylor_powers<Scalar, Order>(elapsed_s_ / unit_s_);
    const Vector direction = Eigen::Map<const Vector>(powers.data());
    const linalg::FixedCholesky<Scalar, Order> cholesky(information_);
    return direction.dot(cholesky.solve(direction));
  }

 private:
  static constexpr Scalar infinity() { return std::numeric_limits<Scalar>::infinity(); }

  /// Z <- w Phi(-dt)' Z Phi(-dt) for the time since the latest correction.
  void age_information() {
    if (!(elapsed_s_ > Scalar(0)) || times_ == 0) {
      return;
    }
    const auto powers = detail::taylor_powers<Scalar, Order>(-elapsed_s_ / unit_s_);
    Eigen::Matrix<Scalar, Order, Order> back = Eigen::Matrix<Scalar, Order, Order>::Zero();
    for (int i = 0; i < Order; ++i) {
      for (int j = i; j < Order; ++j) {
        back(i, j) = powers[static_cast<std::size_t>(j - i)];
      }
    }
    const Eigen::Matrix<Scalar, Order, Order> half = information_ * back;
    information_.noalias() = back.transpose() * half;
    information_ *= std::exp(-elapsed_s_ / memory_s_);
  }

  /// Z^-1 e_0 of the leading block that the samples so far determine, in seconds; zeros below.
  Vector solve_gain() {
    Eigen::Matrix<Scalar, Order, Order> block = information_;
    for (int i = times_; i < Order; ++i) {
      block.row(i).setZero();
      block.col(i).setZero();
      block(i, i) = Scalar(1);
    }
    const linalg::FixedCholesky<Scalar, Order> cholesky(block);
    gain_ = cholesky.solve(Vector::Unit(0));
    Scalar factor{1};
    for (int i = 0; i < Order; ++i) {
      gain_[i] *= factor;
      factor /= unit_s_;
    }
    return gain_;
  }

  Scalar memory_s_;
  Scalar unit_s_;
  Scalar elapsed_s_{0};
  int times_ = 0;
  State state_ = State::Zero();
  Vector gain_ = Vector::Zero();
  Eigen::Matrix<Scalar, Order, Order> information_ = Eigen::Matrix<Scalar, Order, Order>::Zero();
};

}  // namespace trammel::inline TRAMMEL_ABI::filter
