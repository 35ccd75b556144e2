#pragma once
#include <functional>
#include <future>
#include <optional>

#include "common/runtime/bus.h"

namespace mimesis::runtime {

/// A long pure computation beside the steps. In lock-step it runs to its end inside `start`, so
/// that the result does not depend on the machine's speed; otherwise on a thread of its own, and
/// whether it is ready is recorded. A replay computes it when it was ready in the record.
template <class T>
class Job {
 public:
  explicit Job(Bus& bus)
      : bus_(bus), inline_(bus.lockstep()), threaded_(!inline_ && !bus.outside().replaying()) {}

  /// Precondition: not running. `work` owns copies of all it needs.
  void start(std::function<T()> work) {
    future_ = std::async(threaded_ ? std::launch::async : std::launch::deferred, std::move(work));
    if (inline_) future_.wait();
  }
  bool running() const { return future_.valid(); }
  /// The result, once; nothing while it is not ready.
  std::optional<T> take() {
    if (!future_.valid() || (!inline_ && !ready())) return std::nullopt;
    return future_.get();
  }

 private:
  bool ready() {
    return read_outside_value<std::uint8_t>(bus_, "job", [this]() -> std::uint8_t {
             return future_.wait_for(std::chrono::seconds(0)) == std::future_status::ready ? 1 : 0;
           }) != 0;
  }

  Bus& bus_;
  bool inline_, threaded_;
  std::future<T> future_;
};

}  // namespace mimesis::runtime
