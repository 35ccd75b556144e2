#pragma once
#include <array>
#include <atomic>
#include <cstdint>

namespace mimesis::hw::modbus {

/// Passes the newest value from one thread to another; neither ever waits. Three buffers: one being
/// written, one being read, one between them.
template <class T>
class LatestSlot {
 public:
  /// Writer: replaces the value that the reader has not taken yet.
  void put(const T& value) {
    buffers_[back_] = value;
    back_ = middle_.exchange(static_cast<std::uint8_t>(back_ | kFresh), std::memory_order_acq_rel) &
            kIndex;
  }
  /// Reader: true if `value` was replaced by a newer one.
  bool take(T& value) {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    value = buffers_[front_];
    return true;
  }

 private:
  static constexpr std::uint8_t kFresh = 4, kIndex = 3;

  std::array<T, 3> buffers_{};
  std::atomic<std::uint8_t> middle_{1};
  std::uint8_t back_ = 0;   // the writer's
  std::uint8_t front_ = 2;  // the reader's
};

}  // namespace mimesis::hw::modbus
