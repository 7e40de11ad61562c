// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of coarse_product.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "trammel/linalg/coarse_product.hpp"
#include "trammel/linalg/error_free.hpp"
#include "trammel/linalg/error_norms.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

namespace coarse_product_detail {

inline constexpr int kMantissaBits = 53;
/// Bits of the coarse factor.
inline constexpr int kCoarseBits = 24;
/// Units stay above 2^(kSmallestExponent - 2 kMantissaBits), so that no product of two of them underflows.
inline constexpr int kSmallestExponent = -400;
/// 1.5 2^52 w: adding and subtracting it leaves the nearest multiple of w, exactly, of numbers up to 2^51 w.
inline constexpr double kAnchor = 0x1.8p52;

/// Bits left for each of A1 and A2.
inline int slice_bits(Eigen::Index n) {
  int bits = kMantissaBits - kCoarseBits;
  while ((Eigen::Index{1} << (kMantissaBits - kCoarseBits - bits)) < n) {
    --bits;
  }
  return bits;
}

/// 2^-bits of the power of two above `largest`.
inline double unit(double largest, int bits) {
  const int exponent = largest > 0.0 && std::isfinite(largest) ? std::ilogb(largest) + 1 : kSmallestExponent;
  return std::ldexp(1.0, std::max(exponent, kSmallestExponent) - bits);
}

/// Columns rounded to kCoarseBits, in place.
inline void make_coarse(Eigen::MatrixXd& x) {
  for (Eigen::Index j = 0; j < x.cols(); ++j) {
    const double anchor = kAnchor * unit(x.col(j).lpNorm<Eigen::Infinity>(), kCoarseBits);
    x.col(j) = ((x.col(j).array() + anchor) - anchor).matrix();
  }
}

/// A D = first + second + third, but for one rounding of the third.
struct Slices {
  Eigen::MatrixXd first;
  Eigen::MatrixXd second;
  Eigen::MatrixXd third;

  Slices(const Eigen::MatrixXd& a, const Eigen::MatrixXd& low, const Eigen::VectorXd& scale) {
    const int bits = slice_bits(a.cols());
    third.resize(a.rows(), a.cols());
    first.resize(a.rows(), a.cols());
    second.resize(a.rows(), a.cols());
    Eigen::VectorXd anchor = Eigen::VectorXd::Zero(a.rows());
    for (Eigen::Index k = 0; k < a.cols(); ++k) {
      third.col(k) = scale(k) * a.col(k);
      anchor = anchor.cwiseMax(third.col(k).cwiseAbs());
    }
    for (double& entry : anchor) {
      entry = kAnchor * unit(entry, bits);
    }
    const Eigen::VectorXd finer = std::ldexp(1.0, -bits) * anchor;
    for (Eigen::Index k = 0; k < a.cols(); ++k) {
      auto rest = third.col(k);
      first.col(k) = (rest + anchor) - anchor;
      rest -= first.col(k);
      second.col(k) = (rest + finer) - finer;
      rest -= second.col(k);
      rest += scale(k) * low.col(k);
    }
  }
};

}  // namespace coarse_product_detail

TRAMMEL_INLINE CoarseProduct coarse_product(const Eigen::MatrixXd& a_hi, const Eigen::MatrixXd& a_lo,
                                            const Eigen::MatrixXd& b, const Eigen::VectorXd& scale) {
  const auto terms = static_cast<double>(a_hi.cols());
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(a_hi.cols());
  Eigen::MatrixXd coarse = scale.cwiseInverse().asDiagonal() * b;
  coarse_product_detail::make_coarse(coarse);
  const coarse_product_detail::Slices slices(a_hi, a_lo, scale);
  CoarseProduct result;
  result.hi.noalias() = slices.first * coarse;
  result.lo.noalias() = slices.second * coarse;
  const Eigen::MatrixXd rest = slices.third * coarse;
  for (Eigen::Index i = 0; i < rest.size(); ++i) {
    const DoubleDouble exact = two_sum(result.hi.data()[i], result.lo.data()[i]);
    const DoubleDouble normal = two_sum(exact.hi, exact.lo + rest.data()[i]);
    result.hi.data()[i] = normal.hi;
    result.lo.data()[i] = normal.lo;
  }
  // Norms round at most terms + 4 times; the sum of the low parts is rounded once, by u^2
  // of the high one and u of A3 W, which is among the six.
  const double slack = 1.0 + 8.0 * (terms + 8.0) * kUnitRoundoff;
  result.row_error = (slack * (terms + 6.0) * kUnitRoundoff) * row_norms(slices.third, ones);
  result.column_size = slack * column_norms(coarse, ones);
  if (!(entries_in_range(a_hi) && entries_in_range(b))) {
    result.row_error.setConstant(std::numeric_limits<double>::infinity());
  }
  result.factor = scale.asDiagonal() * coarse;
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
