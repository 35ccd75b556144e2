#include "common/log/records.h"

#include <algorithm>
#include <set>

#include "common/log/codec.h"
#include "common/log/wire.h"

namespace mimesis::log {

void Statistics::count(std::uint16_t channel_id, std::uint64_t log_time) {
  count(log_time);
  ++channel_message_counts[channel_id];
}

void Statistics::count(std::uint64_t log_time) {
  message_start_time = message_count == 0 ? log_time : std::min(message_start_time, log_time);
  message_end_time = std::max(message_end_time, log_time);
  ++message_count;
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
  const RecordFrame frame(out, static_cast<char>(Opcode::chunk), r.records.size());
  Layout<Chunk>::append(out, r);
  put(out, std::uint64_t{r.records.size()});
}

void append_head(std::string& out, const Attachment& r) {
  const RecordFrame frame(out, static_cast<char>(Opcode::attachment), r.data.size() + sizeof r.crc);
  Layout<Attachment>::append(out, r);
  put(out, std::uint64_t{r.data.size()});
}

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
  Decoder d(content);
  return Layout<DataEnd>::decode(d, r) && d.left() == 0;
}

bool decode(std::string_view content, Footer& r) {
  Decoder d(content);
  return Layout<Footer>::decode(d, r) && d.left() == 0;
}

std::string_view name(Opcode opcode) {
  static constexpr std::string_view kNames[] = {
      "Invalid",  "Header",        "Footer",        "Schema",     "Channel",         "Message",
      "Chunk",    "MessageIndex",  "ChunkIndex",    "Attachment", "AttachmentIndex", "Statistics",
      "Metadata", "MetadataIndex", "SummaryOffset", "DataEnd"};
  const auto index = static_cast<std::size_t>(opcode);
  return index < std::size(kNames) ? kNames[index] : "unknown record";
}

Salvage salvage(std::string_view records, const Chunk& head,
                const std::map<std::uint16_t, Channel>& known) {
  std::set<std::uint16_t> defined;
  const auto possible = [&](Opcode opcode, std::string_view content) {
    Schema schema;
    Channel channel;
    Message message;
    switch (opcode) {
      case Opcode::schema:
        return decode(content, schema) && schema.id != 0;
      case Opcode::channel:
        if (!decode(content, channel)) return false;
        defined.insert(channel.id);
        return true;
      case Opcode::message:
        return decode(content, message) && message.log_time >= head.message_start_time &&
               message.log_time <= head.message_end_time &&
               (known.contains(message.channel_id) || defined.contains(message.channel_id));
      default:
        return false;
    }
  };
  Salvage saved;
  Decoder d(records);
  while (d.left() > 0) {
    const auto opcode = d.integer<Opcode>();
    const std::string_view content = d.raw(d.integer<std::uint64_t>());
    if (!d.ok() || !possible(opcode, content)) break;
    saved.bytes = records.size() - d.left();
    saved.messages += opcode == Opcode::message;
  }
  return saved;
}

std::size_t without_zeros(std::string_view bytes) { return bytes.find_last_not_of('\0') + 1; }

}  // namespace mimesis::log
