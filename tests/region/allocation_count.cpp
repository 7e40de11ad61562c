// SPDX-License-Identifier: Apache-2.0
#include "allocation_count.hpp"

#include <atomic>
#include <cstddef>

namespace {
std::atomic<long> count{0};
}  // namespace

// glibc lets an executable put its own malloc in front of the library's.
extern "C" {
void* __libc_malloc(std::size_t size);

void* malloc(std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
}

namespace trammel::test {

long allocation_count() { return count.load(); }

}  // namespace trammel::test
