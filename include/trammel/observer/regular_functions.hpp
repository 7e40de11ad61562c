// SPDX-License-Identifier: Apache-2.0
/// @file
/// Entire functions that the closed form of the bearing-observation problem is made of, without cancellation
/// near zero.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::observer {

namespace detail {

/// Number of Taylor terms in t^2: enough for full double precision at |t| <= 2.
inline constexpr std::size_t kSeriesTerms = 11;
using SeriesCoefficients = std::array<double, kSeriesTerms>;

/// Coefficients numerator(k) (-1)^(k - first) / (2 k + offset)! for k = first, first + 1, ...
template <class Numerator>
constexpr SeriesCoefficients series_coefficients(std::size_t first, std::size_t offset, Numerator numerator) {
  SeriesCoefficients coefficients{};
  double sign = 1.0;
  for (std::size_t i = 0; i < kSeriesTerms; ++i) {
    const std::size_t k = first + i;
    double factorial = 1.0;
    for (std::size_t j = 2; j <= 2 * k + offset; ++j) {
      factorial *= static_cast<double>(j);
    }
    coefficients[i] = sign * numerator(static_cast<double>(k)) / factorial;
    sign = -sign;
  }
  return coefficients;
}

/// Horner's rule in `square` = t^2 with the first `Terms` terms.
template <std::size_t Terms = kSeriesTerms>
constexpr double evaluate_series(const SeriesCoefficients& coefficients, double square) noexcept {
  static_assert(Terms <= kSeriesTerms);
  double sum = 0.0;
  for (std::size_t i = Terms; i-- > 0;) {
    sum = sum * square + coefficients[i];
  }
  return sum;
}

inline constexpr SeriesCoefficients kCubicRemainder = series_coefficients(0, 3, [](double) { return 1.0; });
inline constexpr SeriesCoefficients kSincMinusCos =
    series_coefficients(1, 1, [](double k) { return 2.0 * k; });
inline constexpr SeriesCoefficients kWaveVariance =
    series_coefficients(2, 2, [](double k) { return k - 1.0; });
inline constexpr SeriesCoefficients kTangentSlope =
    series_coefficients(2, 0, [](double k) { return 2.0 * k - 2.0; });

}  // namespace detail

/// Trigonometric quantities of a spatial frequency, all from one sine and one cosine.
///
/// | field           | value                                            | at 0  |
/// |-----------------|--------------------------------------------------|-------|
/// | cos_half        | cos(xi/2)                                        | 1     |
/// | sin_half        | sin(xi/2)                                        | 0     |
/// | sinc_half       | sin(xi/2)/(xi/2)                                 | 1     |
/// | sinc            | sin(xi)/xi                                       | 1     |
/// | cubic_remainder | (xi - sin xi)/xi^3                               | 1/6   |
/// | drop_half       | (sinc(xi/2) - cos(xi/2))/(xi/2)^2                | 1/3   |
struct Frequency {
  double xi;
  double cos_half;
  double sin_half;
  double sinc_half;
  double sinc;
  double cubic_remainder;
  double drop_half;

  explicit Frequency(double frequency) noexcept : xi(frequency) {
    // Above this the direct formulas lose less than one digit; below it these terms reach full precision.
    constexpr double kSeriesLimit = 1.0;
    constexpr std::size_t kTermsToOne = 8;
    constexpr std::size_t kTermsToHalf = 7;
    const double half = 0.5 * xi;
    cos_half = std::cos(half);
    sin_half = std::sin(half);
    sinc_half = xi > 0.0 ? sin_half / half : 1.0;
    sinc = sinc_half * cos_half;
    if (xi < kSeriesLimit) {
      cubic_remainder = detail::evaluate_series<kTermsToOne>(detail::kCubicRemainder, xi * xi);
      drop_half = detail::evaluate_series<kTermsToHalf>(detail::kSincMinusCos, half * half);
    } else {
      cubic_remainder = (1.0 - sinc) / (xi * xi);
      drop_half = (sinc_half - cos_half) / (half * half);
    }
  }

  /// cos(xi)
  [[nodiscard]] double cos() const noexcept { return 1.0 - 2.0 * sin_half * sin_half; }
  /// sinc(xi/2) - cos(xi/2): mean of the unit wave.
  [[nodiscard]] double wave_mean() const noexcept { return 0.25 * xi * xi * drop_half; }
  /// (1 + sinc xi)/2
  [[nodiscard]] double half_power() const noexcept { return 0.5 * (1.0 + sinc); }
  /// (1 + sinc xi)/2 - sinc(xi/2)^2: variance of the unit wave, xi^4/720 for small xi.
  [[nodiscard]] double wave_variance() const noexcept {
    constexpr double kSeriesLimit = 2.0;  // the direct formula loses 3 digits at 1
    if (xi < kSeriesLimit) {
      const double square = xi * xi;
      return square * square * detail::evaluate_series(detail::kWaveVariance, square);
    }
    return half_power() - sinc_half * sinc_half;
  }
  /// d sinc(xi/2)/d xi
  [[nodiscard]] double sinc_half_slope() const noexcept { return -0.25 * xi * drop_half; }
  /// d half_power/d xi = (cos xi - sinc xi)/(2 xi)
  [[nodiscard]] double half_power_slope() const noexcept {
    constexpr double kSeriesLimit = 1.0;
    if (xi < kSeriesLimit) {
      return -0.5 * xi * detail::evaluate_series(detail::kSincMinusCos, xi * xi);
    }
    return (cos() - sinc) / (2.0 * xi);
  }
  /// Derivative of (xi - sin xi)/(1 - cos xi): 1/3 at 0.
  [[nodiscard]] double tangent_slope() const noexcept {
    constexpr double kSeriesLimit = 1.0;
    const double square = sinc_half * sinc_half;
    if (xi < kSeriesLimit) {
      return 4.0 * detail::evaluate_series(detail::kTangentSlope, xi * xi) / (square * square);
    }
    const double double_versine = 4.0 * sin_half * sin_half;
    const double versine = 0.5 * double_versine;
    return (double_versine - xi * xi * sinc) / (versine * versine);
  }
};

}  // namespace trammel::inline TRAMMEL_ABI::observer
