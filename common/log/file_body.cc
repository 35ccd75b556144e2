#include "common/log/file_body.h"

#include "common/log/crc32.h"

namespace mimesis::log {

FileBody::FileBody(Sink& sink, const WriterOptions& options)
    : sink_(sink),
      options_(options),
      compressor_(options.compression, options.zstd_level),
      chunk_indexes_(sink.folder()) {
  append(record_, Header{options.profile, options.library});
  record_.insert(0, kMagic);
  status_ = emit(record_);
}

Result FileBody::record(std::string_view bytes) { return emit(bytes); }

Result FileBody::emit(std::string_view bytes) { return emit(bytes, crc32(0, bytes)); }

Result FileBody::emit(std::string_view bytes, std::uint32_t crc_of_bytes) {
  if (!status_) return status_;
  crc_ = crc32_join(crc_, crc_of_bytes, bytes.size());
  position_.store(position() + bytes.size(), std::memory_order_relaxed);
  return status_ = sink_.write(bytes);
}

Result FileBody::chunk(ChunkBuffer& closed) {
  if (!status_) return status_;
  const auto compressed = compressor_.run(closed.records);
  if (!compressed) return status_ = tl::unexpected(compressed.error());
  const std::uint32_t crc = crc32(0, closed.records);
  const Chunk head{closed.start_time,
                   closed.end_time,
                   closed.records.size(),
                   crc,
                   std::string(wire_name(options_.compression)),
                   *compressed};
  ChunkIndex index{.message_start_time = closed.start_time,
                   .message_end_time = closed.end_time,
                   .chunk_start_offset = position(),
                   .chunk_length = 0,
                   .message_index_offsets = {},
                   .message_index_length = 0,
                   .compression = head.compression,
                   .compressed_size = compressed->size(),
                   .uncompressed_size = closed.records.size()};
  record_.clear();
  append_head(record_, head);
  if (auto done = emit(record_); !done) return done;
  const bool as_is = options_.compression == Compression::none;
  if (auto done = emit(*compressed, as_is ? crc : crc32(0, *compressed)); !done) return done;
  index.chunk_length = position() - index.chunk_start_offset;

  record_.clear();
  for (std::size_t id = 0; id < closed.messages.size(); ++id) {
    MessageIndex& messages = closed.messages[id];
    if (messages.records.empty()) continue;
    messages.channel_id = static_cast<std::uint16_t>(id);
    index.message_index_offsets[messages.channel_id] = position() + record_.size();
    append(record_, messages);
  }
  index.message_index_length = record_.size();
  if (auto done = emit(record_); !done) return done;
  record_.clear();
  append(record_, index);
  chunk_indexes_.append(record_);
  return status_;
}

Result FileBody::attachment(const Attachment& attachment) {
  AttachmentIndex index{position(),
                        0,
                        attachment.log_time,
                        attachment.create_time,
                        attachment.data.size(),
                        attachment.name,
                        attachment.media_type};
  record_.clear();
  append_head(record_, attachment);
  const std::uint32_t head_crc = crc32(0, std::string_view(record_).substr(kRecordHead));
  const std::uint32_t data_crc = crc32(0, attachment.data);
  const std::uint32_t crc = crc32_join(head_crc, data_crc, attachment.data.size());
  if (auto done = emit(record_); !done) return done;
  if (auto done = emit(attachment.data, data_crc); !done) return done;
  if (auto done = emit({reinterpret_cast<const char*>(&crc), sizeof crc}); !done) return done;
  index.length = position() - index.offset;
  attachment_indexes_.push_back(std::move(index));
  return status_;
}

Result FileBody::metadata(const Metadata& metadata) {
  record_.clear();
  append(record_, metadata);
  metadata_indexes_.push_back({position(), record_.size(), metadata.name});
  return emit(record_);
}

Result FileBody::flush() {
  if (!status_) return status_;
  return status_ = sink_.flush();
}

Result FileBody::sync() {
  if (!status_) return status_;
  return status_ = sink_.sync();
}

Result FileBody::finish(const std::vector<Schema>& schemas, const std::vector<Channel>& channels,
                        const Statistics& statistics) {
  record_.clear();
  append(record_, DataEnd{crc_});
  if (auto done = emit(record_); !done) return done;
  if (auto done = write_summary(schemas, channels, statistics); !done) return done;
  return status_ = sink_.close();
}

Result FileBody::write_summary(const std::vector<Schema>& schemas,
                               const std::vector<Channel>& channels, const Statistics& statistics) {
  crc_ = 0;
  const std::uint64_t start = position();
  std::vector<SummaryOffset> groups;
  const auto group = [&](Opcode opcode, bool wanted, const auto& records) {
    if (!wanted || records.empty()) return;
    record_.clear();
    for (const auto& r : records) append(record_, r);
    groups.push_back({opcode, position(), record_.size()});
    static_cast<void>(emit(record_));  // status_ keeps a failure
  };
  // The order of the reference writer.
  group(Opcode::schema, options_.repeat_schemas, schemas);
  group(Opcode::channel, options_.repeat_channels, channels);
  group(Opcode::statistics, options_.statistics, std::vector{statistics});
  group(Opcode::metadata_index, options_.metadata_index, metadata_indexes_);
  group(Opcode::attachment_index, options_.attachment_index, attachment_indexes_);
  if (options_.chunk_index && chunk_indexes_.size() > 0) {
    groups.push_back({Opcode::chunk_index, position(), chunk_indexes_.size()});
    const Result done = chunk_indexes_.read([this](std::string_view piece) { return emit(piece); });
    if (status_ && !done) status_ = done;
  }

  Footer footer{};
  if (position() > start) footer.summary_start = start;
  record_.clear();
  if (options_.summary_offsets && !groups.empty()) {
    footer.summary_offset_start = position();
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
