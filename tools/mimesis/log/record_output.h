#pragma once
#include <string>
#include <variant>

#include "tools/mimesis/log/snapshot.h"
#include "tools/mimesis/log/split.h"

namespace mimesis::tool {

/// Where a recording goes: one file, parts that follow each other, or snapshots.
class RecordOutput {
 public:
  RecordOutput(const std::string& output, const SplitOptions& split,
               const SnapshotOptions& snapshot, OpenRecordFile open,
               std::function<void(const std::string& line)> report);

  [[nodiscard]] log::Result start();
  [[nodiscard]] log::Result write(Recorded message, WallTime now);
  [[nodiscard]] log::Result advance(WallTime now);
  [[nodiscard]] log::Result finish(WallTime now);
  /// A snapshot; nothing if these are not what is recorded.
  [[nodiscard]] log::Result trigger(const std::string& why, WallTime now);

  OwnFiles& files();
  std::uint64_t messages() const;
  /// What is being written, for people.
  std::string activity() const;

 private:
  std::variant<SplitLog, Snapshots> output_;
};

/// @throws ConfigError if there are parts of an earlier recording, which would be taken for parts
/// of this one.
void refuse_older_parts(const std::string& output);

}  // namespace mimesis::tool
