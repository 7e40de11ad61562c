// SPDX-License-Identifier: Apache-2.0
/// @file
/// Independent pieces of work on several threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// Calls work(i) once for every i in 0..count-1, on the calling thread and up to `threads` - 1 others (0: as
/// many threads as the machine has). Each thread works with what make_work(thread) gives it, threads counted
/// from 0, the calling one. The pieces are taken in order by whichever thread is free. `tell(done)`, done
/// pieces out of `count`, is called on the calling thread after each piece it did itself.
/// The first exception ends the work and is thrown here once no thread is at work any more.
template <class MakeWork, class Tell>
void for_each_with_own_work(std::size_t count, unsigned threads, const MakeWork& make_work,
                            const Tell& tell) {
  std::atomic<std::size_t> next{0};
  std::atomic<std::size_t> done{0};
  std::atomic<bool> failed{false};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto take = [&](std::size_t thread, const auto& after) noexcept {
    try {
      auto&& work = make_work(thread);
      for (std::size_t i = next++; i < count && !failed; i = next++) {
        work(i);
        ++done;
        after();
      }
    } catch (...) {
      const std::scoped_lock lock(mutex);
      if (!failed.exchange(true)) {
        failure = std::current_exception();
      }
    }
  };
  const unsigned wanted = threads > 0 ? threads : std::max(1U, std::thread::hardware_concurrency());
  std::vector<std::jthread> others;
  for (std::size_t i = 1; i < std::min<std::size_t>(wanted, count); ++i) {
    others.emplace_back([&take, i] { take(i, [] {}); });
  }
  take(0, [&] { tell(done.load()); });
  others.clear();  // joins
  if (failure) {
    std::rethrow_exception(failure);
  }
}

/// The same where all threads share one `work`.
template <class Work, class Tell>
void for_each_in_parallel(std::size_t count, unsigned threads, const Work& work, const Tell& tell) {
  for_each_with_own_work(
      count, threads, [&work](std::size_t) -> const Work& { return work; }, tell);
}

}  // namespace trammel::inline TRAMMEL_ABI
