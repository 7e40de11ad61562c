// SPDX-License-Identifier: Apache-2.0
/// @file
/// Lines of CCSDS messages in keyword-value notation.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace trammel::io {

/// One line that is neither blank nor a comment: `KEYWORD = value`, or a keyword alone.
struct KvnLine {
  int number = 0;  ///< in the file, from 1
  std::string keyword;
  std::string value;
  bool has_value = false;  ///< there was a '='
};

/// Splits text into lines; COMMENT lines and blank ones are dropped, blanks around keywords and values too.
/// Error with `name` and line for a keyword that is not of A-Z, 0-9 and '_', or for an empty value.
[[nodiscard]] std::vector<KvnLine> split_kvn(std::string_view text, const std::string& name);

}  // namespace trammel::io
