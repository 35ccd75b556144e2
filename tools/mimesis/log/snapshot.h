#pragma once
#include <deque>
#include <memory>
#include <vector>

#include "tools/mimesis/log/record_file.h"

namespace mimesis::tool {

struct SnapshotOptions {
  std::chrono::nanoseconds duration{0};  ///< wall time that is kept in memory; 0: no snapshots
  std::uint64_t size = 256'000'000;      ///< kept in memory at most [bytes]
  std::chrono::nanoseconds after{0};     ///< period after the trigger that is written too
  std::vector<std::string> topics = {};  ///< topics whose messages trigger one
  bool on() const { return duration.count() > 0; }
};

/// Keeps the last messages, bounded in time and bytes, and for each latched topic the value it had
/// before them. Writes these to a file when something triggers it, in slices between which messages
/// are received. Files NAME_YYYYMMDD-HHMMSS; metadata "mimesis.snapshot" has the reason. All calls
/// that write throw WriteFailure.
class Snapshots {
 public:
  /// Messages under way when the trigger came have arrived after this time.
  static constexpr std::chrono::milliseconds kTail{100};

  /// `stamp()`: date and time for names. `report` gets one line per snapshot.
  Snapshots(SnapshotOptions options, std::string output, OpenRecordFile open,
            std::function<std::string()> stamp, std::function<void(const std::string&)> report)
      : options_(std::move(options)),
        output_(std::move(output)),
        open_(std::move(open)),
        stamp_(std::move(stamp)),
        report_(std::move(report)) {}

  void write(Recorded message, WallTime now) {
    const auto m = std::make_shared<const Recorded>(std::move(message));
    kept_bytes_ += size_of(*m);
    kept_.push_back({m, now});
    while (kept_bytes_ > options_.size && kept_.size() > 1) drop_oldest();
    if (file_ != nullptr && now <= until_) wait(m);
    if (std::ranges::find(options_.topics, m->topic) == options_.topics.end()) return;
    // A topic with frequent messages would write the same again and again.
    const auto [last, is_first] = triggered_.try_emplace(m->topic, now);
    if (!is_first && now < last->second + options_.duration) return;
    last->second = now;
    trigger("a message on " + m->topic, now);
  }
  /// One that comes while a snapshot still collects belongs to it; while one is being written it
  /// gives the next.
  void trigger(const std::string& why, WallTime now) {
    if (file_ == nullptr) return begin(why, now);
    if (now > until_) next_ = why;
  }
  void advance(WallTime now) {
    forget(now);
    if (file_ == nullptr) return;
    // At most twice the requested memory, however slow the disk.
    const std::uint64_t excess = waiting_bytes_ - std::min(waiting_bytes_, options_.size);
    write_waiting(std::max(excess, kSlice), now);
    file_->advance(now);
    if (waiting_.empty() && now > until_) complete(now);
  }
  /// Completes pending writes.
  void finish(WallTime now) {
    while (file_ != nullptr) {
      write_waiting(waiting_bytes_, now);
      complete(now);
    }
  }

  /// With their sizes, the open one's as if it were closed now.
  OwnFiles& files() {
    if (file_ != nullptr) files_.set_size(file_->size_if_closed());
    return files_;
  }
  std::uint64_t messages() const { return messages_; }  ///< written
  std::uint64_t bytes_in_memory() const { return kept_bytes_ + waiting_bytes_; }
  /// Where messages go, for people.
  std::string place() const { return "in memory " + bytes_text(bytes_in_memory()); }

 private:
  using Message = std::shared_ptr<const Recorded>;
  struct Kept {
    Message message;
    WallTime received;
  };
  static constexpr std::uint64_t kSlice = 4'000'000;  ///< some 20 ms of compression [bytes]

  /// With names and bookkeeping [bytes].
  static std::uint64_t size_of(const Recorded& m) {
    return sizeof(Recorded) + sizeof(Kept) + m.topic.size() + m.type.size() + m.node.size() +
           m.payload.size();
  }
  void forget(WallTime now) {
    while (!kept_.empty() && kept_.front().received + options_.duration < now) drop_oldest();
  }
  void drop_oldest() {
    const Message message = std::move(kept_.front().message);
    kept_.pop_front();
    kept_bytes_ -= size_of(*message);
    if (message->latched) latched_[{message->topic, message->node}] = message;
  }
  void wait(const Message& message) {
    waiting_bytes_ += size_of(*message);
    waiting_.push_back(message);
  }
  std::string new_path() const {
    const std::filesystem::path path(output_);
    const std::string stem = fmt::format("{}_{}", path.stem().string(), stamp_());
    const std::vector<std::string> own = files_.paths();
    for (int n = 1;; ++n) {
      const std::string number = n == 1 ? "" : fmt::format("-{}", n);
      std::string name = path.parent_path() / (stem + number + path.extension().string());
      if (!std::filesystem::exists(name) && std::ranges::find(own, name) == own.end()) return name;
    }
  }
  void begin(const std::string& why, WallTime now) {
    forget(now);
    const std::string path = new_path();
    file_ = open_(path);
    files_.add(path);
    why_ = why;
    until_ = now + std::max<std::chrono::nanoseconds>(options_.after, kTail);
    file_->add_metadata("mimesis.snapshot", {{"trigger", why}});
    for (const auto& [key, m] : latched_) {
      file_->repeat(*m, kept_.empty() ? m->log_time_ns : kept_.front().message->log_time_ns, now);
    }
    for (const Kept& kept : kept_) wait(kept.message);
  }
  void write_waiting(std::uint64_t at_least, WallTime now) {
    for (std::uint64_t done = 0; done < at_least && !waiting_.empty(); waiting_.pop_front()) {
      const std::uint64_t size = size_of(*waiting_.front());
      file_->write(*waiting_.front(), now);
      done += size;
      waiting_bytes_ -= size;
      ++messages_;
    }
  }
  void complete(WallTime now) {
    file_->finish();
    const std::uint64_t bytes = file_->writer().bytes_written();
    report_(fmt::format("{}: {} messages, {} ({})", files_.last(),
                        file_->writer().statistics().message_count, bytes_text(bytes), why_));
    files_.set_size(bytes);
    file_.reset();
    if (!next_.empty()) begin(std::exchange(next_, {}), now);
  }

  SnapshotOptions options_;
  std::string output_;
  OpenRecordFile open_;
  std::function<std::string()> stamp_;
  std::function<void(const std::string&)> report_;
  std::deque<Kept> kept_;
  std::uint64_t kept_bytes_ = 0;
  std::map<TopicAndNode, Message> latched_;
  OwnFiles files_;
  std::uint64_t messages_ = 0;
  std::map<std::string, WallTime> triggered_;  ///< by topic: when last

  // The snapshot under way.
  std::unique_ptr<RecordFile> file_;
  std::string why_;
  WallTime until_{};
  std::deque<Message> waiting_;
  std::uint64_t waiting_bytes_ = 0;
  std::string next_;  ///< why another one follows, or empty
};

}  // namespace mimesis::tool
