// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of correlated_prior.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "trammel/certify/correlated_prior.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace correlated_detail {

inline constexpr double kPi = std::numbers::pi;
inline constexpr int kNodes = 48;           ///< of each Gauss-Legendre rule
inline constexpr double kNormalTail = 8.5;  ///< beyond, a normal variable is negligible (1e-17)
inline constexpr int kTable = 1500;         ///< intervals of the table
inline constexpr double kTableTail = 9.0;   ///< it ends this many deviations beyond the mean size
/// Variances below this share of the largest are counted as this large: |g| only grows by that.
inline constexpr double kSmallestVariance = 1e-12;
inline constexpr double kRounding = 1e-9;
inline constexpr int kCutOffs = 40;  ///< values of a tried
/// Scales k of the prior tried: from nearly no truncation to much.
inline constexpr double kSmallestScale = 0.08;
inline constexpr double kLargestScale = 1.5;
inline constexpr int kScales = 16;

struct Rule {
  std::vector<double> nodes;    ///< in (0, 1)
  std::vector<double> weights;  ///< sum 1
};

/// Gauss-Legendre rule on (0, 1), nodes by Newton's method.
inline Rule gauss_legendre(int count) {
  Rule rule;
  for (int i = 0; i < count; ++i) {
    double x = std::cos(kPi * (i + 0.75) / (count + 0.5));
    double slope = 1.0;
    for (int iteration = 0; iteration < 20; ++iteration) {
      double previous = 1.0;
      double value = x;
      for (int k = 2; k <= count; ++k) {
        const double next = ((2.0 * k - 1.0) * x * value - (k - 1.0) * previous) / k;
        previous = value;
        value = next;
      }
      slope = count * (x * value - previous) / (x * x - 1.0);
      x -= value / slope;
    }
    rule.nodes.push_back((1.0 - x) / 2.0);
    rule.weights.push_back(1.0 / ((1.0 - x * x) * slope * slope));
  }
  return rule;
}

/// Cubic interpolation of a table with spacing `step` from 0; 1 beyond its end.
inline double interpolate(const Eigen::VectorXd& table, double step, double x) {
  const double position = x / step;
  const Eigen::Index last = table.size() - 1;
  if (!(position < static_cast<double>(last))) {
    return 1.0;
  }
  const Eigen::Index i = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(position) - 1, 0, last - 3);
  const double t = position - static_cast<double>(i);
  const double value =
      -table(i) * (t - 1.0) * (t - 2.0) * (t - 3.0) / 6.0 + table(i + 1) * t * (t - 2.0) * (t - 3.0) / 2.0 -
      table(i + 2) * t * (t - 1.0) * (t - 3.0) / 2.0 + table(i + 3) * t * (t - 1.0) * (t - 2.0) / 6.0;
  return std::clamp(value, 0.0, 1.0);
}

}  // namespace correlated_detail

TRAMMEL_INLINE GaussianNorm::GaussianNorm(const Eigen::VectorXd& variances) {
  using namespace correlated_detail;
  const double largest = variances.maxCoeff();
  scale_ = std::sqrt(largest);
  Eigen::VectorXd relative = (variances / largest).cwiseMax(0.0);
  std::sort(relative.data(), relative.data() + relative.size(), std::greater<>());
  const double reach = std::sqrt(relative.sum()) + kTableTail;
  step_ = reach / kTable;
  const auto first = [](double x) { return std::erf(x / std::numbers::sqrt2); };
  table_.resize(kTable + 1);
  for (Eigen::Index i = 0; i <= kTable; ++i) {
    table_(i) = first(static_cast<double>(i) * step_);
  }
  static const Rule rule = gauss_legendre(kNodes);
  for (Eigen::Index k = 1; k < relative.size(); ++k) {
    const double deviation = std::sqrt(std::max(relative(k), kSmallestVariance));
    Eigen::VectorXd next(kTable + 1);
    next(0) = 0.0;
    for (Eigen::Index i = 1; i <= kTable; ++i) {
      const double x = static_cast<double>(i) * step_;
      // P = 2 int_0^m phi(t) P_before(sqrt(x^2 - (deviation t)^2)) dt; t = m sin takes out the root at the
      // end.
      const double m = std::min(x / deviation, kNormalTail);
      double total = 0.0;
      for (std::size_t n = 0; n < rule.nodes.size(); ++n) {
        const double angle = kPi / 2.0 * rule.nodes[n];
        const double t = m * std::sin(angle);
        const double rest = std::sqrt(std::max(0.0, (x - deviation * t) * (x + deviation * t)));
        const double before = k == 1 ? first(rest) : interpolate(table_, step_, rest);
        total += rule.weights[n] * std::cos(angle) * std::exp(-t * t / 2.0) * before;
      }
      next(i) = std::min(1.0, total * m * kPi / 2.0 * std::sqrt(2.0 / kPi));
    }
    table_ = next;
  }
}

TRAMMEL_INLINE double GaussianNorm::probability(double r) const {
  return correlated_detail::interpolate(table_, step_, r / scale_);
}

TRAMMEL_INLINE double cut_off_information(const GaussianNorm& norm, double factor) {
  using namespace correlated_detail;
  static const Rule rule = gauss_legendre(kNodes);
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kCutOffs; ++i) {
    const double a = static_cast<double>(i) / kCutOffs;
    const double omega = kPi / (2.0 * (1.0 - a));
    const double outside =
        std::min(1.0, 1.0 - norm.probability(a / factor) + GaussianNorm::kProbabilityError);
    // E f^2 = int_a^1 -(f^2)'(r) P(|g| <= r) dr.
    double mean = 0.0;
    for (std::size_t n = 0; n < rule.nodes.size(); ++n) {
      const double r = a + (1.0 - a) * rule.nodes[n];
      mean += rule.weights[n] * (1.0 - a) * omega * std::sin(2.0 * omega * (r - a)) *
              norm.probability(r / factor);
    }
    mean -= GaussianNorm::kProbabilityError;
    if (mean > 0.0) {
      best = std::min(best, 2.0 * omega * omega * outside / mean);
    }
  }
  return best * (1.0 + 1e-6);
}

TRAMMEL_INLINE double correlated_bound(const GuaranteedProblem& problem,
                                       const Eigen::MatrixXd& prior_factor) {
  using namespace correlated_detail;
  const Eigen::Index k = prior_factor.cols();
  if (k == 0) {
    return 0.0;
  }
  const Eigen::MatrixXd seen = problem.information_factor * prior_factor;
  const Eigen::MatrixXd information = seen.transpose() * seen;
  const Eigen::MatrixXd output = problem.criterion_factor * prior_factor;
  Eigen::Index rows = 0;
  for (const Eigen::MatrixXd& factor : problem.ellipsoids) {
    rows += factor.rows();
  }
  // The images a_l L side by side, transposed: as matrices L'H_l L they would take s k^2 numbers.
  Eigen::MatrixXd images(k, rows);
  std::vector<Eigen::Index> first{0};
  std::vector<GaussianNorm> norms;
  for (const Eigen::MatrixXd& factor : problem.ellipsoids) {
    const Eigen::MatrixXd image = factor * prior_factor;
    const linalg::SymmetricEigen eigen(image * image.transpose(), Eigen::EigenvaluesOnly);
    if (image.rows() == 0 || !(eigen.eigenvalues().maxCoeff() > 0.0)) {
      continue;
    }
    images.middleCols(first.back(), image.rows()) = image.transpose();
    first.push_back(first.back() + image.rows());
    norms.emplace_back(eigen.eigenvalues());
  }
  double best = 0.0;
  for (int i = 0; i < kScales; ++i) {
    const double scale =
        kSmallestScale * std::pow(kLargestScale / kSmallestScale, static_cast<double>(i) / (kScales - 1));
    Eigen::VectorXd root(first.back());
    for (std::size_t l = 0; l < norms.size(); ++l) {
      root.segment(first[l], first[l + 1] - first[l])
          .setConstant(std::sqrt(cut_off_information(norms[l], scale)));
    }
    Eigen::MatrixXd total = information;
    total.diagonal().array() += 1.0 / (scale * scale);
    total.selfadjointView<Eigen::Lower>().rankUpdate(images.leftCols(first.back()) * root.asDiagonal());
    const linalg::Cholesky cholesky(total);
    if (root.allFinite() && cholesky.info() == Eigen::Success) {
      best = std::max(best, cholesky.matrixL().solve(output.transpose()).squaredNorm());
    }
  }
  return (1.0 - kRounding) * best;
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
