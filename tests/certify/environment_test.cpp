// SPDX-License-Identifier: Apache-2.0
#include "trammel/certify/environment.hpp"

#include <cfenv>

#include <gtest/gtest.h>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace {

using trammel::certify::arithmetic_defect;

TEST(Environment, PlainArithmeticIsAccepted) { EXPECT_EQ(arithmetic_defect(), ""); }

TEST(Environment, EveryOtherRoundingIsRefused) {
  for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
    ASSERT_EQ(std::fesetround(mode), 0);
    const auto defect = arithmetic_defect();
    std::fesetround(FE_TONEAREST);
    EXPECT_EQ(defect, "rounding is not to nearest");
  }
  EXPECT_EQ(arithmetic_defect(), "");
}

#if defined(__SSE__)
TEST(Environment, FlushingSubnormalsIsRefused) {
  const unsigned before = _mm_getcsr();
  for (const unsigned flag : {0x8000U, 0x0040U}) {  // flush results, treat operands as zero
    _mm_setcsr(before | flag);
    const auto defect = arithmetic_defect();
    _mm_setcsr(before);
    EXPECT_EQ(defect, "subnormal numbers are flushed to zero");
  }
}
#endif

}  // namespace
