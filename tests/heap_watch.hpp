// SPDX-License-Identifier: Apache-2.0
/// @file
/// What this executable takes from the heap, through malloc and all that rests on it. Linking heap_watch.cpp
/// puts counting versions in front of glibc's.
#pragma once

namespace trammel::test {

/// Calls of malloc, calloc, realloc and aligned_alloc so far.
[[nodiscard]] long allocation_count();

/// Bytes held now, and the most since forget_most_bytes().
[[nodiscard]] long bytes_held();
[[nodiscard]] long most_bytes_held();
void forget_most_bytes();

}  // namespace trammel::test
