// SPDX-License-Identifier: Apache-2.0
/// @file
/// Version and build configuration. Every other header includes this one first.
#pragma once

#include <Eigen/Core>

#define TRAMMEL_VERSION_MAJOR 0
#define TRAMMEL_VERSION_MINOR 1
#define TRAMMEL_VERSION_PATCH 0

// The inline namespace carries Eigen's alignment: objects compiled with different vector flags have
// different layouts, and mixing them becomes an undefined symbol instead of a crash.
#define TRAMMEL_ABI_JOIN_(major, align) v##major##_a##align
#define TRAMMEL_ABI_JOIN(major, align) TRAMMEL_ABI_JOIN_(major, align)
#define TRAMMEL_ABI TRAMMEL_ABI_JOIN(TRAMMEL_VERSION_MAJOR, EIGEN_MAX_ALIGN_BYTES)

// Heavy definitions live in `*_impl.hpp`: included by their header in header-only use, compiled once in
// the library when TRAMMEL_COMPILED is defined (the CMake target trammel::trammel defines it).
#ifdef TRAMMEL_COMPILED
#define TRAMMEL_INLINE
#else
#define TRAMMEL_INLINE inline
#endif

namespace trammel::inline TRAMMEL_ABI {

/// Library version as "major.minor.patch".
inline constexpr const char* kVersion = "0.1.0";

}  // namespace trammel::inline TRAMMEL_ABI
