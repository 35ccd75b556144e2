#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "tools/mimesis/log/disk_limits.h"
#include "tools/mimesis/log/record_file.h"

namespace mimesis::tool {

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
  /// Of the file `index` among the others.
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
