#include "common/log/writer.h"

#include <algorithm>
#include <limits>

#include "common/log/crc32.h"

namespace mimesis::log {
namespace {
constexpr std::size_t kMaxIds = std::numeric_limits<std::uint16_t>::max();
}

Writer::Writer(Sink& sink, WriterOptions options)
    : sink_(sink), options_(std::move(options)), compressor_(options_.compression) {
  status_ = emit(kMagic);
  append(record_, Header{options_.profile, options_.library});
  if (status_) status_ = emit(record_);
}

Result Writer::emit(std::string_view bytes) { return emit(bytes, crc32(0, bytes)); }

Result Writer::emit(std::string_view bytes, std::uint32_t crc_of_bytes) {
  if (!status_) return status_;
  crc_ = crc32_join(crc_, crc_of_bytes, bytes.size());
  position_ += bytes.size();
  return status_ = sink_.write(bytes);
}

Result Writer::emit_unless_chunked() {
  if (chunked()) return status_;
  const Result done = emit(record_);
  record_.clear();
  return done;
}

tl::expected<std::uint16_t, Status> Writer::add_schema(std::string name, std::string encoding,
                                                       std::string data) {
  if (schemas_.size() == kMaxIds)
    return tl::unexpected(Status{"a log holds at most 65535 schemas"});
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  schemas_.push_back({id, std::move(name), std::move(encoding), std::move(data)});
  record_.clear();
  append(target(), schemas_.back());
  ++statistics_.schema_count;
  if (auto done = emit_unless_chunked(); !done) return tl::unexpected(done.error());
  return id;
}

tl::expected<std::uint16_t, Status> Writer::add_channel(
    std::uint16_t schema_id, std::string topic, std::string message_encoding,
    std::map<std::string, std::string> metadata) {
  MIMESIS_ASSERT(schema_id <= schemas_.size());
  if (channels_.size() == kMaxIds)
    return tl::unexpected(Status{"a log holds at most 65535 channels"});
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  channels_.push_back(
      {id, schema_id, std::move(topic), std::move(message_encoding), std::move(metadata)});
  record_.clear();
  append(target(), channels_.back());
  ++statistics_.channel_count;
  if (auto done = emit_unless_chunked(); !done) return tl::unexpected(done.error());
  return id;
}

Result Writer::write(const Message& message) {
  MIMESIS_ASSERT(message.channel_id >= 1 && message.channel_id <= channels_.size());
  if (!status_) return status_;
  statistics_.count(message.channel_id, message.log_time);
  record_.clear();
  if (!chunked()) {
    append(record_, message);
    return emit_unless_chunked();
  }
  chunk_start_time_ =
      chunk_has_messages_ ? std::min(chunk_start_time_, message.log_time) : message.log_time;
  chunk_end_time_ = std::max(chunk_end_time_, message.log_time);
  chunk_has_messages_ = true;
  if (options_.message_index) {
    MessageIndex& index = chunk_messages_[message.channel_id];
    index.channel_id = message.channel_id;
    index.records.emplace_back(message.log_time, chunk_.size());
  }
  append(chunk_, message);
  return chunk_.size() >= options_.chunk_size ? flush() : status_;
}

Result Writer::close_chunk() {
  if (chunk_.empty() || !status_) return status_;
  auto compressed = compressor_.run(chunk_);
  if (!compressed) return status_ = tl::unexpected(compressed.error());
  const std::uint32_t crc = crc32(0, chunk_);
  const Chunk head{chunk_start_time_,
                   chunk_end_time_,
                   chunk_.size(),
                   crc,
                   std::string(wire_name(options_.compression)),
                   *compressed};
  ChunkIndex index{.message_start_time = chunk_start_time_,
                   .message_end_time = chunk_end_time_,
                   .chunk_start_offset = position_,
                   .chunk_length = 0,
                   .message_index_offsets = {},
                   .message_index_length = 0,
                   .compression = head.compression,
                   .compressed_size = compressed->size(),
                   .uncompressed_size = chunk_.size()};
  record_.clear();
  append_head(record_, head);
  if (auto done = emit(record_); !done) return done;
  const bool as_is = options_.compression == Compression::none;
  if (auto done = emit(*compressed, as_is ? crc : crc32(0, *compressed)); !done) return done;
  index.chunk_length = position_ - index.chunk_start_offset;

  record_.clear();
  for (auto& [id, messages] : chunk_messages_) {
    if (messages.records.empty()) continue;
    index.message_index_offsets[id] = position_ + record_.size();
    append(record_, messages);
    messages.records.clear();
  }
  index.message_index_length = record_.size();
  if (auto done = emit(record_); !done) return done;
  chunk_indexes_.push_back(std::move(index));
  ++statistics_.chunk_count;
  chunk_.clear();
  chunk_has_messages_ = false;
  chunk_start_time_ = chunk_end_time_ = 0;
  return status_;
}

Result Writer::flush() {
  if (auto done = close_chunk(); !done) return done;
  return status_ = sink_.flush();
}

Result Writer::attach(const Attachment& attachment) {
  if (auto done = close_chunk(); !done) return done;
  AttachmentIndex index{position_,
                        0,
                        attachment.log_time,
                        attachment.create_time,
                        attachment.data.size(),
                        attachment.name,
                        attachment.media_type};
  record_.clear();
  append_head(record_, attachment);
  std::uint32_t crc = crc32(0, std::string_view(record_).substr(kRecordHead));
  crc = crc32(crc, attachment.data);
  if (auto done = emit(record_); !done) return done;
  if (auto done = emit(attachment.data); !done) return done;
  if (auto done = emit({reinterpret_cast<const char*>(&crc), sizeof crc}); !done) return done;
  index.length = position_ - index.offset;
  attachment_indexes_.push_back(std::move(index));
  ++statistics_.attachment_count;
  return flush();
}

Result Writer::add_metadata(const Metadata& metadata) {
  if (auto done = close_chunk(); !done) return done;
  record_.clear();
  append(record_, metadata);
  metadata_indexes_.push_back({position_, record_.size(), metadata.name});
  ++statistics_.metadata_count;
  if (auto done = emit(record_); !done) return done;
  return flush();
}

Result Writer::finish() {
  if (auto done = close_chunk(); !done) return done;
  record_.clear();
  append(record_, DataEnd{crc_});
  if (auto done = emit(record_); !done) return done;
  if (auto done = write_summary(); !done) return done;
  return status_ = sink_.close();
}

Result Writer::write_summary() {
  crc_ = 0;
  const std::uint64_t start = position_;
  std::vector<SummaryOffset> groups;
  const auto group = [&](Opcode opcode, bool wanted, const auto& records) -> Result {
    if (!wanted || records.empty()) return status_;
    record_.clear();
    for (const auto& r : records) append(record_, r);
    groups.push_back({opcode, position_, record_.size()});
    return emit(record_);
  };
  // The order of the reference writer.
  if (auto r = group(Opcode::schema, options_.repeat_schemas, schemas_); !r) return r;
  if (auto r = group(Opcode::channel, options_.repeat_channels, channels_); !r) return r;
  if (auto r = group(Opcode::statistics, options_.statistics, std::vector{statistics_}); !r)
    return r;
  if (auto r = group(Opcode::metadata_index, options_.metadata_index, metadata_indexes_); !r)
    return r;
  if (auto r = group(Opcode::attachment_index, options_.attachment_index, attachment_indexes_);
      !r) {
    return r;
  }
  if (auto r = group(Opcode::chunk_index, options_.chunk_index, chunk_indexes_); !r) return r;

  Footer footer{};
  if (position_ > start) footer.summary_start = start;
  record_.clear();
  if (options_.summary_offsets && !groups.empty()) {
    footer.summary_offset_start = position_;
    for (const SummaryOffset& g : groups) append(record_, g);
  }
  append(record_, footer);
  const std::size_t covered = record_.size() - sizeof footer.summary_crc;
  footer.summary_crc = crc32(crc_, std::string_view(record_).substr(0, covered));
  record_.resize(covered);
  record_.append(reinterpret_cast<const char*>(&footer.summary_crc), sizeof footer.summary_crc);
  record_.append(kMagic);
  return emit(record_);
}

}  // namespace mimesis::log
