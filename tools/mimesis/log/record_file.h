#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/log/writer.h"
#include "tools/mimesis/log/provenance.h"
#include "tools/mimesis/log/recording.h"

namespace mimesis::tool {

/// Space that a recording may take. 0: no limit.
struct DiskLimits {
  std::uint64_t max_size = 0;     ///< of all files of the recording [bytes]
  std::uint64_t min_free = 0;     ///< on the disk [bytes]
  double min_free_percent = 0.0;  ///< of the disk's size [%]
  bool delete_oldest = false;     ///< when full: the recording's own oldest file; else stop

  bool any() const { return max_size > 0 || min_free > 0 || min_free_percent > 0.0; }
};

/// Space for an unprivileged user on the disk that holds a file.
struct DiskSpace {
  std::uint64_t free = 0, size = 0;  ///< [bytes]
};
/// `path` or its folder must exist; all zero if the system does not tell.
DiskSpace disk_space(const std::string& path);

/// Which limit is reached, in words with its figures; empty if none is.
/// @param recorded  size of the recording once its open file is closed [bytes]
std::string reached_limit(const DiskLimits& limits, std::uint64_t recorded, const DiskSpace& disk);

/// The files of one recording, oldest first. The last may be open.
class OwnFiles {
 public:
  void add(std::string path) { files_.push_back({std::move(path), 0}); }
  /// Size of the last file [bytes].
  void set_size(std::uint64_t bytes);
  std::uint64_t total() const { return total_; }
  const std::string& last() const { return files_.back().path; }
  bool empty() const { return files_.empty(); }
  std::vector<std::string> paths() const;
  /// Takes the oldest out of the list; empty if that is the last, which is being written.
  std::string take_oldest();

 private:
  struct File {
    std::string path;
    std::uint64_t bytes;
  };
  std::deque<File> files_;
  std::uint64_t total_ = 0;
};

/// One file of a recording, whole in itself: a channel per topic, node and start of the node,
/// chunks closed by size and by time, counts of what it holds.
class RecordFile {
 public:
  /// Serialised FileDescriptorSet of a type.
  using Descriptors = std::function<std::string(const std::string& type)>;

  /// A message stays in an open chunk for so long; a killed recorder loses as much.
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

/// The head of every file of a recording: attachments and provenance.
class RecordHead {
 public:
  struct Options {
    log::WriterOptions writer;
    std::chrono::nanoseconds sync{0};
    RecordFile::Descriptors descriptors;
  };

  /// Reads the files to attach; the launch file of `provenance` may be missing (it is on another
  /// host). @throws ConfigError if another one cannot be read.
  RecordHead(const std::vector<std::string>& attach, Provenance provenance, Options options);

  /// A new file with this head, written through: a disk that is full already is told.
  tl::expected<std::unique_ptr<RecordFile>, Status> open(const std::string& path) const;

 private:
  struct Attached {
    std::string name, data;
  };
  bool attach(const std::string& path);

  Provenance provenance_;
  Options options_;
  std::vector<Attached> attached_;
};

/// A file that the full disk gave not one byte is no log, and nothing is lost with it.
void remove_if_empty(const std::string& path);

/// "run.mcap", 7 -> "run_007.mcap".
std::string split_path(const std::string& output, std::uint64_t index);

/// Opens a file of the recording and writes its head: attachments, where it comes from.
using OpenRecordFile =
    std::function<tl::expected<std::unique_ptr<RecordFile>, Status>(const std::string& path)>;

/// When to go on in the next file. 0: never for this reason.
struct SplitOptions {
  std::uint64_t size = 0;                ///< no file becomes larger [bytes]
  std::chrono::nanoseconds duration{0};  ///< of log time
  bool on() const { return size > 0 || duration.count() > 0; }
};

/// A recording in one file, or in files NAME_000, NAME_001... that follow each other without loss
/// or repetition: the next is open before the last is closed. Each is whole in itself; latched
/// topics begin with the value they had, at the log time of the first message and with its own seq.
/// Metadata "mimesis.split": index, previous and (once it is closed) next file, empty for the last;
/// of several such records the last one counts. "mimesis.counts" is that of the file,
/// "mimesis.counts.whole" that of the recording up to its end.
class SplitLog {
 public:
  /// The output itself if there is no reason to split.
  SplitLog(std::string output, SplitOptions options, OpenRecordFile open);

  /// Opens the first file.
  [[nodiscard]] log::Result start();
  [[nodiscard]] log::Result write(const Recorded& message, WallTime now);
  [[nodiscard]] log::Result advance(WallTime now) { return file_->advance(now); }
  [[nodiscard]] log::Result finish(WallTime /*now*/) { return close(*file_, ""); }

  /// With their sizes, the open one's as if it were closed now.
  OwnFiles& files();
  const std::string& path() const { return files_.last(); }
  std::uint64_t messages() const { return messages_; }  ///< written, without repeated ones

 private:
  using File = std::unique_ptr<RecordFile>;
  bool due(const Recorded& message);
  /// Metadata that place file `index` among the others.
  std::map<std::string, std::string> place(std::uint64_t index) const;
  tl::expected<File, Status> open(const std::string& path);
  log::Result next(const Recorded& first, WallTime now);
  log::Result close(RecordFile& file, const std::string& next_path);

  std::string output_;
  SplitOptions options_;
  OpenRecordFile open_;
  File file_;
  OwnFiles files_;
  std::uint64_t index_ = 0, messages_ = 0;
  Counts whole_;  ///< of the files that are closed
  /// Last value of each latched topic, by topic and node; kept only if there may be a next file.
  std::map<std::pair<std::string, std::string>, Recorded> latched_;
  bool graph_time_ = false;  ///< a message with a time of the graph was there: only these split
  std::optional<std::uint64_t> first_time_ns_;  ///< log time at which this file began
};

}  // namespace mimesis::tool
