#pragma once
#include <algorithm>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace mimesis::log {

/// Prepares the items of a sequence before they are requested: `claim` names the next one (in
/// order, one thread at a time), `work` does the slow part (threads in parallel), `take` returns
/// them in order. Small sequences start no thread: the first items are prepared on request.
/// Bounded: kDepth items, and no further one above kMemory bytes.
template <class Item>
class ReadAhead {
 public:
  static constexpr std::size_t kInline = 2, kHelpers = 2, kDepth = 6;
  static constexpr std::size_t kMemory = 64 << 20;

  /// @param claim  fills the item; false: there is no more
  /// @param size   of a claimed item, how much memory it takes [bytes]
  /// @param threads  false: never
  ReadAhead(std::function<bool(Item&)> claim, std::function<void(Item&)> work,
            std::function<std::size_t(const Item&)> size, bool threads)
      : claim_(std::move(claim)),
        work_(std::move(work)),
        size_(std::move(size)),
        may_start_(threads) {}
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;
  ~ReadAhead() {
    {
      const std::scoped_lock lock(mutex_);
      stopping_ = true;
    }
    room_.notify_all();
    for (std::thread& t : threads_) t.join();
  }

  /// The next item, or null behind the last. While that is not ready, the caller's thread prepares
  /// others.
  std::unique_ptr<Item> take() {
    std::unique_lock lock(mutex_);
    if (++taken_ > kInline && may_start_) start();
    while (slots_.empty() || !slots_.front().ready) {
      if (may_claim()) {
        prepare(lock);
      } else if (exhausted_ && slots_.empty()) {
        return nullptr;
      } else {
        ready_.wait(lock);
      }
    }
    std::unique_ptr<Item> item = std::move(slots_.front().item);
    memory_ -= slots_.front().size;
    slots_.pop_front();
    lock.unlock();
    room_.notify_one();
    return item;
  }
  /// Memory for a later item.
  void give_back(std::unique_ptr<Item> item) {
    const std::scoped_lock lock(mutex_);
    if (item && spare_.size() < kDepth) spare_.push_back(std::move(item));
  }

 private:
  struct Slot {
    std::unique_ptr<Item> item;
    std::size_t size = 0;
    bool ready = false;
  };

  void start() {
    may_start_ = false;
    const std::size_t cores = std::thread::hardware_concurrency();
    const std::size_t count = std::clamp<std::size_t>(cores, 1, 1 + kHelpers) - 1;
    for (std::size_t i = 0; i < count; ++i) threads_.emplace_back([this] { help(); });
  }
  bool may_claim() const {
    return !claiming_ && !exhausted_ &&
           (slots_.empty() || (slots_.size() < kDepth && memory_ < kMemory));
  }
  void help() {
    std::unique_lock lock(mutex_);
    while (true) {
      room_.wait(lock, [this] { return stopping_ || exhausted_ || may_claim(); });
      if (stopping_ || exhausted_) return;
      prepare(lock);
    }
  }
  std::unique_ptr<Item> fresh() {
    if (spare_.empty()) return std::make_unique<Item>();
    std::unique_ptr<Item> item = std::move(spare_.back());
    spare_.pop_back();
    return item;
  }
  /// Claims and prepares one item; the lock is given up meanwhile.
  void prepare(std::unique_lock<std::mutex>& lock) {
    claiming_ = true;
    std::unique_ptr<Item> item = fresh();
    lock.unlock();
    const bool any = claim_(*item);
    lock.lock();
    claiming_ = false;
    exhausted_ = !any;
    if (!any) {
      room_.notify_all();
      ready_.notify_one();
      return;
    }
    Slot& slot = slots_.emplace_back();  // stays where it is: only the ends of the queue change
    slot.size = size_(*item);
    memory_ += slot.size;
    lock.unlock();
    room_.notify_one();
    work_(*item);
    lock.lock();
    slot.item = std::move(item);
    slot.ready = true;
    if (&slot == &slots_.front()) ready_.notify_one();
  }

  std::function<bool(Item&)> claim_;
  std::function<void(Item&)> work_;
  std::function<std::size_t(const Item&)> size_;
  bool may_start_;
  std::size_t taken_ = 0;

  std::mutex mutex_;
  std::condition_variable room_, ready_;
  std::deque<Slot> slots_;  ///< claimed and not yet taken, in order
  std::vector<std::unique_ptr<Item>> spare_;
  std::size_t memory_ = 0;
  bool claiming_ = false, exhausted_ = false, stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace mimesis::log
