// SPDX-License-Identifier: Apache-2.0
/// @file
/// Reads the matrices of `trammel filter general`.
#pragma once

#include <string>

#include "document.hpp"
#include "trammel/filter/general_method.hpp"

namespace trammel::io {

/// What such a file says.
struct GeneralFilterFile {
  int order = 2;
  double sampling_s = 1.0;
  bool operator_given = false;     ///< S was given, not B
  filter::PolynomialMatrix a;      ///< k x k
  filter::PolynomialMatrix other;  ///< B or S, k x k
  int samples = 10;                ///< of the pulse responses and series printed
};

/// Text for `--help`.
[[nodiscard]] std::string general_filter_help();

/// Reads the file; Error with file, line or key for anything unknown, missing or out of range.
[[nodiscard]] GeneralFilterFile read_general_filter(const Document& document);

/// The method of the file; what it rejects is an Error at the key A, B or S.
[[nodiscard]] filter::GeneralMethod make_general_method(const Document& document,
                                                        const GeneralFilterFile& file);

}  // namespace trammel::io
