// SPDX-License-Identifier: Apache-2.0
/// @file
/// Whether the arithmetic is the one that proofs against rounding errors assume.
#pragma once

#include <string_view>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// Empty if the arithmetic is IEEE 754 binary64, rounded to nearest, with gradual underflow and a correct
/// fused multiply-add; otherwise what is wrong, in a few words. Compiler options that rewrite
/// arithmetic are found when the verifier is compiled, modes of the processor when this is called
/// (they belong to the calling thread).
[[nodiscard]] std::string_view arithmetic_defect();

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/environment_impl.hpp"
#endif
