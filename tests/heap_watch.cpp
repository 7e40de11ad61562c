// SPDX-License-Identifier: Apache-2.0
#include "heap_watch.hpp"

#include <malloc.h>

#include <atomic>
#include <cstddef>

namespace {
std::atomic<long> calls{0};
std::atomic<long> held{0};
std::atomic<long> most{0};

void* counted(void* block) {
  ++calls;
  const long now = held += static_cast<long>(malloc_usable_size(block));
  long before = most.load();
  while (now > before && !most.compare_exchange_weak(before, now)) {
  }
  return block;
}
}  // namespace

// glibc's own names behind malloc and its relatives: it lets an executable put its own versions in front.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);

void* malloc(std::size_t size) { return counted(__libc_malloc(size)); }
void* calloc(std::size_t count, std::size_t size) { return counted(__libc_calloc(count, size)); }
void* realloc(void* block, std::size_t size) {
  held -= static_cast<long>(malloc_usable_size(block));
  return counted(__libc_realloc(block, size));
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return counted(__libc_memalign(alignment, size));
}
void free(void* block) {
  held -= static_cast<long>(malloc_usable_size(block));
  __libc_free(block);
}
}

namespace trammel::test {

long allocation_count() { return calls.load(); }
long bytes_held() { return held.load(); }
long most_bytes_held() { return most.load(); }
void forget_most_bytes() { most = held.load(); }

}  // namespace trammel::test
