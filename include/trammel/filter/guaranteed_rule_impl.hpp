// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of guaranteed_rule.hpp.
#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "trammel/core/error.hpp"
#include "trammel/filter/guaranteed_rule.hpp"
#include "trammel/filter/minimise.hpp"
#include "trammel/filter/rules.hpp"
#include "trammel/filter/rules_impl.hpp"
#include "trammel/filter/worst_case_impl.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

namespace detail {

/// One member of a one-parameter family; the parameter runs from slow (0) to fast (1).
using GainCurve = std::function<Eigen::VectorXd(double)>;

inline GainCurve gain_curve(int order, GainFamily family) {
  switch (family) {
    case GainFamily::kKalata:
      require(order >= 2 && order <= 3, "family", "kalata for order " + std::to_string(order),
              "order 2 or 3");
      return [order](double x) {
        const double s = 1.0 - x;
        Eigen::VectorXd gains(order);
        gains[0] = x * (1.0 + s);
        gains[1] = 2.0 * x * x;
        if (order == 3) {
          gains[2] = 4.0 * x * x * x / (1.0 + s);
        }
        return gains;
      };
    case GainFamily::kBenedictBordner:
      require(order == 2, "family", "benedict_bordner for order " + std::to_string(order), "order 2");
      return [](double x) { return benedict_bordner(x); };
    default:
      return [order](double x) { return fading_memory(order, 1.0 - x); };
  }
}

/// Size of the best bandwidth, which grows as index^(2/(2v+1)).
inline double expected_bandwidth(const GuaranteedGoal& goal) {
  return std::min(1.0, std::pow(goal.index, 2.0 / (2.0 * goal.order + 1.0)));
}

/// J, B and rho of a design with T = 1.
inline GuaranteedGains error_of_design(const GuaranteedGoal& goal, const FilterDesign& design) {
  GuaranteedGains result;
  result.gains = design.specification.gains;
  const WorstCaseBias bias = worst_case_bias(design, goal.output);
  result.bias = goal.manoeuvre == Manoeuvre::kConstant            ? bias.constant
                : goal.manoeuvre == Manoeuvre::kPiecewiseConstant ? bias.piecewise_constant
                                                                  : bias.arbitrary;
  if (!std::isfinite(result.bias)) {
    result.mean_square_error = std::numeric_limits<double>::infinity();
    return result;
  }
  const DeltaRealisation realisation(design.denominator_d);
  const Eigen::VectorXd row = realisation.output_row(
      goal.output.predicted ? add(design.denominator_d, design.innovation_numerator_d, -1.0)
                            : design.numerators_d[static_cast<std::size_t>(goal.output.row)]);
  result.noise_gain = row.dot(realisation.covariance() * row);
  const double bias_part = goal.index * result.bias;
  result.mean_square_error = bias_part * bias_part + result.noise_gain;
  return result;
}

/// Mean-square error for the search: infinite also for filters close to instability, whose long kernels
/// would cost much and whose noise makes them bad.
inline double search_error(const GuaranteedGoal& goal, const Eigen::VectorXd& gains) {
  constexpr double kLongest = 1024.0;  // memory times bandwidth; good filters have about 50
  const FilterDesign design = synthesise(from_gains(goal.order, 1.0, gains));
  if (!is_stable(design.denominator_d) ||
      DeltaRealisation(design.denominator_d).memory() > kLongest / expected_bandwidth(goal)) {
    return std::numeric_limits<double>::infinity();
  }
  return error_of_design(goal, design).mean_square_error;
}

/// Best member of a curve: a scan in the logarithm of the parameter, then golden section around the best.
inline Minimum best_on_curve(const GuaranteedGoal& goal, const GainCurve& curve) {
  const auto error = [&](double log_parameter) {
    return search_error(goal, curve(std::min(1.0, std::exp(log_parameter))));
  };
  // Three natural logarithms below the expected bandwidth everything is worse.
  const double slowest = std::log(expected_bandwidth(goal)) - 3.0;
  constexpr int kSteps = 40;
  const double step = -slowest / kSteps;
  int best = 0;
  double best_value = error(0.0);
  for (int i = 1; i <= kSteps; ++i) {
    const double value = error(-step * i);
    if (value < best_value) {
      best = i;
      best_value = value;
    }
  }
  const double high = -step * std::max(best - 1, 0);
  return minimise(error, -step * (best + 1), high);
}

/// Closed forms; nothing where there is none.
inline std::optional<Eigen::VectorXd> closed_form(const GuaranteedGoal& goal) {
  const double square = goal.index * goal.index;
  const bool steady = goal.manoeuvre == Manoeuvre::kConstant;
  if (goal.order == 1 && !steady) {
    // One-signed kernel for alpha <= 1, so all classes of manoeuvres agree; beyond 1 it alternates and the
    // bias grows with alpha.
    const double alpha = bisect(
        [&](double x) {
          const double rest = goal.output.predicted ? 1.0 : 1.0 - x;
          return x * x * x - square * rest * (2.0 - x) * (2.0 - x);
        },
        0.0, 1.0);
    return Eigen::VectorXd::Constant(1, alpha);
  }
  if (goal.output.predicted && steady) {
    const double b = bisect(
        [&](double x) {
          return std::pow(2.0, goal.order - 1) * std::pow(x, 2 * goal.order + 1) -
                 square * std::pow(2.0 - x, goal.order + 1);
        },
        0.0, 2.0);
    return minimum_noise_prediction(goal.order, b);
  }
  if (goal.order == 2 && goal.output.row == 0 && steady) {
    const double t =
        bisect([&](double x) { return 8.0 * std::pow(x, 5) - square * (1.0 - x) * (1.0 - x); }, 0.0, 1.0);
    return two_gains(2.0 * t / (1.0 + t * t), 4.0 * t * t / (1.0 + t * t));
  }
  return std::nullopt;
}

}  // namespace detail

TRAMMEL_INLINE GuaranteedGains guaranteed_error(const GuaranteedGoal& goal, const Eigen::VectorXd& gains) {
  return detail::error_of_design(goal, synthesise(from_gains(goal.order, 1.0, gains)));
}

TRAMMEL_INLINE GuaranteedGains guaranteed_gains(const GuaranteedGoal& goal) {
  constexpr int kLargest = 3;
  require(goal.order >= 1 && goal.order <= kLargest, "order", std::to_string(goal.order),
          "1, 2 or 3 for the guaranteed rule");
  detail::require_index(goal.index, "index");
  require(goal.output.predicted || (goal.output.row >= 0 && goal.output.row < goal.order), "output.row",
          std::to_string(goal.output.row), "a row below the order");
  if (goal.family != GainFamily::kFree) {
    const detail::GainCurve curve = detail::gain_curve(goal.order, goal.family);
    const Minimum best = detail::best_on_curve(goal, curve);
    return guaranteed_error(goal, curve(std::min(1.0, std::exp(best.point[0]))));
  }
  if (const auto gains = detail::closed_form(goal)) {
    return guaranteed_error(goal, *gains);
  }
  const auto error = [&](const Eigen::VectorXd& logarithms) {
    return detail::search_error(goal, logarithms.array().exp().matrix());
  };
  std::vector<detail::GainCurve> curves{detail::gain_curve(goal.order, GainFamily::kCriticallyDamped)};
  if (goal.order > 1) {
    curves.push_back([&](double x) { return minimum_noise_prediction(goal.order, x); });
    curves.push_back(detail::gain_curve(goal.order, GainFamily::kKalata));
  }
  std::optional<Minimum> best;
  for (const detail::GainCurve& curve : curves) {
    const Minimum on_curve = detail::best_on_curve(goal, curve);
    const Eigen::VectorXd start = curve(std::min(1.0, std::exp(on_curve.point[0])));
    constexpr double kStep = 0.1;  // a tenth of each gain
    Minimum found = minimise(error, Eigen::VectorXd(start.array().log()), kStep);
    if (!best || found.value < best->value) {
      best = std::move(found);
    }
  }
  return guaranteed_error(goal, best->point.array().exp().matrix());
}

}  // namespace trammel::inline TRAMMEL_ABI::filter
