#include "tools/mimesis/log/latched_repeats.h"

#include <utility>

#include "common/log/crc32.h"

namespace mimesis::tool {
namespace {

std::string value_of(const log::Channel& channel, const std::string& key) {
  const auto it = channel.metadata.find(key);
  return it == channel.metadata.end() ? "" : it->second;
}

}  // namespace

bool is_latched(const log::Channel& channel) { return value_of(channel, "latched") == "true"; }

bool LatchedRepeats::repeated(const log::MergedReader::Item& item) {
  const auto [known, fresh] = channels_.try_emplace(item.channel, nullptr);
  if (fresh && is_latched(*item.channel)) {
    const log::Channel& channel = *item.channel;
    known->second = &last_[{channel.topic, sender_of(channel), value_of(channel, "start_id")}];
  }
  const log::Message& m = *item.message;
  if (known->second == nullptr || m.sequence == 0) return false;
  const Last now{m.sequence, m.publish_time, log::crc32(0, m.data)};
  return std::exchange(*known->second, now) == now;
}

}  // namespace mimesis::tool
