#include "tools/mimesis/log/play_ahead.h"

#include <algorithm>

namespace mimesis::tool {
namespace {

constexpr std::size_t kBatchBytes = 256 * 1024, kBatchMessages = 1024;
constexpr double kFirstSeconds = 0.5, kMostSeconds = 8.0;

}  // namespace

PlayAhead::PlayAhead(Playback& playback, PlayAheadLimits limits, std::function<void()> arrived)
    : playback_(playback),
      limits_(limits),
      arrived_(std::move(arrived)),
      seconds_(limits.seconds > 0.0 ? limits.seconds : kFirstSeconds) {}

PlayAhead::~PlayAhead() { stop(); }

void PlayAhead::stop() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  thread_.join();
}

std::vector<PlayedValue> PlayAhead::seek(std::uint64_t log_time_ns) {
  stop();
  batches_.clear();
  bytes_ = 0;
  current_.messages.clear();
  next_ = 0;
  at_end_ = primed_ = full_ = false;
  std::vector<PlayedValue> latched = playback_.seek(log_time_ns);
  thread_ = std::jthread([this](const std::stop_token& stop) { read(stop); });
  return latched;
}

void PlayAhead::read(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    Batch batch;
    {
      const std::lock_guard lock(mutex_);
      if (!spare_.empty()) {
        batch = std::move(spare_.back());
        spare_.pop_back();
      }
    }
    const bool more = fill(batch);
    std::unique_lock lock(mutex_);
    if (!batch.messages.empty()) {
      bytes_ += batch.bytes.size();
      batches_.push_back(std::move(batch));
    }
    at_end_ = !more;
    full_ = at_end_ || enough();
    if (std::exchange(awaited_, false) || full_) arrived_();
    if (at_end_) return;
    taken_.wait(lock, stop, [this] { return !enough(); });
    full_ = false;
  }
}

bool PlayAhead::fill(Batch& batch) {
  batch.bytes.clear();
  batch.messages.clear();
  batch.ends.clear();
  Played played;
  bool more = true;
  while (batch.bytes.size() < kBatchBytes && batch.messages.size() < kBatchMessages) {
    more = playback_.next(played);
    if (!more) break;
    batch.bytes.insert(batch.bytes.end(), played.payload.begin(), played.payload.end());
    batch.messages.push_back(played);
    batch.ends.push_back(batch.bytes.size());
  }
  std::size_t begin = 0;  // only now do the bytes stay where they are
  for (std::size_t i = 0; i < batch.messages.size(); ++i) {
    batch.messages[i].payload = {batch.bytes.data() + begin, batch.ends[i] - begin};
    begin = batch.ends[i];
  }
  return more;
}

bool PlayAhead::enough() const {
  if (batches_.empty()) return false;
  if (bytes_ >= limits_.bytes) return true;
  const std::uint64_t first = batches_.front().messages.front().log_time_ns;
  const std::uint64_t last = batches_.back().messages.back().log_time_ns;
  return static_cast<double>(last - first) * 1e-9 >= seconds_ * rate_;
}

const Played* PlayAhead::front() {
  if (next_ < current_.messages.size()) return &current_.messages[next_];
  const std::lock_guard lock(mutex_);
  if (batches_.empty()) {
    if (at_end_) return nullptr;
    if (primed_ && !awaited_ && limits_.seconds <= 0.0) {
      seconds_ = std::min(2.0 * seconds_, kMostSeconds);
    }
    awaited_ = true;
    return nullptr;
  }
  // Fresh memory costs more than a copy; as many as were ever ahead at once.
  if (!current_.messages.empty()) spare_.push_back(std::move(current_));
  current_ = std::move(batches_.front());
  batches_.pop_front();
  bytes_ -= current_.bytes.size();
  next_ = 0;
  primed_ = true;
  taken_.notify_one();
  return &current_.messages.front();
}

void PlayAhead::pop() { ++next_; }

bool PlayAhead::ended() {
  if (next_ < current_.messages.size()) return false;
  const std::lock_guard lock(mutex_);
  return at_end_ && batches_.empty();
}

bool PlayAhead::full() {
  const std::lock_guard lock(mutex_);
  return full_;
}

void PlayAhead::set_rate(double rate) {
  const std::lock_guard lock(mutex_);
  rate_ = rate;
  taken_.notify_one();
}

}  // namespace mimesis::tool
