// SPDX-License-Identifier: Apache-2.0
/// @file
/// Problems in the SDPA sparse format (.dat-s).
#pragma once

#include <string>
#include <string_view>

#include "trammel/core/config.hpp"
#include "trammel/sdp/problem.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp {

/// Reads the text of a .dat-s file (Fujisawa, Kojima, Nakata, Yamashita, "SDPA user's manual", section on the
/// sparse format): comment lines starting with " or *, the number of variables m, the number of blocks, the
/// block sizes (negative: diagonal), the m costs, then lines "matrix block row column value" counting from
/// one, matrix 0 being F_0. Commas, parentheses and braces count as blanks; text after the numbers of the
/// first three lines is ignored; an entry below the diagonal stands for its mirror image. `name` is used in
/// messages. Throws Error as "name:line" for anything else, also for entries given twice and numbers that are
/// not finite.
[[nodiscard]] Problem parse_sdpa(std::string_view text, std::string_view name);

/// Text of a .dat-s file with every digit of the values. `title` becomes a comment line. A free block, which
/// the format does not have, becomes a diagonal one of twice the size with opposite rows, so Y = Y_first -
/// Y_second; low-rank terms are written out.
[[nodiscard]] std::string to_sdpa(const Problem& problem, std::string_view title = {});

}  // namespace trammel::inline TRAMMEL_ABI::sdp

#ifndef TRAMMEL_COMPILED
#include "trammel/sdp/sdpa_format_impl.hpp"
#endif
