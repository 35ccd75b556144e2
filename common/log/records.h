#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

/// The records of an MCAP file. A record on the wire: opcode (1 byte), length of the content (8),
/// content. Times are nanoseconds, offsets and lengths bytes, offsets count from the start of the
/// file.
#include "common/log/wire.h"

namespace mimesis::log {

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::size_t kMessageHead = 2 + 4 + 8 + 8;        ///< fields before its payload
inline constexpr std::size_t kFooterSize = kRecordHead + 20 + 8;  ///< with the closing magic

enum class Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  attachment = 0x09,
  attachment_index = 0x0A,
  statistics = 0x0B,
  metadata = 0x0C,
  metadata_index = 0x0D,
  summary_offset = 0x0E,
  data_end = 0x0F,
};

struct Header {
  std::string profile, library;
};
/// Describes the payload of channels: for protobuf the full message name and a FileDescriptorSet.
struct Schema {
  std::uint16_t id = 0;  ///< from 1
  std::string name, encoding, data;
  bool operator==(const Schema&) const = default;
};
/// One topic of one publisher.
struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;  ///< 0: none
  std::string topic, message_encoding;
  std::map<std::string, std::string> metadata;
  bool operator==(const Channel&) const = default;
};
struct Message {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;      ///< the publisher's count, 0: unknown
  std::uint64_t log_time = 0;      ///< receipt by the recorder
  std::uint64_t publish_time = 0;  ///< the sender's stamp
  std::string_view data;           ///< not owned
};
/// Head of a chunk: a compressed run of Schema, Channel and Message records.
struct Chunk {
  std::uint64_t message_start_time = 0, message_end_time = 0;
  std::uint64_t uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;  ///< 0: none
  std::string compression;
  std::string_view records;  ///< compressed; not owned
};
/// Where the messages of one channel are in the chunk before it: (log_time, offset in the
/// uncompressed records).
struct MessageIndex {
  std::uint16_t channel_id = 0;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> records;
};
struct ChunkIndex {
  std::uint64_t message_start_time = 0, message_end_time = 0;
  std::uint64_t chunk_start_offset = 0;
  std::uint64_t chunk_length = 0;                                ///< whole record
  std::map<std::uint16_t, std::uint64_t> message_index_offsets;  ///< by channel; may be left out
  std::uint64_t message_index_length = 0;
  std::string compression;
  std::uint64_t compressed_size = 0, uncompressed_size = 0;
};
struct Attachment {
  std::uint64_t log_time = 0, create_time = 0;
  std::string name, media_type;
  std::string_view data;  ///< not owned
  std::uint32_t crc = 0;  ///< the stored sum; 0: none
  bool crc_valid = true;  ///< set by decode
};
struct AttachmentIndex {
  std::uint64_t offset = 0, length = 0;  ///< whole record
  std::uint64_t log_time = 0, create_time = 0, data_size = 0;
  std::string name, media_type;
};
struct Statistics {
  std::uint64_t message_count = 0;
  std::uint16_t schema_count = 0;
  std::uint32_t channel_count = 0, attachment_count = 0, metadata_count = 0, chunk_count = 0;
  std::uint64_t message_start_time = 0, message_end_time = 0;  ///< 0 without messages
  std::map<std::uint16_t, std::uint64_t> channel_message_counts;

  /// Counts one message; the second one leaves its channel's count to the caller.
  void count(std::uint16_t channel_id, std::uint64_t log_time);
  void count(std::uint64_t log_time);
};
struct Metadata {
  std::string name;
  std::map<std::string, std::string> metadata;
};
struct MetadataIndex {
  std::uint64_t offset = 0, length = 0;  ///< whole record
  std::string name;
};
/// Where the records of one kind are in the summary.
struct SummaryOffset {
  Opcode group_opcode{};
  std::uint64_t group_start = 0, group_length = 0;
};
struct DataEnd {
  std::uint32_t data_section_crc = 0;  ///< sum of all bytes before this record; 0: none
};
struct Footer {
  std::uint64_t summary_start = 0, summary_offset_start = 0;  ///< 0: there is none
  std::uint32_t summary_crc =
      0;  ///< from summary_start (or DataEnd's end) up to this field; 0: none
};

/// Records that a reader delivers. Chunks are unpacked; message indexes serve only the reader.
using Record =
    std::variant<Header, Schema, Channel, Message, Attachment, Metadata, DataEnd, Statistics,
                 MetadataIndex, AttachmentIndex, ChunkIndex, SummaryOffset, Footer>;

// --- Records: their fields in the order of the file

/// Fields of record T in the order of the file.
template <class T>
struct Layout;
/// Writes and reads them.
template <Opcode kCode, auto... kMembers>
struct Fields {
  static constexpr Opcode kOpcode = kCode;
  template <class T>
  static void append(std::string& out, const T& r) {
    (put(out, r.*kMembers), ...);
  }
  template <class T>
  static bool decode(Decoder& d, T& r) {
    bool ok = true;
    ((ok = take(d, r.*kMembers) && ok), ...);
    return ok && d.ok();
  }
};
template <>
struct Layout<Header> : Fields<Opcode::header, &Header::profile, &Header::library> {};
template <>
struct Layout<Schema>
    : Fields<Opcode::schema, &Schema::id, &Schema::name, &Schema::encoding, &Schema::data> {};
template <>
struct Layout<Channel> : Fields<Opcode::channel, &Channel::id, &Channel::schema_id, &Channel::topic,
                                &Channel::message_encoding, &Channel::metadata> {};
template <>
struct Layout<Message> : Fields<Opcode::message, &Message::channel_id, &Message::sequence,
                                &Message::log_time, &Message::publish_time> {};
template <>
struct Layout<Chunk>
    : Fields<Opcode::chunk, &Chunk::message_start_time, &Chunk::message_end_time,
             &Chunk::uncompressed_size, &Chunk::uncompressed_crc, &Chunk::compression> {};
template <>
struct Layout<MessageIndex>
    : Fields<Opcode::message_index, &MessageIndex::channel_id, &MessageIndex::records> {};
template <>
struct Layout<ChunkIndex> : Fields<Opcode::chunk_index, &ChunkIndex::message_start_time,
                                   &ChunkIndex::message_end_time, &ChunkIndex::chunk_start_offset,
                                   &ChunkIndex::chunk_length, &ChunkIndex::message_index_offsets,
                                   &ChunkIndex::message_index_length, &ChunkIndex::compression,
                                   &ChunkIndex::compressed_size, &ChunkIndex::uncompressed_size> {};
template <>
struct Layout<Attachment>
    : Fields<Opcode::attachment, &Attachment::log_time, &Attachment::create_time, &Attachment::name,
             &Attachment::media_type> {};
template <>
struct Layout<AttachmentIndex>
    : Fields<Opcode::attachment_index, &AttachmentIndex::offset, &AttachmentIndex::length,
             &AttachmentIndex::log_time, &AttachmentIndex::create_time, &AttachmentIndex::data_size,
             &AttachmentIndex::name, &AttachmentIndex::media_type> {};
template <>
struct Layout<Statistics>
    : Fields<Opcode::statistics, &Statistics::message_count, &Statistics::schema_count,
             &Statistics::channel_count, &Statistics::attachment_count, &Statistics::metadata_count,
             &Statistics::chunk_count, &Statistics::message_start_time,
             &Statistics::message_end_time, &Statistics::channel_message_counts> {};
template <>
struct Layout<Metadata> : Fields<Opcode::metadata, &Metadata::name, &Metadata::metadata> {};
template <>
struct Layout<MetadataIndex> : Fields<Opcode::metadata_index, &MetadataIndex::offset,
                                      &MetadataIndex::length, &MetadataIndex::name> {};
template <>
struct Layout<SummaryOffset> : Fields<Opcode::summary_offset, &SummaryOffset::group_opcode,
                                      &SummaryOffset::group_start, &SummaryOffset::group_length> {};
template <>
struct Layout<DataEnd> : Fields<Opcode::data_end, &DataEnd::data_section_crc> {};
template <>
struct Layout<Footer> : Fields<Opcode::footer, &Footer::summary_start,
                               &Footer::summary_offset_start, &Footer::summary_crc> {};

/// Appends a whole record.
template <class T>
void append(std::string& out, const T& r) {
  const RecordFrame frame(out, static_cast<char>(Layout<T>::kOpcode));
  Layout<T>::append(out, r);
}
void append(std::string& out, const Message& r);
/// The two with a large payload: everything up to it; for an attachment its CRC goes after the
/// data.
void append_head(std::string& out, const Chunk& r);
void append_head(std::string& out, const Attachment& r);

/// Decodes the content of a record; views point into `content`. False if it is too short for its
/// fields. Bytes behind the known fields are skipped: later versions of the format append fields.
template <class T>
bool decode(std::string_view content, T& r) {
  Decoder d(content);
  return Layout<T>::decode(d, r);
}
bool decode(std::string_view content, Message& r);
bool decode(std::string_view content, Chunk& r);
/// The fields before its records; `r.records`: all behind them, `size`: how many of these bytes
/// they should be.
bool decode_head(std::string_view content, Chunk& r, std::uint64_t& size);
bool decode(std::string_view content, Attachment& r);
bool decode(std::string_view content, DataEnd& r);
bool decode(std::string_view content, Footer& r);

/// "Chunk", for reports.
std::string_view name(Opcode opcode);

/// The usable beginning of a chunk whose sum cannot be checked.
struct Salvage {
  std::size_t bytes = 0;
  std::uint64_t messages = 0;
};

/// `records`: the readable beginning of a cut chunk. Takes records as long as they are whole and
/// possible: messages of channels that are known or defined in it, with log times within the range
/// in the chunk's head.
Salvage salvage(std::string_view records, const Chunk& head,
                const std::map<std::uint16_t, Channel>& known);

/// Size of `bytes` without the zeros at its end: they were never written before the power failed.
std::size_t without_zeros(std::string_view bytes);

}  // namespace mimesis::log
