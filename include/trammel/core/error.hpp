// SPDX-License-Identifier: Apache-2.0
/// @file
/// Wrong use and bad input: one exception type that says where, what was found, what was expected.
#pragma once

#include <array>
#include <charconv>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// Shortest decimal text that reads back as `value` ("nan", "inf", "-inf" where it is not finite), for
/// messages and files.
[[nodiscard]] inline std::string shortest(double value) {
  std::array<char, 32> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

/// What an Error tells: `where` is an argument, a key or "file:line", the other two are free text.
struct ErrorDetail {
  std::string where;
  std::string found;
  std::string expected;
};

/// Thrown at public boundaries for wrong use or bad input. Numerical trouble is a status, never an Error.
class Error : public std::runtime_error {
 public:
  explicit Error(ErrorDetail detail) : std::runtime_error(message(detail)), detail_(std::move(detail)) {}

  [[nodiscard]] const ErrorDetail& detail() const noexcept { return detail_; }

 private:
  static std::string message(const ErrorDetail& detail) {
    std::string text = detail.where;
    if (!detail.found.empty()) {
      text += ": found " + detail.found;
    }
    if (!detail.expected.empty()) {
      text += (detail.found.empty() ? ": expected " : ", expected ") + detail.expected;
    }
    return text;
  }

  ErrorDetail detail_;
};

/// Throws Error(describe()) unless `holds`; `describe` returns an ErrorDetail. For places that run often: no
/// text is built while all is well.
template <class Describe>
requires std::is_invocable_r_v<ErrorDetail, Describe>
void require(bool holds, Describe&& describe) {
  if (!holds) {
    throw Error(std::forward<Describe>(describe)());
  }
}

/// Throws Error unless `holds`. The texts are only built on failure when passed as string literals.
inline void require(bool holds, std::string_view where, std::string_view found, std::string_view expected) {
  if (!holds) {
    throw Error({std::string(where), std::string(found), std::string(expected)});
  }
}

}  // namespace trammel::inline TRAMMEL_ABI
