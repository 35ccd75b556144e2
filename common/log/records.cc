#include "common/log/records.h"

#include <algorithm>

#include "common/log/crc32.h"
#include "common/log/wire.h"

namespace mimesis::log {
namespace {

/// Writes opcode and length around the data appended during its life; `beyond` bytes follow later.
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

// --- Values on the wire: integers, strings, maps and lists of pairs

template <class T>
void put(std::string& out, const T& value) {
  if constexpr (requires {
                  value.size();
                  value.substr(0);
                }) {
    Encoder(out).string(value);
  } else if constexpr (requires { value.begin(); }) {
    sized(out, [&] {
      for (const auto& [first, second] : value) {
        put(out, first);
        put(out, second);
      }
    });
  } else {
    Encoder(out).integer(value);
  }
}

/// False if the value does not end where it should.
template <class T>
bool take(Decoder& d, T& value) {
  if constexpr (requires { value.substr(0); }) {
    value = d.string();
  } else if constexpr (requires { value.clear(); }) {
    value.clear();
    Decoder elements(d.string());
    while (elements.left() > 0 && elements.ok()) {
      typename T::key_type key;
      take(elements, key);
      take(elements, value[key]);
    }
    return elements.ok();
  } else {
    value = d.integer<T>();
  }
  return true;
}

// --- Records: their fields in the order of the file

template <class T>
struct Layout;
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

template <class T>
void append_record(std::string& out, const T& r) {
  const Frame frame(out, Layout<T>::kOpcode);
  Layout<T>::append(out, r);
}

template <class T>
bool decode_record(std::string_view content, T& r) {
  Decoder d(content);
  return Layout<T>::decode(d, r);
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

void append(std::string& out, const Header& r) { append_record(out, r); }
void append(std::string& out, const Schema& r) { append_record(out, r); }
void append(std::string& out, const Channel& r) { append_record(out, r); }
void append(std::string& out, const MessageIndex& r) { append_record(out, r); }
void append(std::string& out, const ChunkIndex& r) { append_record(out, r); }
void append(std::string& out, const AttachmentIndex& r) { append_record(out, r); }
void append(std::string& out, const Statistics& r) { append_record(out, r); }
void append(std::string& out, const Metadata& r) { append_record(out, r); }
void append(std::string& out, const MetadataIndex& r) { append_record(out, r); }
void append(std::string& out, const SummaryOffset& r) { append_record(out, r); }
void append(std::string& out, const DataEnd& r) { append_record(out, r); }
void append(std::string& out, const Footer& r) { append_record(out, r); }

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
  Layout<Chunk>::append(out, r);
  put(out, std::uint64_t{r.records.size()});
}

void append_head(std::string& out, const Attachment& r) {
  const Frame frame(out, Opcode::attachment, r.data.size() + sizeof r.crc);
  Layout<Attachment>::append(out, r);
  put(out, std::uint64_t{r.data.size()});
}

bool decode(std::string_view content, Header& r) { return decode_record(content, r); }
bool decode(std::string_view content, Schema& r) { return decode_record(content, r); }
bool decode(std::string_view content, Channel& r) { return decode_record(content, r); }
bool decode(std::string_view content, ChunkIndex& r) { return decode_record(content, r); }
bool decode(std::string_view content, AttachmentIndex& r) { return decode_record(content, r); }
bool decode(std::string_view content, Statistics& r) { return decode_record(content, r); }
bool decode(std::string_view content, Metadata& r) { return decode_record(content, r); }
bool decode(std::string_view content, MetadataIndex& r) { return decode_record(content, r); }
bool decode(std::string_view content, SummaryOffset& r) { return decode_record(content, r); }

bool decode(std::string_view content, Message& r) {
  Decoder d(content);
  const bool ok = Layout<Message>::decode(d, r);
  r.data = d.rest();
  return ok;
}

bool decode_head(std::string_view content, Chunk& r, std::uint64_t& size) {
  Decoder d(content);
  Layout<Chunk>::decode(d, r);
  size = d.integer<std::uint64_t>();
  r.records = d.rest();
  return d.ok();
}

bool decode(std::string_view content, Chunk& r) {
  std::uint64_t size = 0;
  if (!decode_head(content, r, size) || size > r.records.size()) return false;
  r.records = r.records.substr(0, static_cast<std::size_t>(size));
  return true;
}

bool decode(std::string_view content, Attachment& r) {
  Decoder d(content);
  Layout<Attachment>::decode(d, r);
  r.data = d.raw(d.integer<std::uint64_t>());
  const std::size_t covered = content.size() - d.left();
  r.crc = d.integer<std::uint32_t>();
  if (!d.ok()) return false;
  r.crc_valid = r.crc == 0 || r.crc == crc32(0, content.substr(0, covered));
  return true;
}

bool decode(std::string_view content, DataEnd& r) {
  return decode_record(content, r) && content.size() == sizeof r.data_section_crc;
}

bool decode(std::string_view content, Footer& r) {
  return decode_record(content, r) && content.size() == 8 + 8 + 4;
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
