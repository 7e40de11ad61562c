// SPDX-License-Identifier: Apache-2.0
/// @file
/// One edit of a text, to break a good input file.
#pragma once

#include <string>

#include <gtest/gtest.h>

namespace trammel::test {

/// `text` with the first `from` replaced; the test fails where there is none.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

}  // namespace trammel::test
