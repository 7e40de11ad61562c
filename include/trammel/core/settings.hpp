// SPDX-License-Identifier: Apache-2.0
/// @file
/// Fields of settings structs described once: printing, reading, the command line and validation share it.
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <type_traits>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// Description of one settings field. A settings struct `S` offers
/// `template <class Visitor> void visit_fields(S&, Visitor&&)` (also for `const S&`), which calls
/// `visitor(FieldDoc, field)` once per member, in order of declaration.
struct FieldDoc {
  std::string_view name;
  std::string_view unit;  ///< "" for dimensionless
  std::string_view meaning;
  double minimum = -std::numeric_limits<double>::infinity();  ///< smallest allowed value (numbers only)
  double maximum = std::numeric_limits<double>::infinity();   ///< largest allowed value (numbers only)
};

/// Throws Error naming the first numeric field that is NaN or outside its documented range.
template <class Settings>
void validate(const Settings& settings, std::string_view where) {
  visit_fields(settings, [&](const FieldDoc& doc, const auto& value) {
    using Value = std::decay_t<decltype(value)>;
    if constexpr (std::is_arithmetic_v<Value> && !std::is_same_v<Value, bool>) {
      const auto number = static_cast<double>(value);
      if (!(number >= doc.minimum && number <= doc.maximum)) {
        throw Error({std::string(where) + "." + std::string(doc.name), std::to_string(number),
                     "a number from " + std::to_string(doc.minimum) + " to " + std::to_string(doc.maximum)});
      }
    }
  });
}

}  // namespace trammel::inline TRAMMEL_ABI
