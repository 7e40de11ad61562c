// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of coarse_product.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "trammel/linalg/coarse_product.hpp"
#include "trammel/linalg/error_norms.hpp"

namespace trammel::inline TRAMMEL_ABI::linalg {

namespace coarse_product_detail {

inline constexpr int kMantissaBits = 53;
/// Bits of the leading part of A, where the coarse factor can spare them.
inline constexpr int kLeadingBits = 21;
/// Most bits of the coarse factor.
inline constexpr int kMostCoarseBits = 28;
/// Units stay above 2^(kSmallestExponent - 2 kMantissaBits), so that no product of two of them underflows.
inline constexpr int kSmallestExponent = -400;
/// 1.5 2^52 w: adding and subtracting it leaves the nearest multiple of w, exactly, of numbers up to 2^51 w.
inline constexpr double kAnchor = 0x1.8p52;

/// Bits of both factors, such that sums of n products of them are exact.
struct Bits {
  int leading = 0;
  int coarse = 0;

  explicit Bits(Eigen::Index n) {
    int left = kMantissaBits;
    while ((Eigen::Index{1} << (kMantissaBits - left)) < n) {
      --left;
    }
    coarse = std::min(left - kLeadingBits, kMostCoarseBits);
    leading = left - coarse;
  }
};

/// 2^-bits of the power of two above `largest`.
inline double unit(double largest, int bits) {
  const int exponent = largest > 0.0 && std::isfinite(largest) ? std::ilogb(largest) + 1 : kSmallestExponent;
  return std::ldexp(1.0, std::max(exponent, kSmallestExponent) - bits);
}

/// Columns rounded to so many bits, in place.
inline void make_coarse(int bits, Eigen::MatrixXd& x) {
  for (Eigen::Index j = 0; j < x.cols(); ++j) {
    const double anchor = kAnchor * unit(x.col(j).lpNorm<Eigen::Infinity>(), bits);
    x.col(j) = ((x.col(j).array() + anchor) - anchor).matrix();
  }
}

}  // namespace coarse_product_detail

TRAMMEL_INLINE CoarseProduct coarse_product(const Eigen::MatrixXd& a_hi, const Eigen::MatrixXd& a_lo,
                                            const Eigen::MatrixXd& b, const Eigen::VectorXd& scale) {
  using namespace coarse_product_detail;
  const Bits bits(a_hi.cols());
  Eigen::MatrixXd coarse = scale.cwiseInverse().asDiagonal() * b;
  make_coarse(bits.coarse, coarse);
  Eigen::MatrixXd trailing = a_hi * scale.asDiagonal();
  Eigen::VectorXd anchor = Eigen::VectorXd::Zero(a_hi.rows());
  for (Eigen::Index k = 0; k < a_hi.cols(); ++k) {
    anchor = anchor.cwiseMax(trailing.col(k).cwiseAbs());
  }
  for (double& entry : anchor) {
    entry = kAnchor * unit(entry, bits.leading);
  }
  Eigen::MatrixXd leading(a_hi.rows(), a_hi.cols());
  for (Eigen::Index k = 0; k < a_hi.cols(); ++k) {
    leading.col(k) = (trailing.col(k) + anchor) - anchor;
    trailing.col(k) = (trailing.col(k) - leading.col(k)) + scale(k) * a_lo.col(k);
  }
  CoarseProduct result;
  result.product.noalias() = leading * coarse;
  const Eigen::MatrixXd rest = trailing * coarse;
  result.product += rest;
  // Norms round at most n + 4 times; the trailing part is rounded once, which is among the six.
  const double slack = room(a_hi.cols());
  result.row_error = (slack * static_cast<double>(a_hi.cols() + 6) * kUnitRoundoff) * row_norms(trailing);
  result.column_size = slack * column_norms(coarse);
  if (!(entries_in_range(a_hi) && entries_in_range(b))) {
    result.row_error.setConstant(std::numeric_limits<double>::infinity());
  }
  result.factor = scale.asDiagonal() * coarse;
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
