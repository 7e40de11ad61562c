// SPDX-License-Identifier: Apache-2.0
/// @file
/// Entire functions that the closed form of the bearing-observation problem is made of, without cancellation
/// near zero.
#pragma once

#include <array>
#include <cstddef>

#include "trammel/core/config.hpp"
#include "trammel/core/elementary.hpp"
#include "trammel/core/packet.hpp"

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
template <std::size_t Terms = kSeriesTerms, class Real>
[[gnu::always_inline]] inline Real evaluate_series(const SeriesCoefficients& coefficients,
                                                   const Real& square) noexcept {
  Real sum = coefficients[Terms - 1];
  for (std::size_t i = Terms - 1; i-- > 0;) {
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
/// | inverse         | 1/xi                                             | 1     |
/// | inverse_square  | 1/sinc(xi/2)^2                                   | 1     |
template <class Real>
struct BasicFrequency {
  Real xi;
  Real cos_half;
  Real sin_half;
  Real sinc_half;
  Real sinc;
  Real cubic_remainder;
  Real drop_half;
  Real inverse;
  Real inverse_square;

  [[gnu::always_inline]] explicit BasicFrequency(const Real& frequency) noexcept : xi(frequency) {
    constexpr std::size_t kTermsToOne = 8;
    constexpr std::size_t kTermsToHalf = 7;
    const Real half = 0.5 * xi;
    const SineCosine<Real> turn = sine_cosine(half);
    cos_half = turn.cosine;
    sin_half = turn.sine;
    const MaskOf<Real> still = xi == 0.0;
    inverse = 1.0 / select(still, Real(1.0), xi);
    sinc_half = select(still, Real(1.0), sin_half * 2.0 * inverse);
    sinc = sinc_half * cos_half;
    inverse_square = 1.0 / (sinc_half * sinc_half);
    const MaskOf<Real> small = xi < kSeriesLimit;
    cubic_remainder = choose(
        small, [&] { return detail::evaluate_series<kTermsToOne>(detail::kCubicRemainder, xi * xi); },
        [&] { return (1.0 - sinc) * (inverse * inverse); });
    drop_half = choose(
        small, [&] { return detail::evaluate_series<kTermsToHalf>(detail::kSincMinusCos, half * half); },
        [&] { return (sinc_half - cos_half) * (4.0 * inverse * inverse); });
  }

  /// cos(xi)
  [[nodiscard]] Real cos() const noexcept { return 1.0 - 2.0 * sin_half * sin_half; }
  /// sinc(xi/2) - cos(xi/2): mean of the unit wave.
  [[nodiscard]] Real wave_mean() const noexcept { return 0.25 * xi * xi * drop_half; }
  /// (1 + sinc xi)/2
  [[nodiscard]] Real half_power() const noexcept { return 0.5 * (1.0 + sinc); }
  /// (1 + sinc xi)/2 - sinc(xi/2)^2: variance of the unit wave, xi^4/720 for small xi.
  [[nodiscard]] Real wave_variance() const noexcept {
    constexpr double kVarianceSeriesLimit = 2.0;  // the direct formula loses 3 digits at 1
    const Real square = xi * xi;
    return choose(
        xi < kVarianceSeriesLimit,
        [&] { return square * square * detail::evaluate_series(detail::kWaveVariance, square); },
        [&] { return half_power() - sinc_half * sinc_half; });
  }
  /// d sinc(xi/2)/d xi
  [[nodiscard]] Real sinc_half_slope() const noexcept { return -0.25 * xi * drop_half; }
  /// d half_power/d xi = (cos xi - sinc xi)/(2 xi)
  [[nodiscard]] Real half_power_slope() const noexcept {
    return choose(
        xi < kSeriesLimit,
        [&] { return -0.5 * xi * detail::evaluate_series(detail::kSincMinusCos, xi * xi); },
        [&] { return 0.5 * (cos() - sinc) * inverse; });
  }
  /// Derivative of (xi - sin xi)/(1 - cos xi): 1/3 at 0.
  [[nodiscard]] Real tangent_slope() const noexcept {
    // 1 - cos xi = xi^2 sinc(xi/2)^2/2
    const Real scale = 4.0 * inverse_square * inverse_square;
    return choose(
        xi < kSeriesLimit, [&] { return scale * detail::evaluate_series(detail::kTangentSlope, xi * xi); },
        [&] {
          const Real inverse2 = inverse * inverse;
          return scale * (4.0 * sin_half * sin_half - xi * xi * sinc) * (inverse2 * inverse2);
        });
  }

 private:
  /// Above this the direct formulas lose less than one digit; below it few terms reach full precision.
  static constexpr double kSeriesLimit = 1.0;
};

using Frequency = BasicFrequency<double>;

}  // namespace trammel::inline TRAMMEL_ABI::observer
