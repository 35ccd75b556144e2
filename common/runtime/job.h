#pragma once
#include <functional>
#include <future>
#include <optional>

#include "common/runtime/bus.h"

namespace mimesis::runtime {

/// A long pure computation beside the steps. In lock-step it runs to its end inside `start`, so
/// that the result does not depend on the machine's speed; otherwise on a thread of its own.
template <class T>
class Job {
 public:
  explicit Job(const Bus& bus) : inline_(bus.lockstep()) {}

  /// Precondition: not running. `work` owns copies of all it needs.
  void start(std::function<T()> work) {
    future_ = std::async(inline_ ? std::launch::deferred : std::launch::async, std::move(work));
    if (inline_) future_.wait();
  }
  bool running() const { return future_.valid(); }
  /// The result, once; nothing while it is not ready.
  std::optional<T> take() {
    if (!future_.valid()) return std::nullopt;
    if (!inline_ && future_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
      return std::nullopt;
    }
    return future_.get();
  }

 private:
  bool inline_;
  std::future<T> future_;
};

}  // namespace mimesis::runtime
