// SPDX-License-Identifier: Apache-2.0
/// @file
/// The check of order and rows that every part of the filters makes.
#pragma once

#include <string>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"
#include "trammel/filter/design.hpp"

namespace trammel::inline TRAMMEL_ABI::filter::detail {

/// Throws Error unless 1 <= rows <= order <= kMaxOrder.
inline void require_order(int order, int rows) {
  require(order >= 1 && order <= kMaxOrder, "order", std::to_string(order),
          "a whole number from 1 to " + std::to_string(kMaxOrder));
  require(rows >= 1 && rows <= order, "rows", std::to_string(rows),
          "a whole number from 1 to the order " + std::to_string(order) +
              ": a row beyond the order has no factor (1 - q) left, so it cannot be invariant");
}

}  // namespace trammel::inline TRAMMEL_ABI::filter::detail
