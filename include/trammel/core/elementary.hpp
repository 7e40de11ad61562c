// SPDX-License-Identifier: Apache-2.0
/// @file
/// Sine, cosine and logarithm of numbers and of packets of them.
#pragma once

#include <cstdint>

#include "trammel/core/config.hpp"
#include "trammel/core/packet.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// Sine and cosine of the same angle.
template <class Real>
struct SineCosine {
  Real sine;
  Real cosine;
};

namespace detail {

/// Horner's rule: first + z (next + z (...)).
template <class Real>
[[gnu::always_inline]] inline Real horner(const Real& /*z*/, double last) noexcept {
  return last;
}
template <class Real, class... Rest>
[[gnu::always_inline]] inline Real horner(const Real& z, double first, Rest... rest) noexcept {
  return first + z * horner(z, rest...);
}

}  // namespace detail

/// Sine and cosine of an angle of up to a hundred thousand turns, rad, to 1.5 units in the last place, or
/// 1e-26 next to their zeros. Reduced to an eighth turn around 0 in two parts (Cody and Waite 1980), then
/// the minimax polynomials of fdlibm's k_sin.c and k_cos.c (Sun Microsystems 1993).
template <class Real>
[[nodiscard, gnu::always_inline]] inline SineCosine<Real> sine_cosine(const Real& angle) noexcept {
  using Words = WordsOf<Real>;
  constexpr double kInverseQuarter = 6.36619772367581382433e-01;  // 2/pi
  constexpr double kQuarterHigh = 1.57079632673412561417e+00;     // 33 bits of pi/2
  constexpr double kQuarterLow = 6.07710050650619224932e-11;      // the rest
  constexpr double kToInteger = 0x1.8p52;  // adding it rounds to an integer, held by the low bits
  const Real shifted = angle * kInverseQuarter + kToInteger;
  const Real quarters = shifted - kToInteger;
  const Real r = (angle - quarters * kQuarterHigh) - quarters * kQuarterLow;
  const Real z = r * r;
  const Real sine = r + z * r *
                            detail::horner(z, -1.66666666666666324348e-01, 8.33333333332248946124e-03,
                                           -1.98412698298579493134e-04, 2.75573137070700676789e-06,
                                           -2.50507602534068634195e-08, 1.58969099521155010221e-10);
  const Real half_square = 0.5 * z;
  const Real near_one = 1.0 - half_square;
  const Real cosine =
      near_one + (((1.0 - near_one) - half_square) +
                  z * z *
                      detail::horner(z, 4.16666666666666019037e-02, -1.38888888888741095749e-03,
                                     2.48015872894767294178e-05, -2.75573143513906633035e-07,
                                     2.08757232129817482790e-09, -1.13596475577881948265e-11));
  // An odd number of quarter turns swaps the two; the sine is negative in quarters 2 and 3, the cosine in
  // 1, 2.
  const Words count = bits_of(shifted);
  const Words one(1);
  const Words two(2);
  constexpr unsigned kToSign = 62;
  const auto odd = (count & one) == one;
  const Words sine_sign = (count & two) << kToSign;
  const Words cosine_sign = ((count + one) & two) << kToSign;
  return {from_bits(bits_of(select(odd, cosine, sine)) ^ sine_sign),
          from_bits(bits_of(select(odd, sine, cosine)) ^ cosine_sign)};
}

/// Natural logarithm of a positive normal number to about one unit in the last place; the method of fdlibm's
/// e_log.c (Sun Microsystems 1993).
template <class Real>
[[nodiscard, gnu::always_inline]] inline Real logarithm(const Real& value) noexcept {
  using Words = WordsOf<Real>;
  constexpr double kLog2High = 6.93147180369123816490e-01;
  constexpr double kLog2Low = 1.90821492927058770002e-10;
  constexpr unsigned kMantissa = 52;
  constexpr double kTwo52 = 0x1p52;
  constexpr double kBias = 1023.0;
  const Words root_half(0x3FE6A09E667F3BCDU);  // sqrt(1/2)
  // value = 2^k (1 + f), sqrt(1/2) <= 1 + f < sqrt(2)
  const Words lifted = bits_of(value) + Words(0x3FF0000000000000U - 0x3FE6A09E667F3BCDU);
  const Real k = from_bits((lifted >> kMantissa) | bits_of(Real(kTwo52))) - (kTwo52 + kBias);
  const Real f = from_bits((lifted & Words(0x000FFFFFFFFFFFFFU)) + root_half) - 1.0;
  const Real s = f / (2.0 + f);
  const Real z = s * s;
  const Real rest =
      z * detail::horner(z, 6.666666666666735130e-01, 3.999999999940941908e-01, 2.857142874366239149e-01,
                         2.222219843214978396e-01, 1.818357216161805012e-01, 1.531383769920937332e-01,
                         1.479819860511658591e-01);
  const Real half_square = 0.5 * f * f;
  return k * kLog2High - ((half_square - (s * (half_square + rest) + k * kLog2Low)) - f);
}

}  // namespace trammel::inline TRAMMEL_ABI
