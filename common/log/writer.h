#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/log/codec.h"
#include "common/log/io.h"
#include "common/log/records.h"

namespace mimesis::log {

struct WriterOptions {
  std::string profile = {};         ///< "" unless the file follows a published profile
  std::string library = "mimesis";  ///< who wrote it
  Compression compression = Compression::zstd;
  /// A chunk is closed when its records reach this size [bytes]; 0: no chunks.
  std::size_t chunk_size = 1024 * 1024;
  // Parts of the index that readers use to seek. All are written unless a test compares single
  // ones.
  bool message_index = true, chunk_index = true, statistics = true;
  bool repeat_schemas = true, repeat_channels = true;
  bool attachment_index = true, metadata_index = true, summary_offsets = true;
};

/// Writes one MCAP file: data in chunks, then a summary that lets readers seek. Every sum the
/// format knows is written: per chunk, per attachment, over the data section and over the summary.
/// Memory is bounded by one chunk and 16 bytes per message in it, plus one index entry per chunk.
///
/// A failure to write is final: it is returned by the call that met it and by all later ones.
class Writer {
 public:
  /// Writes magic and header; a failure is returned by the next call. `sink` outlives the writer.
  Writer(Sink& sink, WriterOptions options);

  /// Ids count from 1.
  [[nodiscard]] tl::expected<std::uint16_t, Status> add_schema(std::string name,
                                                               std::string encoding,
                                                               std::string data);
  /// `schema_id`: of add_schema, or 0 for none.
  [[nodiscard]] tl::expected<std::uint16_t, Status> add_channel(
      std::uint16_t schema_id, std::string topic, std::string message_encoding,
      std::map<std::string, std::string> metadata);
  /// Precondition: the channel was added.
  [[nodiscard]] Result write(const Message& message);
  /// Closes the open chunk and hands everything to the sink: whoever is killed later leaves it
  /// readable.
  [[nodiscard]] Result flush();

  /// Attachments and metadata stand between chunks; the open one is closed first. The sum is
  /// computed.
  [[nodiscard]] Result attach(const Attachment& attachment);
  [[nodiscard]] Result add_metadata(const Metadata& metadata);

  /// Writes the summary and closes the sink. Last call.
  [[nodiscard]] Result finish();

  const Statistics& statistics() const { return statistics_; }
  std::uint64_t bytes_written() const { return position_; }
  std::size_t open_chunk_bytes() const { return chunk_.size(); }  ///< not yet handed to the sink

 private:
  bool chunked() const { return options_.chunk_size > 0; }
  /// The record stands in `record_`, or at the end of the open chunk.
  std::string& target() { return chunked() ? chunk_ : record_; }
  Result emit_unless_chunked();
  Result emit(std::string_view bytes);
  Result emit(std::string_view bytes, std::uint32_t crc_of_bytes);
  Result close_chunk();
  Result write_summary();

  Sink& sink_;
  WriterOptions options_;
  Compressor compressor_;
  Result status_;
  std::uint64_t position_ = 0;
  std::uint32_t crc_ = 0;  ///< of all bytes so far; of the summary once that has begun

  std::string record_;  ///< scratch for one record
  std::string chunk_;   ///< records of the open chunk
  std::uint64_t chunk_start_time_ = 0, chunk_end_time_ = 0;
  bool chunk_has_messages_ = false;
  std::map<std::uint16_t, MessageIndex> chunk_messages_;

  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  std::vector<ChunkIndex> chunk_indexes_;
  std::vector<AttachmentIndex> attachment_indexes_;
  std::vector<MetadataIndex> metadata_indexes_;
  Statistics statistics_;
};

}  // namespace mimesis::log
