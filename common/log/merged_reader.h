#pragma once
#include <algorithm>
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
  MergedReader(std::vector<Input> inputs, const Selection& selection = {})
      : inputs_(std::move(inputs)),
        items_(inputs_.size()),
        shifted_(inputs_.size()),
        delivered_(inputs_.size()) {
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      readers_.push_back(
          std::make_unique<IndexedReader>(*inputs_[i].source, *inputs_[i].summary, selection));
      advance(i);
    }
  }

  /// Next message, or null at the end. Messages of undefined channels are left out.
  const Item* next() {
    if (delivered_ < readers_.size()) advance(delivered_);  // its message was in use until now
    delivered_ = readers_.size();
    if (heads_.empty()) return nullptr;
    delivered_ = heads_.top().log;
    heads_.pop();
    return &items_[delivered_];
  }
  /// Chunks of one log that could not be read.
  const std::vector<Damage>& damages(std::size_t log) const { return readers_[log]->damages(); }

 private:
  static std::uint64_t shifted(std::uint64_t time, std::int64_t by_ns) {
    if (by_ns >= 0) return time + static_cast<std::uint64_t>(by_ns);
    return time - std::min(time, static_cast<std::uint64_t>(-by_ns));
  }
  struct Head {
    std::uint64_t log_time;
    std::size_t log;
    bool operator>(const Head& other) const {
      return std::pair(log_time, log) > std::pair(other.log_time, other.log);
    }
  };
  void advance(std::size_t log) {
    const Summary& summary = *inputs_[log].summary;
    while (const Message* message = readers_[log]->next()) {
      const auto channel = summary.channels.find(message->channel_id);
      if (channel == summary.channels.end()) continue;
      const auto schema = summary.schemas.find(channel->second.schema_id);
      if (const std::int64_t offset_ns = inputs_[log].offset_ns; offset_ns != 0) {
        shifted_[log] = *message;
        shifted_[log].log_time = shifted(message->log_time, offset_ns);
        shifted_[log].publish_time = shifted(message->publish_time, offset_ns);
        message = &shifted_[log];
      }
      items_[log] = {log, &channel->second,
                     schema == summary.schemas.end() ? nullptr : &schema->second, message};
      heads_.push({message->log_time, log});
      return;
    }
  }

  std::vector<Input> inputs_;
  std::vector<std::unique_ptr<IndexedReader>> readers_;
  std::vector<Item> items_;       ///< next of each log
  std::vector<Message> shifted_;  ///< messages of logs with a time offset
  std::priority_queue<Head, std::vector<Head>, std::greater<>> heads_;
  std::size_t delivered_ = 0;  ///< log of the last delivered, or readers_.size()
};

}  // namespace mimesis::log
