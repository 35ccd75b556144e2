#include "common/log/merged_reader.h"

namespace mimesis::log {

MergedReader::MergedReader(std::vector<Input> inputs, const Selection& selection)
    : inputs_(std::move(inputs)), items_(inputs_.size()), delivered_(inputs_.size()) {
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
