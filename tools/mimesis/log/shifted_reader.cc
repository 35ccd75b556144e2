#include "tools/mimesis/log/shifted_reader.h"

#include <algorithm>

namespace mimesis::tool {
namespace {

std::uint64_t shifted(std::uint64_t time, std::int64_t by_ns) {
  if (by_ns >= 0) return time + static_cast<std::uint64_t>(by_ns);
  return time - std::min(time, static_cast<std::uint64_t>(-by_ns));
}

}  // namespace

ShiftedReader::ShiftedReader(const std::vector<OpenLog>& logs, const log::Selection& selection,
                             std::vector<std::int64_t> offsets_ns)
    : offsets_ns_(std::move(offsets_ns)),
      messages_(logs.size()),
      items_(logs.size()),
      delivered_(logs.size()) {
  offsets_ns_.resize(logs.size(), 0);
  for (const OpenLog& log : logs) {
    readers_.emplace_back(std::vector<log::MergedReader::Input>{{log.source.get(), &log.summary}},
                          selection);
  }
  for (std::size_t i = 0; i < logs.size(); ++i) advance(i);
}

void ShiftedReader::advance(std::size_t log) {
  const log::MergedReader::Item* item = readers_[log].next();
  if (item == nullptr) return;
  messages_[log] = *item->message;
  messages_[log].log_time = shifted(item->message->log_time, offsets_ns_[log]);
  messages_[log].publish_time = shifted(item->message->publish_time, offsets_ns_[log]);
  items_[log] = *item;
  items_[log].log = log;
  items_[log].message = &messages_[log];
  heads_.push({messages_[log].log_time, log});
}

const log::MergedReader::Item* ShiftedReader::next() {
  if (delivered_ < readers_.size()) advance(delivered_);  // its message was in use until now
  delivered_ = readers_.size();
  if (heads_.empty()) return nullptr;
  delivered_ = heads_.top().log;
  heads_.pop();
  return &items_[delivered_];
}

}  // namespace mimesis::tool
