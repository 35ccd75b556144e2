#pragma once
#include <cstdint>
#include <queue>
#include <vector>

#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// As MergedReader, with the clock of each log set right: `offsets_ns` is added to its log and
/// publish times (no time goes below 0). Equal times in the order of the logs, then of the file.
class ShiftedReader {
 public:
  /// The logs outlive the reader. `selection` is about the times as they stand in the files.
  ShiftedReader(const std::vector<OpenLog>& logs, const log::Selection& selection,
                std::vector<std::int64_t> offsets_ns);
  /// Next message, or null at the end.
  const log::MergedReader::Item* next();
  const std::vector<log::Damage>& damages(std::size_t log) const {
    return readers_[log].damages(0);
  }

 private:
  struct Head {
    std::uint64_t log_time;
    std::size_t log;
    bool operator>(const Head& other) const {
      return std::pair(log_time, log) > std::pair(other.log_time, other.log);
    }
  };
  void advance(std::size_t log);

  std::vector<std::int64_t> offsets_ns_;
  std::vector<log::MergedReader> readers_;
  std::vector<log::Message> messages_;
  std::vector<log::MergedReader::Item> items_;
  std::priority_queue<Head, std::vector<Head>, std::greater<>> heads_;
  std::size_t delivered_;
};

}  // namespace mimesis::tool
