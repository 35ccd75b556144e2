#include "tools/mimesis/log/record_file.h"

#include <fmt/format.h>

namespace mimesis::tool {
namespace {

constexpr std::uint64_t kPerMessage = 31;     // head of its record [bytes]
constexpr std::uint64_t kPerIndexEntry = 16;  // [bytes]
constexpr std::size_t kUnderWay = 3;          // chunks that the writer keeps before it waits

}  // namespace

RecordFile::RecordFile(std::unique_ptr<log::Sink> sink, log::WriterOptions options,
                       Descriptors descriptors, std::chrono::nanoseconds sync)
    : sink_(std::move(sink)),
      writer_(*sink_, std::move(options)),
      descriptors_(std::move(descriptors)),
      sync_(sync) {}

log::Result RecordFile::write(const Recorded& message, WallTime now) {
  counts_.add(message);
  return put(message, message.log_time_ns, now);
}

log::Result RecordFile::repeat(const Recorded& message, std::uint64_t log_time_ns, WallTime now) {
  return put(message, log_time_ns, now);
}

log::Result RecordFile::put(const Recorded& message, std::uint64_t log_time_ns, WallTime now) {
  if (writer_.open_chunk_bytes() == 0) {
    chunk_opened_ = now;
    chunk_messages_ = 0;
  }
  const auto id = channel(message);
  if (!id) return tl::unexpected(id.error());
  ++chunk_messages_;
  const std::uint64_t bytes = writer_.open_chunk_bytes() + message.payload.size() + kPerMessage;
  auto done = writer_.write({*id, static_cast<std::uint32_t>(message.seq), log_time_ns,
                             message.publish_time_ns, message.payload});
  if (writer_.open_chunk_bytes() == 0) closed_chunk(bytes);
  return done;
}

log::Result RecordFile::advance(WallTime now) {
  if (writer_.open_chunk_bytes() > 0 && now >= chunk_opened_ + kChunkPeriod) {
    closed_chunk(writer_.open_chunk_bytes());
    if (auto done = writer_.flush(); !done) return done;
  }
  if (sync_.count() == 0 || now < synced_ + sync_) return {};
  synced_ = now;
  return writer_.sync();
}

void RecordFile::closed_chunk(std::uint64_t bytes) {
  under_way_.push_back(bytes + kPerIndexEntry * chunk_messages_);
  if (under_way_.size() > kUnderWay) under_way_.pop_front();
  chunk_messages_ = 0;
}

tl::expected<std::uint16_t, Status> RecordFile::channel(const Recorded& message) {
  std::tuple key{message.topic, message.node, message.type, message.start_id};
  if (const auto it = channels_.find(key); it != channels_.end()) return it->second;
  const std::size_t start = writer_.open_chunk_bytes();
  auto schema = schemas_.find(message.type);
  if (schema == schemas_.end()) {
    const auto id = writer_.add_schema(message.type, "protobuf", descriptors_(message.type));
    if (!id) return id;
    schema = schemas_.emplace(message.type, *id).first;
  }
  const std::size_t middle = writer_.open_chunk_bytes();
  const auto id = writer_.add_channel(schema->second, message.topic, "protobuf",
                                      {{"node", message.node},
                                       {"latched", message.latched ? "true" : "false"},
                                       {"type_hash", fmt::format("{:016x}", message.type_hash)},
                                       {"start_id", std::to_string(message.start_id)}});
  if (!id) return id;
  schema_bytes_ += middle - start;
  channel_bytes_ += writer_.open_chunk_bytes() - middle;
  channels_.emplace(std::move(key), *id);
  clocks_[message.node] = message.clock;
  return id;
}

std::uint64_t RecordFile::size_if_closed(std::size_t message) const {
  if (closed_) return writer_.bytes_written();
  // From above: payloads as if compression did nothing; the counts repeat the names of a channel
  // twice.
  constexpr std::uint64_t kFixed = 4096, kPerChunk = 256, kPerChannel = 160,
                          kPerChannelInChunk = 32;
  const std::uint64_t channels = channels_.size() + 1;
  const std::uint64_t chunks = writer_.statistics().chunk_count + 1;
  const std::uint64_t open = writer_.open_chunk_bytes() + kPerMessage + message +
                             kPerIndexEntry * (chunk_messages_ + 1) + kPerChannelInChunk * channels;
  std::uint64_t bytes = writer_.bytes_written() + open;
  for (const std::uint64_t chunk : under_way_) bytes += chunk + kPerChannelInChunk * channels;
  return bytes + chunks * (kPerChunk + 10 * channels) + schema_bytes_ + 3 * channel_bytes_ +
         kPerChannel * channels + kFixed;
}

log::Result RecordFile::finish() {
  if (auto done = writer_.add_metadata({"mimesis.counts", counts_.metadata()}); !done) return done;
  if (auto done = writer_.add_metadata({"mimesis.nodes", clocks_}); !done) return done;
  closed_ = true;
  return writer_.finish();
}

}  // namespace mimesis::tool
