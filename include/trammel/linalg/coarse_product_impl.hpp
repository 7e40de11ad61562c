// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of coarse_product.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "trammel/linalg/coarse_product.hpp"
#include "trammel/linalg/product_norms.hpp"

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

  Slices(const EnclosedMatrix& a, const Eigen::VectorXd& scale) {
    const int bits = slice_bits(a.cols());
    third.resize(a.rows(), a.cols());
    first.resize(a.rows(), a.cols());
    second.resize(a.rows(), a.cols());
    Eigen::VectorXd anchor = Eigen::VectorXd::Zero(a.rows());
    for (Eigen::Index k = 0; k < a.cols(); ++k) {
      third.col(k) = scale(k) * a.hi.col(k);
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
      if (a.lo.size() != 0) {
        rest += scale(k) * a.lo.col(k);
      }
    }
  }
};

}  // namespace coarse_product_detail

TRAMMEL_INLINE CoarseProduct coarse_product(const EnclosedMatrix& a, const Eigen::MatrixXd& b) {
  using namespace double_double_detail;
  const auto terms = static_cast<double>(a.cols());
  const Eigen::VectorXd scale = balance(a.hi, b);
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(a.cols());
  Eigen::MatrixXd coarse = scale.cwiseInverse().asDiagonal() * b;
  coarse_product_detail::make_coarse(coarse);
  const coarse_product_detail::Slices slices(a, scale);
  CoarseProduct result;
  result.factor = scale.asDiagonal() * coarse;
  EnclosedMatrix& product = result.product;
  product.hi.noalias() = slices.first * coarse;
  product.lo.noalias() = slices.second * coarse;
  product.radius.noalias() = slices.third * coarse;  // not yet the radius
  Eigen::VectorXd a_error = ((terms + 6.0) * kUnitRoundoff) * row_norms(slices.third, ones);
  if (a.radius.size() != 0) {
    a_error += row_norms(a.radius, scale);
  }
  // Norms and sums round at most terms + 8 times.
  const Eigen::VectorXd size = (1.0 + 8.0 * (terms + 8.0) * kUnitRoundoff) * column_norms(coarse, ones);
  const bool in_range = entries_in_range(a.hi) && entries_in_range(b);
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    for (Eigen::Index i = 0; i < a.rows(); ++i) {
      const DoubleDouble exact = two_sum(product.hi(i, j), product.lo(i, j));
      const DoubleDouble normal = two_sum(exact.hi, exact.lo + product.radius(i, j));
      product.hi(i, j) = normal.hi;
      product.lo(i, j) = normal.lo;
      // The sum of the low parts is rounded once: u^2 of the high one, and u of A3 W as in the norms.
      const double radius =
          a_error(i) * size(j) + 4.0 * kUnitRoundoff * kUnitRoundoff * std::abs(exact.hi) + kUnderflow;
      product.radius(i, j) = in_range ? radius * (1.0 + 0x1p-50) : std::numeric_limits<double>::infinity();
    }
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::linalg
