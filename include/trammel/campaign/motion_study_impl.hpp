// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of motion_study.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "trammel/campaign/motion_study.hpp"
#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/estimate/deviated_path.hpp"
#include "trammel/estimate/simulate_measurements.hpp"

namespace trammel::inline TRAMMEL_ABI::campaign {

namespace detail {

/// One point of each unit ball, block after block.
inline Eigen::VectorXd draw_in_balls(const std::vector<Eigen::Index>& block_sizes, Eigen::Index size,
                                     RandomMotion motion, RandomStream& stream) {
  Eigen::VectorXd u(size);
  Eigen::Index at = 0;
  for (const Eigen::Index block : block_sizes) {
    for (Eigen::Index i = 0; i < block; ++i) {
      u(at + i) = stream.normal();
    }
    u.segment(at, block).normalize();
    if (motion == RandomMotion::kWithin) {
      u.segment(at, block) *= std::pow(stream.uniform(), 1.0 / static_cast<double>(block));
    }
    at += block;
  }
  return u;
}

}  // namespace detail

TRAMMEL_INLINE MotionStudy::MotionStudy(Scenario scenario, Eigen::MatrixXd gain, RandomMotion motion)
    : scenario_(std::move(scenario)),
      planned_(assemble(scenario_)),
      motions_(estimate::bounded_motion(planned_.coordinates, scenario_.bounds)),
      gain_(std::move(gain)),
      motion_(motion) {
  const Eigen::Index p = planned_.coordinates.parameters();
  if (gain_.rows() != p || gain_.cols() != p) {
    throw Error({"gain", std::to_string(gain_.rows()) + " x " + std::to_string(gain_.cols()),
                 std::to_string(p) + " x " + std::to_string(p)});
  }
}

TRAMMEL_INLINE RunErrors MotionStudy::run(std::uint64_t seed, std::uint64_t run) const {
  RandomStream stream(seed, run);
  const std::uint64_t noise_seed = stream();
  const Eigen::VectorXd z =
      motions_.bounded *
      detail::draw_in_balls(motions_.block_sizes, motions_.bounded.cols(), motion_, stream);
  const auto error_m = [&](const Eigen::MatrixXd& F, const Eigen::VectorXd& y) {
    const Eigen::VectorXd estimate = gain_ * (F.transpose() * y);
    return (planned_.problem.criterion_factor * (estimate - z)).norm();
  };
  Eigen::VectorXd linear = planned_.problem.information_factor * z;
  for (double& y : linear) {
    y += stream.normal();
  }
  const estimate::DeviatedPath truth{planned_.nominal, planned_.coordinates.spline(z)};
  Scenario measured = scenario_;
  measured.observations = estimate::simulate_measurements(scenario_, truth, noise_seed);
  const TrajectoryProblem problem = assemble(measured);
  return {.linear_m = error_m(planned_.problem.information_factor, linear),
          .nonlinear_m = error_m(problem.problem.information_factor, problem.information_rhs)};
}

TRAMMEL_INLINE StudySummary summarise(const std::vector<double>& rms_errors_m, double guaranteed_rms_m) {
  require(!rms_errors_m.empty(), "rms_errors_m", "no runs", "at least one");
  constexpr double kQuantile = 2.5758293035489004;  // of the standard normal, kConfidence two-sided
  const auto count = static_cast<double>(rms_errors_m.size());
  StudySummary result;
  result.runs = rms_errors_m.size();
  double sum = 0.0;
  for (const double error : rms_errors_m) {
    sum += error * error;
    result.largest_rms_m = std::max(result.largest_rms_m, error);
  }
  result.mean_square_m2 = sum / count;
  double squares = 0.0;
  for (const double error : rms_errors_m) {
    squares += std::pow(error * error - result.mean_square_m2, 2);
  }
  if (rms_errors_m.size() > 1) {
    result.standard_error_m2 = std::sqrt(squares / (count - 1.0) / count);
  }
  const double square = guaranteed_rms_m * guaranteed_rms_m;
  result.ratio = result.mean_square_m2 / square;
  result.ratio_low = (result.mean_square_m2 - kQuantile * result.standard_error_m2) / square;
  result.ratio_high = (result.mean_square_m2 + kQuantile * result.standard_error_m2) / square;
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::campaign
