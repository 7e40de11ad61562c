// SPDX-License-Identifier: Apache-2.0
#include "truth_comparison.hpp"

#include <algorithm>
#include <cmath>

#include "trammel/trajectory/nominal_trajectory.hpp"

namespace trammel::report {

namespace {

/// Value at `t_s` of a quantity known on a grid, by linear interpolation.
double interpolate(const std::vector<double>& times_s, const std::vector<double>& values, double t_s) {
  const auto after = std::upper_bound(times_s.begin() + 1, times_s.end() - 1, t_s);
  const auto i = static_cast<std::size_t>(after - times_s.begin());
  const double share = (t_s - times_s[i - 1]) / (times_s[i] - times_s[i - 1]);
  return values[i - 1] + share * (values[i] - values[i - 1]);
}

/// Root of the mean of squares over [begin, end], by the trapezoidal rule on the grid.
double root_mean_square(const std::vector<double>& times_s, const std::vector<double>& values, double begin_s,
                        double end_s) {
  std::vector<double> nodes{begin_s};
  std::copy_if(times_s.begin(), times_s.end(), std::back_inserter(nodes),
               [&](double t) { return t > begin_s && t < end_s; });
  nodes.push_back(end_s);
  double integral = 0.0;
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    const double a = interpolate(times_s, values, nodes[i - 1]);
    const double b = interpolate(times_s, values, nodes[i]);
    integral += (nodes[i] - nodes[i - 1]) * (a * a + b * b) / 2;
  }
  return std::sqrt(integral / (end_s - begin_s));
}

double criterion_rms(const Scenario& scenario, const std::vector<double>& times_s,
                     const std::vector<double>& values) {
  const Criterion& criterion = scenario.criterion;
  switch (criterion.kind) {
    case CriterionKind::kFinal:
      return values.back();
    case CriterionKind::kTimes: {
      double sum = 0.0;
      for (const double t : criterion.times_s) {
        sum += std::pow(interpolate(times_s, values, t), 2);
      }
      return std::sqrt(sum / static_cast<double>(criterion.times_s.size()));
    }
    case CriterionKind::kWindow:
      return root_mean_square(times_s, values, criterion.window_s[0], criterion.window_s[1]);
    case CriterionKind::kIntegral:
      break;
  }
  return root_mean_square(times_s, values, scenario.knots_s.front(), scenario.knots_s.back());
}

std::vector<double> distances(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  const Eigen::VectorXd norms = (a - b).rowwise().norm();
  return {norms.begin(), norms.end()};
}

}  // namespace

TruthComparison compare_with_truth(const Scenario& scenario, const estimate::TrajectoryEstimate& estimate,
                                   const io::PathSamples& truth) {
  const std::vector<double>& times_s = estimate.nominal.times_s;
  const auto path = trajectory::NominalTrajectory::through(truth.times_s, truth.positions_m);
  TruthComparison result;
  result.position_m.resize(static_cast<Eigen::Index>(times_s.size()), 3);
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    result.position_m.row(static_cast<Eigen::Index>(i)) = path.position(times_s[i]).transpose();
  }
  if (estimate.observed && estimate.observed->path.position_m.rows() == result.position_m.rows()) {
    result.estimate_error_m = distances(estimate.observed->path.position_m, result.position_m);
    result.estimate_rms_m = criterion_rms(scenario, times_s, result.estimate_error_m);
    if (estimate.observed->gauss_markov_path) {
      result.gauss_markov_error_m =
          distances(estimate.observed->gauss_markov_path->position_m, result.position_m);
      result.gauss_markov_rms_m = criterion_rms(scenario, times_s, result.gauss_markov_error_m);
    }
  }
  return result;
}

}  // namespace trammel::report
