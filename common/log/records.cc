#include "common/log/records.h"

#include <algorithm>

#include "common/log/crc32.h"
#include "common/log/wire.h"

namespace mimesis::log {
namespace {

/// Writes opcode and length around what is appended during its life; `beyond` bytes follow later.
class Frame {
 public:
  Frame(std::string& out, Opcode opcode, std::uint64_t beyond = 0)
      : out_(out), start_(out.size()), beyond_(beyond) {
    out_.push_back(static_cast<char>(opcode));
    out_.append(8, '\0');
  }
  ~Frame() {
    const std::uint64_t length = out_.size() - start_ - kRecordHead + beyond_;
    std::memcpy(out_.data() + start_ + 1, &length, sizeof length);
  }
  Frame(const Frame&) = delete;
  Frame& operator=(const Frame&) = delete;

 private:
  std::string& out_;
  std::size_t start_;
  std::uint64_t beyond_;
};

/// A map or array: its size in bytes, then the elements that `body` appends.
template <class Body>
void sized(std::string& out, Body body) {
  const std::size_t start = out.size();
  out.append(4, '\0');
  body();
  const auto bytes = static_cast<std::uint32_t>(out.size() - start - 4);
  std::memcpy(out.data() + start, &bytes, sizeof bytes);
}

void append_strings(std::string& out, const std::map<std::string, std::string>& map) {
  sized(out, [&] {
    Encoder e(out);
    for (const auto& [key, value] : map) {
      e.string(key);
      e.string(value);
    }
  });
}

void append_numbers(std::string& out, const std::map<std::uint16_t, std::uint64_t>& map) {
  sized(out, [&] {
    Encoder e(out);
    for (const auto& [key, value] : map) {
      e.integer(key);
      e.integer(value);
    }
  });
}

bool decode_strings(Decoder& d, std::map<std::string, std::string>& map) {
  Decoder elements(d.string());
  while (elements.left() > 0 && elements.ok()) {
    std::string key(elements.string());
    map.insert_or_assign(std::move(key), std::string(elements.string()));
  }
  return d.ok() && elements.ok();
}

bool decode_numbers(Decoder& d, std::map<std::uint16_t, std::uint64_t>& map) {
  Decoder elements(d.string());
  while (elements.left() > 0 && elements.ok()) {
    const auto key = elements.integer<std::uint16_t>();
    map.insert_or_assign(key, elements.integer<std::uint64_t>());
  }
  return d.ok() && elements.ok();
}

}  // namespace

void Statistics::count(std::uint16_t channel_id, std::uint64_t log_time) {
  count(log_time);
  ++channel_message_counts[channel_id];
}

void Statistics::count(std::uint64_t log_time) {
  message_start_time = message_count == 0 ? log_time : std::min(message_start_time, log_time);
  message_end_time = std::max(message_end_time, log_time);
  ++message_count;
}

void append(std::string& out, const Header& r) {
  const Frame frame(out, Opcode::header);
  Encoder e(out);
  e.string(r.profile);
  e.string(r.library);
}

void append(std::string& out, const Schema& r) {
  const Frame frame(out, Opcode::schema);
  Encoder e(out);
  e.integer(r.id);
  e.string(r.name);
  e.string(r.encoding);
  e.string(r.data);
}

void append(std::string& out, const Channel& r) {
  const Frame frame(out, Opcode::channel);
  Encoder e(out);
  e.integer(r.id);
  e.integer(r.schema_id);
  e.string(r.topic);
  e.string(r.message_encoding);
  append_strings(out, r.metadata);
}

void append(std::string& out, const Message& r) {
  // The one that is written millions of times: its head in one piece.
  char head[kRecordHead + kMessageHead];
  char* at = head;
  const auto put = [&at](auto value) {
    std::memcpy(at, &value, sizeof value);
    at += sizeof value;
  };
  put(Opcode::message);
  put(std::uint64_t{kMessageHead + r.data.size()});
  put(r.channel_id);
  put(r.sequence);
  put(r.log_time);
  put(r.publish_time);
  out.append(head, sizeof head);
  out.append(r.data);
}

void append_head(std::string& out, const Chunk& r) {
  const Frame frame(out, Opcode::chunk, r.records.size());
  Encoder e(out);
  e.integer(r.message_start_time);
  e.integer(r.message_end_time);
  e.integer(r.uncompressed_size);
  e.integer(r.uncompressed_crc);
  e.string(r.compression);
  e.integer(std::uint64_t{r.records.size()});
}

void append(std::string& out, const MessageIndex& r) {
  const Frame frame(out, Opcode::message_index);
  Encoder e(out);
  e.integer(r.channel_id);
  sized(out, [&] {
    for (const auto& [time, offset] : r.records) {
      e.integer(time);
      e.integer(offset);
    }
  });
}

void append(std::string& out, const ChunkIndex& r) {
  const Frame frame(out, Opcode::chunk_index);
  Encoder e(out);
  e.integer(r.message_start_time);
  e.integer(r.message_end_time);
  e.integer(r.chunk_start_offset);
  e.integer(r.chunk_length);
  append_numbers(out, r.message_index_offsets);
  e.integer(r.message_index_length);
  e.string(r.compression);
  e.integer(r.compressed_size);
  e.integer(r.uncompressed_size);
}

void append_head(std::string& out, const Attachment& r) {
  const Frame frame(out, Opcode::attachment, r.data.size() + sizeof r.crc);
  Encoder e(out);
  e.integer(r.log_time);
  e.integer(r.create_time);
  e.string(r.name);
  e.string(r.media_type);
  e.integer(std::uint64_t{r.data.size()});
}

void append(std::string& out, const AttachmentIndex& r) {
  const Frame frame(out, Opcode::attachment_index);
  Encoder e(out);
  e.integer(r.offset);
  e.integer(r.length);
  e.integer(r.log_time);
  e.integer(r.create_time);
  e.integer(r.data_size);
  e.string(r.name);
  e.string(r.media_type);
}

void append(std::string& out, const Statistics& r) {
  const Frame frame(out, Opcode::statistics);
  Encoder e(out);
  e.integer(r.message_count);
  e.integer(r.schema_count);
  e.integer(r.channel_count);
  e.integer(r.attachment_count);
  e.integer(r.metadata_count);
  e.integer(r.chunk_count);
  e.integer(r.message_start_time);
  e.integer(r.message_end_time);
  append_numbers(out, r.channel_message_counts);
}

void append(std::string& out, const Metadata& r) {
  const Frame frame(out, Opcode::metadata);
  Encoder(out).string(r.name);
  append_strings(out, r.metadata);
}

void append(std::string& out, const MetadataIndex& r) {
  const Frame frame(out, Opcode::metadata_index);
  Encoder e(out);
  e.integer(r.offset);
  e.integer(r.length);
  e.string(r.name);
}

void append(std::string& out, const SummaryOffset& r) {
  const Frame frame(out, Opcode::summary_offset);
  Encoder e(out);
  e.integer(r.group_opcode);
  e.integer(r.group_start);
  e.integer(r.group_length);
}

void append(std::string& out, const DataEnd& r) {
  const Frame frame(out, Opcode::data_end);
  Encoder(out).integer(r.data_section_crc);
}

void append(std::string& out, const Footer& r) {
  const Frame frame(out, Opcode::footer);
  Encoder e(out);
  e.integer(r.summary_start);
  e.integer(r.summary_offset_start);
  e.integer(r.summary_crc);
}

bool decode(std::string_view content, Header& r) {
  Decoder d(content);
  r.profile = d.string();
  r.library = d.string();
  return d.ok();
}

bool decode(std::string_view content, Schema& r) {
  Decoder d(content);
  r.id = d.integer<std::uint16_t>();
  r.name = d.string();
  r.encoding = d.string();
  r.data = d.string();
  return d.ok();
}

bool decode(std::string_view content, Channel& r) {
  Decoder d(content);
  r.id = d.integer<std::uint16_t>();
  r.schema_id = d.integer<std::uint16_t>();
  r.topic = d.string();
  r.message_encoding = d.string();
  r.metadata.clear();
  return decode_strings(d, r.metadata);
}

bool decode(std::string_view content, Message& r) {
  Decoder d(content);
  r.channel_id = d.integer<std::uint16_t>();
  r.sequence = d.integer<std::uint32_t>();
  r.log_time = d.integer<std::uint64_t>();
  r.publish_time = d.integer<std::uint64_t>();
  r.data = d.rest();
  return d.ok();
}

bool decode(std::string_view content, Chunk& r) {
  Decoder d(content);
  r.message_start_time = d.integer<std::uint64_t>();
  r.message_end_time = d.integer<std::uint64_t>();
  r.uncompressed_size = d.integer<std::uint64_t>();
  r.uncompressed_crc = d.integer<std::uint32_t>();
  r.compression = d.string();
  r.records = d.raw(d.integer<std::uint64_t>());
  return d.ok();
}

bool decode(std::string_view content, ChunkIndex& r) {
  Decoder d(content);
  r.message_start_time = d.integer<std::uint64_t>();
  r.message_end_time = d.integer<std::uint64_t>();
  r.chunk_start_offset = d.integer<std::uint64_t>();
  r.chunk_length = d.integer<std::uint64_t>();
  r.message_index_offsets.clear();
  const bool map_ok = decode_numbers(d, r.message_index_offsets);
  r.message_index_length = d.integer<std::uint64_t>();
  r.compression = d.string();
  r.compressed_size = d.integer<std::uint64_t>();
  r.uncompressed_size = d.integer<std::uint64_t>();
  return map_ok && d.ok();
}

bool decode(std::string_view content, Attachment& r) {
  Decoder d(content);
  r.log_time = d.integer<std::uint64_t>();
  r.create_time = d.integer<std::uint64_t>();
  r.name = d.string();
  r.media_type = d.string();
  r.data = d.raw(d.integer<std::uint64_t>());
  const std::size_t covered = content.size() - d.left();
  r.crc = d.integer<std::uint32_t>();
  if (!d.ok()) return false;
  r.crc_valid = r.crc == 0 || r.crc == crc32(0, content.substr(0, covered));
  return true;
}

bool decode(std::string_view content, AttachmentIndex& r) {
  Decoder d(content);
  r.offset = d.integer<std::uint64_t>();
  r.length = d.integer<std::uint64_t>();
  r.log_time = d.integer<std::uint64_t>();
  r.create_time = d.integer<std::uint64_t>();
  r.data_size = d.integer<std::uint64_t>();
  r.name = d.string();
  r.media_type = d.string();
  return d.ok();
}

bool decode(std::string_view content, Statistics& r) {
  Decoder d(content);
  r.message_count = d.integer<std::uint64_t>();
  r.schema_count = d.integer<std::uint16_t>();
  r.channel_count = d.integer<std::uint32_t>();
  r.attachment_count = d.integer<std::uint32_t>();
  r.metadata_count = d.integer<std::uint32_t>();
  r.chunk_count = d.integer<std::uint32_t>();
  r.message_start_time = d.integer<std::uint64_t>();
  r.message_end_time = d.integer<std::uint64_t>();
  r.channel_message_counts.clear();
  return decode_numbers(d, r.channel_message_counts);
}

bool decode(std::string_view content, Metadata& r) {
  Decoder d(content);
  r.name = d.string();
  r.metadata.clear();
  return decode_strings(d, r.metadata);
}

bool decode(std::string_view content, MetadataIndex& r) {
  Decoder d(content);
  r.offset = d.integer<std::uint64_t>();
  r.length = d.integer<std::uint64_t>();
  r.name = d.string();
  return d.ok();
}

bool decode(std::string_view content, SummaryOffset& r) {
  Decoder d(content);
  r.group_opcode = d.integer<Opcode>();
  r.group_start = d.integer<std::uint64_t>();
  r.group_length = d.integer<std::uint64_t>();
  return d.ok();
}

bool decode(std::string_view content, DataEnd& r) {
  Decoder d(content);
  r.data_section_crc = d.integer<std::uint32_t>();
  return d.ok() && d.left() == 0;
}

bool decode(std::string_view content, Footer& r) {
  Decoder d(content);
  r.summary_start = d.integer<std::uint64_t>();
  r.summary_offset_start = d.integer<std::uint64_t>();
  r.summary_crc = d.integer<std::uint32_t>();
  return d.ok() && d.left() == 0;
}

std::string_view name(Opcode opcode) {
  static constexpr std::string_view kNames[] = {
      "Invalid",  "Header",        "Footer",        "Schema",     "Channel",         "Message",
      "Chunk",    "MessageIndex",  "ChunkIndex",    "Attachment", "AttachmentIndex", "Statistics",
      "Metadata", "MetadataIndex", "SummaryOffset", "DataEnd"};
  const auto index = static_cast<std::size_t>(opcode);
  return index < std::size(kNames) ? kNames[index] : "unknown record";
}

}  // namespace mimesis::log
