// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of interior_motion.hpp.
#pragma once

#include <algorithm>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/localise/interior_motion.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

TRAMMEL_INLINE InteriorMotion find_interior_motion(const FitProblem& problem, const Minimiser& minimise) {
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(problem.parameters());
  if (problem.inside(zero)) {
    return {.z = zero, .lowest_height_m = problem.lowest_height_m(zero)};
  }
  constexpr double kFollow = 0.9;
  constexpr double kSettled = 1e-3;  // m: room that is no room
  constexpr double kNoData = 1e12;   // weight of the barriers against which measurements do not count
  constexpr int kRounds = 60;
  const double wanted = *problem.minimum_height_m();
  Eigen::VectorXd z = zero;
  double lowest = problem.lowest_height_m(z);
  double floor = lowest - std::max(1.0, wanted - lowest);
  for (int round = 0; round < kRounds && lowest <= wanted && lowest - floor > kSettled; ++round) {
    z = minimise(problem.with_minimum_height(floor), z, kNoData, {.max_systems = 200}).z;
    lowest = problem.lowest_height_m(z);
    floor += kFollow * (lowest - floor);
  }
  InteriorMotion result{.z = {}, .lowest_height_m = lowest};
  if (problem.inside(z)) {
    result.z = z;
  }
  return result;
}

TRAMMEL_INLINE Eigen::VectorXd require_interior_motion(const FitProblem& problem, const Minimiser& minimise) {
  const InteriorMotion found = find_interior_motion(problem, minimise);
  if (!found.z) {
    refuse_floor(*problem.minimum_height_m(), found.lowest_height_m);
  }
  return *found.z;
}

TRAMMEL_INLINE void refuse_floor(double minimum_height_m, double lowest_height_m) {
  throw Error({"minimum_height_m", shortest(minimum_height_m) + " m",
               "a floor that some motion within the bounds stays above; the highest found stays above " +
                   shortest(lowest_height_m) + " m"});
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
