#include "common/log/merged_reader.h"

#include <algorithm>

namespace mimesis::log {
namespace {

std::uint64_t shifted(std::uint64_t time, std::int64_t by_ns) {
  if (by_ns >= 0) return time + static_cast<std::uint64_t>(by_ns);
  return time - std::min(time, static_cast<std::uint64_t>(-by_ns));
}

}  // namespace

MergedReader::MergedReader(std::vector<Input> inputs, const Selection& selection)
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

void MergedReader::advance(std::size_t log) {
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

const MergedReader::Item* MergedReader::next() {
  if (delivered_ < readers_.size()) advance(delivered_);  // its message was in use until now
  delivered_ = readers_.size();
  if (heads_.empty()) return nullptr;
  delivered_ = heads_.top().log;
  heads_.pop();
  return &items_[delivered_];
}

}  // namespace mimesis::log
