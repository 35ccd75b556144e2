#pragma once
#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <tuple>

#include "common/log/writer.h"
#include "tools/mimesis/log/recording.h"

namespace mimesis::tool {

/// One file of a recording, whole in itself: a channel per topic, node and start of the node,
/// chunks closed by size and by time, counts of what it holds.
class RecordFile {
 public:
  /// Serialised FileDescriptorSet of a type.
  using Descriptors = std::function<std::string(const std::string& type)>;

  /// So long a message stays in an open chunk: what a killed recorder has not written yet.
  static constexpr std::chrono::milliseconds kChunkPeriod{40};

  /// `sync`: so often everything is brought to the disk, against power cuts; 0: never.
  RecordFile(std::unique_ptr<log::Sink> sink, log::WriterOptions options, Descriptors descriptors,
             std::chrono::nanoseconds sync = {});

  [[nodiscard]] log::Result write(const Recorded& message, WallTime now);
  /// A latched message of an earlier file, at another log time; not counted.
  [[nodiscard]] log::Result repeat(const Recorded& message, std::uint64_t log_time_ns,
                                   WallTime now);
  /// Closes a chunk that was open long enough, and syncs.
  [[nodiscard]] log::Result advance(WallTime now);
  /// Writes metadata "mimesis.counts" and "mimesis.nodes" (name -> clock) and closes the file.
  [[nodiscard]] log::Result finish();

  log::Writer& writer() { return writer_; }  ///< for attachments and metadata
  const Counts& counts() const { return counts_; }
  std::uint64_t messages() const { return writer_.statistics().message_count; }
  /// The size; of an open file from above, as if it were closed now with `message` more [bytes].
  std::uint64_t size_if_closed(std::size_t message = 0) const;

 private:
  [[nodiscard]] log::Result put(const Recorded& message, std::uint64_t log_time_ns, WallTime now);
  tl::expected<std::uint16_t, Status> channel(const Recorded& message);
  void closed_chunk(std::uint64_t bytes);

  std::unique_ptr<log::Sink> sink_;
  log::Writer writer_;
  Descriptors descriptors_;
  std::map<std::string, std::uint16_t> schemas_;  ///< by type
  /// By topic, node, type and start.
  std::map<std::tuple<std::string, std::string, std::string, std::uint64_t>, std::uint16_t>
      channels_;
  std::uint64_t schema_bytes_ = 0, channel_bytes_ = 0;  ///< the summary repeats them
  std::uint64_t chunk_messages_ = 0;                    ///< in the open chunk
  std::deque<std::uint64_t> under_way_;  ///< sizes of closed chunks that may not be written yet
  std::map<std::string, std::string> clocks_;  ///< of nodes
  Counts counts_;
  WallTime chunk_opened_{};
  std::chrono::nanoseconds sync_;
  WallTime synced_{};
  bool closed_ = false;
};

}  // namespace mimesis::tool
