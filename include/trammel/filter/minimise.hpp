// SPDX-License-Identifier: Apache-2.0
/// @file
/// Minimum of a function of a few variables without derivatives: for criteria that have kinks.
#pragma once

#include <functional>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

/// Point and value of a minimum found.
struct Minimum {
  Eigen::VectorXd point;
  double value = 0.0;
};

/// Local minimum by the simplex search of Nelder and Mead (1965), started anew around the best point until
/// a start no longer improves it. `step` is the size of the first simplex. The function may return infinity
/// outside its domain; `start` must be inside.
[[nodiscard]] Minimum minimise(const std::function<double(const Eigen::VectorXd&)>& function,
                               const Eigen::VectorXd& start, double step);

/// Minimum of a function with one valley on [low, high] by golden section, to `relative_width` of the
/// interval.
[[nodiscard]] Minimum minimise(const std::function<double(double)>& function, double low, double high,
                               double relative_width = 1e-10);

}  // namespace trammel::inline TRAMMEL_ABI::filter

#ifndef TRAMMEL_COMPILED
#include "trammel/filter/minimise_impl.hpp"
#endif
