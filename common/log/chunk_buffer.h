#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include "common/log/records.h"

namespace mimesis::log {

/// The records of a chunk that is being filled, and the contents of its indexes. Memory is kept
/// when it is cleared.
struct ChunkBuffer {
  std::string records;
  /// first and last log time of the messages; 0 if there is none
  std::uint64_t start_time = 0, end_time = 0;
  bool has_messages = false;
  std::vector<MessageIndex> messages;  ///< by channel id; most may be empty

  void add(const Message& message, bool indexed) {
    start_time = has_messages ? std::min(start_time, message.log_time) : message.log_time;
    end_time = std::max(end_time, message.log_time);
    has_messages = true;
    if (indexed) {
      if (message.channel_id >= messages.size()) messages.resize(message.channel_id + 1u);
      messages[message.channel_id].records.emplace_back(message.log_time, records.size());
    }
    append(records, message);
  }
  void clear() {
    records.clear();
    start_time = end_time = 0;
    has_messages = false;
    for (MessageIndex& index : messages) index.records.clear();
  }
};

}  // namespace mimesis::log
