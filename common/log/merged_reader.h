#pragma once
#include <memory>
#include <queue>
#include <vector>

#include "common/log/indexed_reader.h"

namespace mimesis::log {

/// Delivers the messages of several logs in the order of log time; equal ones in the order of the
/// logs, then of the file. Ids of channels belong to their log: use `channel` and `schema`.
/// A selection is about the times as they stand in the files.
class MergedReader {
 public:
  struct Input {
    const Source* source;
    const Summary* summary;
    std::int64_t offset_ns = 0;  ///< added to its times, for a clock that was wrong; none below 0
  };
  struct Item {
    std::size_t log = 0;               ///< index of its log
    const Channel* channel = nullptr;  ///< never null
    const Schema* schema = nullptr;    ///< null if the channel has none
    const Message* message = nullptr;  ///< until the next call
  };

  /// Sources and summaries outlive the reader.
  MergedReader(std::vector<Input> inputs, const Selection& selection = {});

  /// Next message, or null at the end. Messages of undefined channels are left out.
  const Item* next();
  /// Chunks of one log that could not be read.
  const std::vector<Damage>& damages(std::size_t log) const { return readers_[log]->damages(); }

 private:
  struct Head {
    std::uint64_t log_time;
    std::size_t log;
    bool operator>(const Head& other) const {
      return std::pair(log_time, log) > std::pair(other.log_time, other.log);
    }
  };
  void advance(std::size_t log);

  std::vector<Input> inputs_;
  std::vector<std::unique_ptr<IndexedReader>> readers_;
  std::vector<Item> items_;       ///< next of each log
  std::vector<Message> shifted_;  ///< messages of logs with a time offset
  std::priority_queue<Head, std::vector<Head>, std::greater<>> heads_;
  std::size_t delivered_ = 0;  ///< log of the last delivered, or readers_.size()
};

}  // namespace mimesis::log
