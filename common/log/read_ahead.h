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

/// Prepares the items of a sequence before they are asked for: `claim` says what the next one is
/// (in order, one thread at a time), `work` does what takes long (threads side by side), `take`
/// gives them out in order. Small sequences never start a thread: the first items are prepared when
/// they are asked for. Bounded: kDepth items, and no further one above kMemory bytes.
template <class Item>
class ReadAhead {
 public:
  static constexpr std::size_t kInline = 2, kWorkers = 2, kDepth = 4;
  static constexpr std::size_t kMemory = 64 << 20;

  /// @param claim  fills the item; false: there is no more
  /// @param size   of a claimed item, how much memory it takes [bytes]
  /// @param threads  false: never
  ReadAhead(std::function<bool(Item&)> claim, std::function<void(Item&)> work,
            std::function<std::size_t(const Item&)> size, bool threads)
      : claim_(std::move(claim)),
        work_(std::move(work)),
        size_(std::move(size)),
        may_start_(threads && std::thread::hardware_concurrency() > 1) {}
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

  /// The next item, or null behind the last.
  std::unique_ptr<Item> take() {
    if (threads_.empty()) {
      if (taken_ < kInline || !may_start_) return prepare();
      for (std::size_t i = 0; i < kWorkers; ++i) threads_.emplace_back([this] { run(); });
    }
    std::unique_lock lock(mutex_);
    ready_.wait(
        lock, [this] { return slots_.empty() ? exhausted_ && !claiming_ : slots_.front().ready; });
    if (slots_.empty()) return nullptr;
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

  std::unique_ptr<Item> fresh() {
    if (spare_.empty()) return std::make_unique<Item>();
    std::unique_ptr<Item> item = std::move(spare_.back());
    spare_.pop_back();
    return item;
  }
  std::unique_ptr<Item> prepare() {
    std::unique_ptr<Item> item = fresh();
    if (exhausted_ || !claim_(*item)) {
      exhausted_ = true;
      return nullptr;
    }
    work_(*item);
    ++taken_;
    return item;
  }
  bool has_room() const { return slots_.empty() || (slots_.size() < kDepth && memory_ < kMemory); }
  void run() {
    std::unique_lock lock(mutex_);
    while (true) {
      room_.wait(lock, [this] { return stopping_ || exhausted_ || (!claiming_ && has_room()); });
      if (stopping_ || exhausted_) return;
      claiming_ = true;
      std::unique_ptr<Item> item = fresh();
      lock.unlock();
      const bool any = claim_(*item);
      lock.lock();
      claiming_ = false;
      exhausted_ = !any;
      if (!any) {
        lock.unlock();
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
  }

  std::function<bool(Item&)> claim_;
  std::function<void(Item&)> work_;
  std::function<std::size_t(const Item&)> size_;
  bool may_start_;
  std::size_t taken_ = 0;  ///< prepared by the caller's thread

  std::mutex mutex_;
  std::condition_variable room_, ready_;
  std::deque<Slot> slots_;  ///< claimed and not yet taken, in order
  std::vector<std::unique_ptr<Item>> spare_;
  std::size_t memory_ = 0;
  bool claiming_ = false, exhausted_ = false, stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace mimesis::log
