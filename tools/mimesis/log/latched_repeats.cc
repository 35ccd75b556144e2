#include "tools/mimesis/log/latched_repeats.h"

#include <utility>

#include "common/log/crc32.h"

namespace mimesis::tool {

bool LatchedRepeats::repeated(const log::MergedReader::Item& item) {
  const auto [known, fresh] = channels_.try_emplace(item.channel, nullptr);
  if (fresh && is_latched(*item.channel)) {
    const log::Channel& channel = *item.channel;
    known->second = &last_[{channel.topic, sender_of(channel), start_of(channel)}];
  }
  const log::Message& m = *item.message;
  if (known->second == nullptr || m.sequence == 0) return false;
  const Last now{m.sequence, m.publish_time, log::crc32(0, m.data)};
  return std::exchange(*known->second, now) == now;
}

}  // namespace mimesis::tool
