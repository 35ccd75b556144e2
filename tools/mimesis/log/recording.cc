#include "tools/mimesis/log/recording.h"

#include <fmt/format.h>

namespace mimesis::tool {

Recording::Recording(log::Writer& writer,
                     std::function<std::string(const std::string& type)> descriptors)
    : writer_(writer), descriptors_(std::move(descriptors)) {}

log::Result Recording::add(Recorded message, WallTime now, bool from_first) {
  TopicCount& count = counts_[{message.topic, message.node}];
  const bool same_start = count.received > 0 && count.start_id == message.start_id;
  if (same_start && message.seq <= count.last_seq) return {};  // a latched message, repeated
  std::uint64_t expected = message.seq;
  if (same_start) {
    expected = count.last_seq + 1;
  } else if (from_first) {
    expected = 1;
  }
  count.start_id = message.start_id;
  count.lost += message.seq - expected;
  lost_ += message.seq - expected;
  count.last_seq = message.seq;
  ++count.received;
  ++received_;
  if (!message.ordered) return write(message, now);
  std::pair key{message.log_time_ns, message.node};
  held_.emplace(std::move(key), Held{std::move(message), now});
  return {};
}

log::Result Recording::advance(WallTime now) {
  // The first one held is the earliest of the graph, not the first to have come: it alone decides.
  while (!held_.empty() && held_.begin()->second.received + kHold <= now) {
    if (auto done = write(held_.begin()->second.message, now); !done) return done;
    held_.erase(held_.begin());
  }
  if (writer_.open_chunk_bytes() > 0 && chunk_opened_ + kChunkPeriod <= now) return writer_.flush();
  return {};
}

log::Result Recording::write(const Recorded& message, WallTime now) {
  if (writer_.open_chunk_bytes() == 0) chunk_opened_ = now;
  const auto id = channel(message);
  if (!id) return tl::unexpected(id.error());
  return writer_.write({*id, static_cast<std::uint32_t>(message.seq), message.log_time_ns,
                        message.publish_time_ns, message.payload});
}

tl::expected<std::uint16_t, Status> Recording::channel(const Recorded& message) {
  std::tuple key{message.topic, message.node, message.type};
  if (const auto it = channels_.find(key); it != channels_.end()) return it->second;
  auto schema = schemas_.find(message.type);
  if (schema == schemas_.end()) {
    const auto id = writer_.add_schema(message.type, "protobuf", descriptors_(message.type));
    if (!id) return id;
    schema = schemas_.emplace(message.type, *id).first;
  }
  const auto id = writer_.add_channel(schema->second, message.topic, "protobuf",
                                      {{"node", message.node},
                                       {"latched", message.latched ? "true" : "false"},
                                       {"type_hash", fmt::format("{:016x}", message.type_hash)}});
  if (id) channels_.emplace(std::move(key), *id);
  return id;
}

log::Result Recording::finish() {
  for (const auto& [key, held] : held_) {
    if (auto done = write(held.message, {}); !done) return done;
  }
  held_.clear();
  log::Metadata counts{"mimesis.counts", {}};
  for (const auto& [key, count] : counts_) {
    counts.metadata[fmt::format("{} ({})", key.first, key.second)] =
        fmt::format("received={} lost={}", count.received, count.lost);
  }
  counts.metadata["total"] = fmt::format("received={} lost={}", received_, lost_);
  return writer_.add_metadata(counts);
}

}  // namespace mimesis::tool
