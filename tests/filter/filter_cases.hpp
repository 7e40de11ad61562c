// SPDX-License-Identifier: Apache-2.0
/// @file
/// Helpers of the filter tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <string>

#include <gtest/gtest.h>

#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/filter/analysis.hpp"
#include "trammel/filter/design.hpp"

namespace trammel::test {

inline Eigen::VectorXd vec(std::initializer_list<double> values) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), v.begin());
  return v;
}

/// Equal length (missing entries are zeros) and equal within `tolerance` of the largest entry.
inline void expect_near(const Eigen::VectorXd& found, const Eigen::VectorXd& expected, double tolerance,
                        const std::string& what) {
  const Eigen::Index size = std::max(found.size(), expected.size());
  Eigen::VectorXd difference = Eigen::VectorXd::Zero(size);
  difference.head(found.size()) += found;
  difference.head(expected.size()) -= expected;
  const double scale = expected.size() > 0 ? std::max(expected.cwiseAbs().maxCoeff(), 1e-300) : 1.0;
  EXPECT_LE(difference.cwiseAbs().maxCoeff(), tolerance * scale)
      << what << "\n found    " << found.transpose() << "\n expected " << expected.transpose();
}

inline filter::FilterDesign design_of(int order, double sampling_s, const Eigen::VectorXd& gains,
                                      filter::FilterMode mode = filter::FilterMode::kDerivatives) {
  return filter::synthesise(filter::from_gains(order, sampling_s, gains, mode));
}

/// Random gains of a stable filter with k = v, by poles inside the unit circle.
inline Eigen::VectorXd random_stable_gains(RandomStream& random, int order) {
  Eigen::VectorXd denominator = filter::constant(1.0);  // in d
  const auto factor = [&](std::initializer_list<double> in_q) {
    denominator = filter::multiply(denominator, filter::reflect(vec(in_q)));
  };
  int left = order;
  while (left > 0) {
    if (left >= 2 && random.uniform() < 0.5) {
      const double radius = 0.95 * random.uniform();
      const double cosine = 2.0 * random.uniform() - 1.0;
      factor({1.0, -2.0 * radius * cosine, radius * radius});
      left -= 2;
    } else {
      factor({1.0, 0.95 - 1.9 * random.uniform()});
      left -= 1;
    }
  }
  return filter::gains_from_denominator(denominator);
}

inline std::string error_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace trammel::test
