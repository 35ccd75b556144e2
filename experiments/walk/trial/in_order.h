#pragma once
#include <atomic>
#include <exception>
#include <functional>
#include <future>
#include <thread>
#include <vector>

namespace mimesis::walk {

/// job(0) .. job(n − 1) on `jobs` threads, `done` with their results in this order from the calling
/// thread. Jobs share nothing that changes. The first exception is thrown on.
template <class Result>
void in_order(std::size_t n, int jobs, const std::function<Result(std::size_t)>& job,
              const std::function<void(const Result&)>& done) {
  std::vector<std::promise<Result>> results(n);
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < n; i = next++) {
      try {
        results[i].set_value(job(i));
      } catch (...) {
        results[i].set_exception(std::current_exception());
        next = n;  // the others would be for nothing
      }
    }
  };
  std::vector<std::jthread> workers;
  for (int i = 0; i < jobs; ++i) workers.emplace_back(work);
  for (auto& result : results) done(result.get_future().get());
}

}  // namespace mimesis::walk
