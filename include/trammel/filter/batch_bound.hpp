// SPDX-License-Identifier: Apache-2.0
/// @file
/// What no causal linear filter can beat: the guaranteed batch estimate from a window of samples.
#pragma once

#include "trammel/core/config.hpp"
#include "trammel/filter/worst_case.hpp"
#include "trammel/minimax/solve.hpp"
#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

/// A window of uniform samples and what is to be estimated from it.
struct BatchWindow {
  int order = 2;        ///< v: the bound is on x^(v)
  int samples = 40;     ///< number N of samples, at least v
  double index = 1.0;   ///< Lambda = omega T^v / sigma
  FilterOutput output;  ///< a row at the latest sample, or the coordinate one interval after it
};

/// Guaranteed estimation of one coordinate from the last N samples of g = x + f, as a GuaranteedProblem:
/// x^(v) constant on each interval and bounded by omega, the state at the time of interest unbounded.
///
/// | parameter          | meaning                                                     | scaled by       |
/// |--------------------|-------------------------------------------------------------|-----------------|
/// | theta_0..theta_v-1 | x, x', ... at the time of interest                          | sigma, (N T)^-i |
/// | theta_v..          | x^(v) on the intervals before it, latest first, |theta| <= 1 | omega          |
///
/// Every linear filter that has seen these N samples only has a worst-case mean-square error, over
/// piecewise constant and so also over arbitrary manoeuvres within the bound, of at least the `lower` of the
/// solution, in sigma^2 (T^-2i for row i). A filter in steady state has seen more; the bound stops
/// falling once N exceeds the memory that pays (sufficient_samples), and holds for it then.
/// Throws Error for fewer samples than the order or an index that is not positive.
[[nodiscard]] GuaranteedProblem batch_problem(const BatchWindow& window);

/// Number of samples of a window after which the bound falls no further worth mentioning:
/// 8 / Lambda^(2/(2v+1)) + 4 v, rounded up; kept below 1e9.
[[nodiscard]] int sufficient_samples(int order, double index);

/// Solves batch_problem; upper and lower in sigma^2 (T^-2i for row i).
[[nodiscard]] minimax::Solution batch_bound(const BatchWindow& window,
                                            const minimax::SolverSettings& settings = {});

}  // namespace trammel::inline TRAMMEL_ABI::filter

#ifndef TRAMMEL_COMPILED
#include "trammel/filter/batch_bound_impl.hpp"
#endif
