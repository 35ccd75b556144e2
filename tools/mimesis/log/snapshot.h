#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tools/mimesis/log/record_file.h"

namespace mimesis::tool {

/// The last messages, bounded in time and bytes, and for each latched topic the value it had before
/// them.
class SnapshotRing {
 public:
  using Message = std::shared_ptr<const Recorded>;
  struct Kept {
    Message message;
    WallTime received;
  };

  /// @param bytes  of payloads, names and bookkeeping
  SnapshotRing(std::chrono::nanoseconds duration, std::uint64_t bytes)
      : duration_(duration), limit_(bytes) {}

  void add(Message message, WallTime now);
  void forget(WallTime now);  ///< what is older than the duration
  const std::deque<Kept>& messages() const { return kept_; }
  /// By topic and node.
  const std::map<std::pair<std::string, std::string>, Message>& latched() const { return latched_; }
  std::uint64_t bytes() const { return bytes_; }

 private:
  void drop_oldest();

  std::chrono::nanoseconds duration_;
  std::uint64_t limit_, bytes_ = 0;
  std::deque<Kept> kept_;
  std::map<std::pair<std::string, std::string>, Message> latched_;
};

struct SnapshotOptions {
  std::chrono::nanoseconds duration{0};  ///< of wall time, kept in memory; 0: no snapshots
  std::uint64_t size = 256'000'000;      ///< kept in memory at most [bytes]
  std::chrono::nanoseconds after{0};     ///< goes on for so long behind the trigger
  std::vector<std::string> topics = {};  ///< whose messages trigger one
  bool on() const { return duration.count() > 0; }
};

/// Writes the ring to a file when something triggers it, in slices between which messages are
/// received. Files NAME_YYYYMMDD-HHMMSS; metadata "mimesis.snapshot" says why.
class Snapshots {
 public:
  /// Messages under way when the trigger came have arrived after this time.
  static constexpr std::chrono::milliseconds kTail{100};

  /// `stamp()`: date and time for names. `report` gets one line per snapshot.
  Snapshots(SnapshotOptions options, std::string output, OpenRecordFile open,
            std::function<std::string()> stamp, std::function<void(const std::string&)> report);

  [[nodiscard]] log::Result write(Recorded message, WallTime now);
  /// One that comes while a snapshot still collects belongs to it; while one is being written it
  /// gives the next.
  [[nodiscard]] log::Result trigger(const std::string& why, WallTime now);
  [[nodiscard]] log::Result advance(WallTime now);
  /// Completes what is under way.
  [[nodiscard]] log::Result finish(WallTime now);

  OwnFiles& files();
  std::uint64_t messages() const { return messages_; }  ///< written
  std::uint64_t bytes_in_memory() const { return ring_.bytes() + waiting_bytes_; }

 private:
  log::Result begin(const std::string& why, WallTime now);
  log::Result write_waiting(std::uint64_t at_least, WallTime now);
  log::Result complete(WallTime now);
  void wait(SnapshotRing::Message message);
  std::string new_path() const;

  SnapshotOptions options_;
  std::string output_;
  OpenRecordFile open_;
  std::function<std::string()> stamp_;
  std::function<void(const std::string&)> report_;
  SnapshotRing ring_;
  OwnFiles files_;
  std::uint64_t messages_ = 0;
  std::map<std::string, WallTime> triggered_;  ///< by topic: when last

  // The snapshot under way.
  std::unique_ptr<RecordFile> file_;
  std::string why_;
  WallTime until_{};
  std::deque<SnapshotRing::Message> waiting_;
  std::uint64_t waiting_bytes_ = 0;
  std::string next_;  ///< why another one follows, or empty
};

}  // namespace mimesis::tool
