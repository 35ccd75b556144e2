#include "common/log/summary.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/log/codec.h"
#include "common/log/wire.h"

namespace mimesis::log {
namespace {

constexpr std::uint64_t kBareRun = 1024 * 1024;  // bytes of messages outside chunks read at once
constexpr std::uint64_t kLargestSummary = 1ull << 30;

std::optional<std::string> read_all(const Source& source, std::uint64_t offset,
                                    std::uint64_t size) {
  if (offset > source.size() || size > source.size() - offset || size > kLargestSummary)
    return std::nullopt;
  std::string bytes(static_cast<std::size_t>(size), '\0');
  const auto n = source.read(offset, bytes.data(), bytes.size());
  if (!n || *n != bytes.size()) return std::nullopt;
  return bytes;
}

template <class T>
bool add(std::string_view content, std::vector<T>& records) {
  return decode(content, records.emplace_back());
}
template <class T>
bool add(std::string_view content, std::map<std::uint16_t, T>& records) {
  T record;
  const bool ok = decode(content, record);
  records.insert_or_assign(record.id, std::move(record));
  return ok;
}

bool add_record(Opcode opcode, std::string_view content, Summary& summary) {
  switch (opcode) {
    case Opcode::schema:
      return add(content, summary.schemas);
    case Opcode::channel:
      return add(content, summary.channels);
    case Opcode::statistics:
      return decode(content, summary.statistics);
    case Opcode::attachment_index:
      return add(content, summary.attachments);
    case Opcode::metadata_index:
      return add(content, summary.metadata);
    case Opcode::chunk_index:
      return decode(content, summary.segments.emplace_back().index);
    default:
      return true;
  }
}

/// The file's own summary, if it is whole and lets all messages be found.
std::optional<Summary> own_summary(const Source& source) {
  if (source.size() < kMagic.size() + kFooterSize) return std::nullopt;
  const std::uint64_t footer_at = source.size() - kFooterSize;
  const auto end = read_all(source, footer_at, kFooterSize);
  if (!end || !end->ends_with(kMagic) || static_cast<Opcode>(end->front()) != Opcode::footer) {
    return std::nullopt;
  }
  Footer footer;
  if (!decode(std::string_view(*end).substr(kRecordHead, 20), footer)) return std::nullopt;
  if (footer.summary_start == 0 || footer.summary_start > footer_at) return std::nullopt;
  const auto bytes = read_all(source, footer.summary_start, footer_at - footer.summary_start);
  if (!bytes) return std::nullopt;
  const std::uint32_t crc =
      crc32(crc32(0, *bytes), std::string_view(*end).substr(0, kRecordHead + 16));
  if (footer.summary_crc != 0 && footer.summary_crc != crc) return std::nullopt;

  Summary summary;
  bool has_statistics = false;
  Decoder d(*bytes);
  while (d.left() > 0) {
    const auto opcode = d.integer<Opcode>();
    const std::string_view content = d.raw(d.integer<std::uint64_t>());
    if (!d.ok() || !add_record(opcode, content, summary)) return std::nullopt;
    has_statistics |= opcode == Opcode::statistics;
  }
  // Where the index may have gaps the data has to be asked.
  const Statistics& s = summary.statistics;
  summary.counted = has_statistics;
  const bool whole = has_statistics ? summary.segments.size() == s.chunk_count &&
                                          (s.message_count == 0 || s.chunk_count > 0) &&
                                          summary.channels.size() == s.channel_count &&
                                          summary.schemas.size() == s.schema_count &&
                                          summary.attachments.size() == s.attachment_count &&
                                          summary.metadata.size() == s.metadata_count
                                    : !summary.segments.empty() && !summary.channels.empty();
  if (!whole) return std::nullopt;
  const auto head = read_all(source, kMagic.size(), kRecordHead);
  if (!head) return std::nullopt;
  Decoder h(*head);
  if (h.integer<Opcode>() != Opcode::header) return std::nullopt;
  const auto header = read_all(source, kMagic.size() + kRecordHead, h.integer<std::uint64_t>());
  if (!header || !decode(*header, summary.header)) return std::nullopt;
  std::ranges::sort(summary.segments, {},
                    [](const Segment& a) { return a.index.chunk_start_offset; });
  summary.from_file = true;
  summary.start = footer.summary_start;
  return summary;
}

/// Extends the last segment by the message just read, or begins a new one.
void add_message(const StreamReader& reader, const Message& message, Summary& summary) {
  summary.statistics.count(message.channel_id, message.log_time);
  const Chunk* chunk = reader.chunk();
  Segment* last = summary.segments.empty() ? nullptr : &summary.segments.back();
  const std::uint64_t last_end =
      last ? last->index.chunk_start_offset + last->index.chunk_length : 0;
  const bool same_chunk = last && chunk && last->index.chunk_start_offset == reader.offset();
  const bool same_run = last && !chunk && last->bare && last_end == reader.offset() &&
                        last->index.chunk_length < kBareRun;
  if (!same_chunk && !same_run) {
    last = &summary.segments.emplace_back();
    last->bare = chunk == nullptr;
    last->index.chunk_start_offset = reader.offset();
    last->index.message_start_time = last->index.message_end_time = message.log_time;
    if (chunk) {
      ++summary.statistics.chunk_count;
      last->index.compression = chunk->compression;
      last->index.compressed_size = reader.length() - kRecordHead - 40 - chunk->compression.size();
      last->index.uncompressed_size = chunk->uncompressed_size;
      last->index.chunk_length = reader.length();
      last->salvaged = reader.salvaged();
    }
  }
  if (!chunk) {
    last->index.chunk_length += reader.length();
    last->index.compressed_size = last->index.uncompressed_size = last->index.chunk_length;
  }
  last->index.message_start_time = std::min(last->index.message_start_time, message.log_time);
  last->index.message_end_time = std::max(last->index.message_end_time, message.log_time);
}

}  // namespace

tl::expected<Summary, Status> scan(const Source& source, const ReaderLimits& limits) {
  Summary summary;
  StreamReader reader(source, limits);
  bool any = false;
  while (const Record* record = reader.next()) {
    any = true;
    if (const auto* message = std::get_if<Message>(record)) {
      add_message(reader, *message, summary);
    } else if (const auto* header = std::get_if<Header>(record)) {
      summary.header = *header;
    } else if (const auto* a = std::get_if<Attachment>(record)) {
      summary.attachments.push_back({reader.offset(), reader.length(), a->log_time, a->create_time,
                                     a->data.size(), a->name, a->media_type});
    } else if (const auto* metadata = std::get_if<Metadata>(record)) {
      summary.metadata.push_back({reader.offset(), reader.length(), metadata->name});
    }
  }
  if (!any) {
    const auto& why = reader.damages();
    return tl::unexpected(
        Status{why.empty() ? "not an MCAP log" : "not an MCAP log: " + why.front().what});
  }
  if (const auto& twice = reader.redefined()) {
    return tl::unexpected(Status{fmt::format(
        "byte {}: {} is defined a second time, differently: `mimesis log recover` takes both apart",
        twice->offset, twice->what)});
  }
  summary.schemas = reader.schemas();
  summary.channels = reader.channels();
  summary.statistics.schema_count = static_cast<std::uint16_t>(summary.schemas.size());
  summary.statistics.channel_count = static_cast<std::uint32_t>(summary.channels.size());
  summary.statistics.attachment_count = static_cast<std::uint32_t>(summary.attachments.size());
  summary.statistics.metadata_count = static_cast<std::uint32_t>(summary.metadata.size());
  summary.damages = reader.damages();
  summary.damage_count = reader.damage_count();
  return summary;
}

tl::expected<Summary, Status> summarize(const Source& source, const ReaderLimits& limits) {
  if (auto summary = own_summary(source)) return std::move(*summary);
  return scan(source, limits);
}

std::optional<Damage> check_data_sum(const Source& source, const Summary& summary) {
  constexpr std::uint64_t kEndRecord = kRecordHead + sizeof(std::uint32_t), kAtOnce = 256 * 1024;
  const std::uint64_t end = summary.start - std::min(summary.start, kEndRecord);
  const auto record = read_all(source, end, kEndRecord);
  Decoder d(record ? std::string_view(*record) : std::string_view());
  DataEnd says;
  if (d.integer<Opcode>() != Opcode::data_end || !decode(d.raw(d.integer<std::uint64_t>()), says) ||
      !d.ok()) {
    return Damage{end, "no end of the data stands before the summary"};
  }
  if (says.data_section_crc == 0) return std::nullopt;  // its writer made no sum
  Window window(source);
  std::uint32_t crc = 0;
  for (std::uint64_t at = 0; at < end;) {
    const auto part = window.view(at, static_cast<std::size_t>(std::min(end - at, kAtOnce)));
    if (!part || part->empty()) {
      return Damage{at, part ? "the file became shorter while it was read" : part.error().reason};
    }
    crc = crc32(crc, *part);
    at += part->size();
  }
  if (crc == says.data_section_crc) return std::nullopt;
  return Damage{end, fmt::format("data section: CRC-32 is {:08x}, the file says {:08x}", crc,
                                 says.data_section_crc)};
}

tl::expected<Attachment, Status> read_attachment(const Source& source, const AttachmentIndex& index,
                                                 std::string& data) {
  const auto bytes = read_all(source, index.offset, index.length);
  Attachment attachment;
  if (!bytes || bytes->size() < kRecordHead ||
      static_cast<Opcode>(bytes->front()) != Opcode::attachment ||
      !decode(std::string_view(*bytes).substr(kRecordHead), attachment)) {
    return tl::unexpected(
        Status{fmt::format("offset {}: attachment '{}' cannot be read", index.offset, index.name)});
  }
  if (!attachment.crc_valid) {
    return tl::unexpected(Status{fmt::format("offset {}: attachment '{}': its CRC-32 does not fit",
                                             index.offset, index.name)});
  }
  data.assign(attachment.data);
  attachment.data = data;
  return attachment;
}

tl::expected<Metadata, Status> read_metadata(const Source& source, const MetadataIndex& index) {
  const auto bytes = read_all(source, index.offset, index.length);
  Metadata metadata;
  if (!bytes || bytes->size() < kRecordHead ||
      static_cast<Opcode>(bytes->front()) != Opcode::metadata ||
      !decode(std::string_view(*bytes).substr(kRecordHead), metadata)) {
    return tl::unexpected(
        Status{fmt::format("offset {}: metadata '{}' cannot be read", index.offset, index.name)});
  }
  return metadata;
}

}  // namespace mimesis::log
