// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of environment.hpp.
#pragma once

#include <cfenv>
#include <cfloat>
#include <cmath>
#include <limits>

#include "trammel/certify/environment.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace environment_detail {

// -ffast-math and its parts, as far as compilers tell.
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) || \
    (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__) || defined(_M_FP_FAST)
inline constexpr bool kArithmeticRewritten = true;
#else
inline constexpr bool kArithmeticRewritten = false;
#endif

inline constexpr bool kBinary64 = std::numeric_limits<double>::is_iec559 &&
                                  std::numeric_limits<double>::digits == 53 && FLT_EVAL_METHOD == 0;

/// Rounds to nearest: ties and halves of either sign, computed at run time.
inline bool rounds_to_nearest() {
  const volatile double one = 1.0;
  const volatile double half_ulp = 0x1p-53;
  const volatile double more = 0x1.8p-53;
  const volatile double up = one + half_ulp;
  const volatile double down = -one - half_ulp;
  const volatile double next = one + more;
  const volatile double next_down = -one - more;
  return std::fegetround() == FE_TONEAREST && up == 1.0 && down == -1.0 && next == 1.0 + 0x1p-52 &&
         next_down == -(1.0 + 0x1p-52);
}

/// Keeps subnormal results and subnormal operands.
inline bool underflows_gradually() {
  const volatile double smallest_normal = std::numeric_limits<double>::min();
  const volatile double subnormal = std::numeric_limits<double>::denorm_min();
  const volatile double result = smallest_normal / 2.0;
  const volatile double from_operand = subnormal * 0x1p60;
  return result * 2.0 == smallest_normal && from_operand > 0.0;
}

inline bool fuses_correctly() {
  const volatile double a = 1.0 + 0x1p-30;
  const volatile double b = 1.0 - 0x1p-30;
  return std::fma(a, b, -1.0) == -0x1p-60;
}

}  // namespace environment_detail

TRAMMEL_INLINE std::string_view arithmetic_defect() {
  if constexpr (environment_detail::kArithmeticRewritten) {
    return "compiled with options that rewrite floating-point arithmetic (-ffast-math or a part of it)";
  }
  if constexpr (!environment_detail::kBinary64) {
    return "double is not evaluated as IEEE 754 binary64";
  }
  if (!environment_detail::rounds_to_nearest()) {
    return "rounding is not to nearest";
  }
  if (!environment_detail::underflows_gradually()) {
    return "subnormal numbers are flushed to zero";
  }
  if (!environment_detail::fuses_correctly()) {
    return "the fused multiply-add rounds twice";
  }
  return {};
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
