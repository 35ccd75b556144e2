#include "common/log/stream_reader.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/log/crc32.h"
#include "common/log/resync.h"
#include "common/log/wire.h"

namespace mimesis::log {
namespace {
constexpr std::size_t kPiece = 256 * 1024;  // of what is summed without being looked at
}

StreamReader::StreamReader(const Source& source, const ReaderLimits& limits)
    : source_(source), limits_(limits), window_(source) {}

void StreamReader::damage(std::uint64_t offset, std::string what) {
  ++damage_count_;
  if (damages_.size() < limits_.damages) damages_.push_back({offset, std::move(what)});
}

std::string_view StreamReader::view(std::uint64_t offset, std::size_t size) {
  auto bytes = window_.view(offset, size);
  if (bytes) return *bytes;
  damage(offset, bytes.error().reason);
  section_ = Section::end;
  return {};
}

/// Steps over `size` bytes and adds them to the sum of the data section.
void StreamReader::pass(std::uint64_t size) {
  while (size > 0) {
    const std::string_view piece =
        view(position_, static_cast<std::size_t>(std::min<std::uint64_t>(size, kPiece)));
    if (piece.empty()) return;
    data_crc_ = crc32(data_crc_, piece);
    position_ += piece.size();
    size -= piece.size();
  }
}

const Record* StreamReader::next() {
  if (section_ == Section::start && !read_magic()) section_ = Section::end;
  while (true) {
    if (in_chunk_) {
      if (read_inner()) return &record_;
    } else {
      if (section_ == Section::end) return nullptr;
      if (read_record()) return &record_;
    }
  }
}

bool StreamReader::read_magic() {
  section_ = Section::data;
  const std::string_view head = view(0, kMagic.size() + 1);
  if (head.size() == kMagic.size() + 1 && head.substr(0, kMagic.size()) == kMagic) {
    pass(kMagic.size());
    return true;
  }
  damage(0, "the file does not start as an MCAP log does");
  // One bad byte must not cost the file; another kind of file has no header record here.
  if (head.size() <= kMagic.size() || static_cast<Opcode>(head[kMagic.size()]) != Opcode::header) {
    return false;
  }
  pass(kMagic.size());
  return section_ == Section::data;
}

bool StreamReader::read_record() {
  const std::uint64_t left = source_.size() - position_;
  const std::string_view head = view(position_, kRecordHead);
  if (section_ == Section::end) return false;
  if (head.size() < kRecordHead) {
    damage(position_, left == 0 ? "the file ends here, without a footer"
                                : fmt::format("the file ends here, {} bytes into a record", left));
    section_ = Section::end;
    return false;
  }
  Decoder d(head);
  const auto opcode = d.integer<Opcode>();
  const auto length = d.integer<std::uint64_t>();
  if (opcode == Opcode{0} || length > left - kRecordHead) {
    recover(fmt::format(
        "{} record (opcode 0x{:02x}) of {} bytes, {} bytes are left: cut off or damaged",
        name(opcode), static_cast<unsigned>(opcode), length, left - kRecordHead));
    return false;
  }
  offset_ = position_;
  length_ = kRecordHead + length;
  const bool indexes = opcode == Opcode::message_index;  // for readers that seek: the sum is enough
  if (length > limits_.record_size || indexes) {
    if (!indexes) {
      damage(offset_, fmt::format("{} record of {} bytes skipped: the limit is {}", name(opcode),
                                  length, limits_.record_size));
    }
    pass(length_);
    return false;
  }
  const std::string_view record = view(position_, static_cast<std::size_t>(length_));
  if (record.size() < length_) {
    if (section_ != Section::end) damage(position_, "the file became shorter while it was read");
    section_ = Section::end;
    return false;
  }
  return read_content(opcode, record.substr(kRecordHead));
}

template <class T>
bool StreamReader::deliver(std::string_view content) {
  if (!std::holds_alternative<T>(record_)) record_.emplace<T>();
  if (decode(content, std::get<T>(record_))) return true;
  damage(offset_, "the record is too short for its fields");
  return false;
}

template <class T>
bool StreamReader::define(std::string_view content, std::map<std::uint16_t, T>& known) {
  if (!deliver<T>(content)) return false;
  const T& record = std::get<T>(record_);
  const auto [it, fresh] = known.try_emplace(record.id, record);
  if (!fresh && !(it->second == record)) {
    damage(offset_, fmt::format("id {} is defined a second time, differently", record.id));
    it->second = record;
  }
  return true;
}

/// `content` lies in the window. Returns true if record_ is to be delivered.
bool StreamReader::read_content(Opcode opcode, std::string_view content) {
  if (opcode == Opcode::chunk) return read_chunk(content);
  if (opcode == Opcode::data_end) {
    const std::uint32_t crc = data_crc_;
    section_ = Section::summary;
    data_end_ = offset_ + length_;
    position_ = data_end_;
    if (!deliver<DataEnd>(content)) return false;
    const std::uint32_t stored = std::get<DataEnd>(record_).data_section_crc;
    if (stored != 0 && stored != crc) {
      damage(offset_,
             fmt::format("data section: CRC-32 is {:08x}, the file says {:08x}", crc, stored));
    }
    return true;
  }
  if (opcode == Opcode::footer) {
    if (deliver<Footer>(content)) return read_footer(std::get<Footer>(record_));
    recover("no footer");
    return false;
  }
  data_crc_ = crc32(data_crc_, {content.data() - kRecordHead, static_cast<std::size_t>(length_)});
  position_ += length_;
  switch (opcode) {
    case Opcode::header:
      return deliver<Header>(content);
    case Opcode::schema:
      return define(content, schemas_);
    case Opcode::channel:
      return define(content, channels_);
    case Opcode::message:
      return deliver_message(content, offset_);
    case Opcode::metadata:
      return deliver<Metadata>(content);
    case Opcode::metadata_index:
      return deliver<MetadataIndex>(content);
    case Opcode::attachment_index:
      return deliver<AttachmentIndex>(content);
    case Opcode::chunk_index:
      return deliver<ChunkIndex>(content);
    case Opcode::summary_offset:
      return deliver<SummaryOffset>(content);
    case Opcode::statistics:
      if (!deliver<Statistics>(content)) return false;
      check_counts(std::get<Statistics>(record_));
      return true;
    case Opcode::attachment:
      if (!deliver<Attachment>(content)) return false;
      if (std::get<Attachment>(record_).crc_valid) return true;
      damage(offset_, fmt::format("attachment '{}': its CRC-32 does not fit, it is skipped",
                                  std::get<Attachment>(record_).name));
      return false;
    default:
      return false;  // of a later version of the format, or private
  }
}

bool StreamReader::read_chunk(std::string_view content) {
  if (!decode(content, chunk_)) {
    recover("a chunk is too short for its fields");
    return false;
  }
  const std::size_t head =
      kRecordHead + static_cast<std::size_t>(chunk_.records.data() - content.data());
  const std::string_view record(content.data() - kRecordHead, static_cast<std::size_t>(length_));
  const auto skip = [&](std::string_view why) {
    damage(offset_, fmt::format("chunk of log times {} to {} is skipped: {}",
                                chunk_.message_start_time, chunk_.message_end_time, why));
    return false;
  };
  data_crc_ = crc32(data_crc_, record.substr(0, head));
  const auto compression = parse_compression(chunk_.compression);
  const bool as_is = compression == Compression::none;
  const std::uint32_t stored_crc = crc32(0, chunk_.records);
  data_crc_ = crc32_join(data_crc_, stored_crc, chunk_.records.size());
  data_crc_ = crc32(data_crc_, record.substr(head + chunk_.records.size()));
  position_ += length_;

  if (!compression) return skip(fmt::format("unknown compression '{}'", chunk_.compression));
  if (chunk_.uncompressed_size > limits_.chunk_size) {
    return skip(fmt::format("it unpacks to {} bytes, the limit is {}", chunk_.uncompressed_size,
                            limits_.chunk_size));
  }
  const auto size = static_cast<std::size_t>(chunk_.uncompressed_size);
  const auto unpacked = decompressor_.run(*compression, chunk_.records, size);
  if (!unpacked) return skip(unpacked.error().reason);
  const std::uint32_t crc = as_is ? stored_crc : crc32(0, *unpacked);
  if (chunk_.uncompressed_crc != 0 && crc != chunk_.uncompressed_crc) {
    return skip(
        fmt::format("CRC-32 is {:08x}, the chunk says {:08x}", crc, chunk_.uncompressed_crc));
  }
  inner_ = *unpacked;
  inner_size_ = inner_.size();
  in_chunk_ = true;
  return false;
}

bool StreamReader::read_inner() {
  while (!inner_.empty()) {
    const std::size_t at = inner_size_ - inner_.size();
    Decoder d(inner_);
    const auto opcode = d.integer<Opcode>();
    const auto length = d.integer<std::uint64_t>();
    const std::string_view content = d.raw(length);
    if (!d.ok()) {
      damage(offset_,
             fmt::format("the record at byte {} of the unpacked chunk does not fit into it", at));
      break;
    }
    inner_.remove_prefix(kRecordHead + content.size());
    if (opcode == Opcode::message && deliver_message(content, offset_)) return true;
    if (opcode == Opcode::schema && define(content, schemas_)) return true;
    if (opcode == Opcode::channel && define(content, channels_)) return true;
  }
  inner_ = {};
  in_chunk_ = false;
  return false;
}

bool StreamReader::deliver_message(std::string_view content, std::uint64_t at) {
  if (!deliver<Message>(content)) return false;
  ++messages_;
  const std::uint16_t id = std::get<Message>(record_).channel_id;
  if (!channels_.contains(id) && unknown_channels_.insert(id).second) {
    damage(at, fmt::format("messages of channel {}, which was not defined before", id));
  }
  return true;
}

void StreamReader::check_counts(const Statistics& statistics) {
  if (statistics.message_count != messages_) {
    damage(offset_, fmt::format("{} messages were read, the summary counts {}", messages_,
                                statistics.message_count));
  }
}

/// Always true: the footer is delivered.
bool StreamReader::read_footer(const Footer& footer) {
  if (section_ == Section::data) damage(offset_, "a footer without an end of the data before it");
  section_ = Section::end;
  const std::uint64_t end = offset_ + length_;
  complete_ = view(end, kMagic.size() + 1) == kMagic;
  if (!complete_) damage(end, "the file does not end with its magic bytes after the footer");
  check_summary(footer);
  return true;
}

void StreamReader::check_summary(const Footer& footer) {
  if (footer.summary_crc == 0) return;
  std::uint64_t at = footer.summary_start != 0 ? footer.summary_start : data_end_;
  const std::uint64_t end = offset_ + length_ - sizeof footer.summary_crc;
  std::uint32_t crc = 0;
  if (at > end) {
    damage(offset_, "the footer names a summary behind itself");
    return;
  }
  while (at < end) {
    const std::string_view piece =
        view(at, static_cast<std::size_t>(std::min<std::uint64_t>(end - at, kPiece)));
    if (piece.empty()) return;
    crc = crc32(crc, piece);
    at += piece.size();
  }
  if (crc != footer.summary_crc) {
    damage(offset_,
           fmt::format("summary: CRC-32 is {:08x}, the file says {:08x}", crc, footer.summary_crc));
  }
}

/// The record at position_ cannot be: reports `why` and goes on where a chunk, or the end of the
/// data, is again certain.
void StreamReader::recover(std::string why) {
  const std::uint64_t from = position_;
  const std::uint64_t size = source_.size();
  if (section_ == Section::summary) {
    const std::uint64_t footer = size < kFooterSize ? 0 : size - kFooterSize;
    const bool whole_end = footer > from && view(footer, kFooterSize).ends_with(kMagic);
    damage(from, why + "; the rest of the summary is skipped");
    position_ = footer;
    if (!whole_end) section_ = Section::end;
    return;
  }
  const auto found = find_record(window_, size, from + 1);
  if (!found) {
    damage(from, why + "; nothing can be read behind it");
    section_ = Section::end;
    return;
  }
  damage(from, fmt::format("{}; reading goes on at {}", why, *found));
  pass(*found - from);
}

}  // namespace mimesis::log
