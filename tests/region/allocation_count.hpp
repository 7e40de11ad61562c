// SPDX-License-Identifier: Apache-2.0
/// @file
/// Number of allocations of this executable so far, through malloc and all that rests on it.
#pragma once

namespace trammel::test {

[[nodiscard]] long allocation_count();

}  // namespace trammel::test
