#pragma once
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace mimesis::walk {

/// Results of job(0) .. job(n − 1), in this order, computed on all processors: jobs share nothing
/// that changes. The first exception is thrown on.
template <class Job>
auto in_parallel(std::size_t n, const Job& job) {
  std::vector<decltype(job(std::size_t{}))> out(n);
  std::atomic<std::size_t> next{0};
  std::exception_ptr trouble;
  std::mutex mutex;
  const auto work = [&] {
    for (std::size_t i = next++; i < n; i = next++) {
      try {
        out[i] = job(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!trouble) trouble = std::current_exception();
      }
    }
  };
  {
    std::vector<std::jthread> others;
    const std::size_t threads = std::max(1U, std::thread::hardware_concurrency());
    for (std::size_t i = 1; i < std::min(threads, n); ++i) others.emplace_back(work);
    work();
  }
  if (trouble) std::rethrow_exception(trouble);
  return out;
}

}  // namespace mimesis::walk
