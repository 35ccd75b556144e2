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
namespace mimesis::log {

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::size_t kRecordHead = 9;                     ///< opcode and length
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

/// Appends a whole record.
void append(std::string& out, const Header& r);
void append(std::string& out, const Schema& r);
void append(std::string& out, const Channel& r);
void append(std::string& out, const Message& r);
void append(std::string& out, const MessageIndex& r);
void append(std::string& out, const ChunkIndex& r);
void append(std::string& out, const AttachmentIndex& r);
void append(std::string& out, const Statistics& r);
void append(std::string& out, const Metadata& r);
void append(std::string& out, const MetadataIndex& r);
void append(std::string& out, const SummaryOffset& r);
void append(std::string& out, const DataEnd& r);
void append(std::string& out, const Footer& r);
/// The two with a large payload: everything up to it; for an attachment its CRC goes after the
/// data.
void append_head(std::string& out, const Chunk& r);
void append_head(std::string& out, const Attachment& r);

/// Decodes the content of a record; views point into `content`. False if it is too short for its
/// fields. Bytes behind the known fields are skipped: later versions of the format append fields.
bool decode(std::string_view content, Header& r);
bool decode(std::string_view content, Schema& r);
bool decode(std::string_view content, Channel& r);
bool decode(std::string_view content, Message& r);
bool decode(std::string_view content, Chunk& r);
/// The fields before its records; `r.records`: all behind them, `size`: how many of these bytes
/// they should be.
bool decode_head(std::string_view content, Chunk& r, std::uint64_t& size);
bool decode(std::string_view content, ChunkIndex& r);
bool decode(std::string_view content, Attachment& r);
bool decode(std::string_view content, AttachmentIndex& r);
bool decode(std::string_view content, Statistics& r);
bool decode(std::string_view content, Metadata& r);
bool decode(std::string_view content, MetadataIndex& r);
bool decode(std::string_view content, SummaryOffset& r);
bool decode(std::string_view content, DataEnd& r);
bool decode(std::string_view content, Footer& r);

/// "Chunk", for reports.
std::string_view name(Opcode opcode);

}  // namespace mimesis::log
