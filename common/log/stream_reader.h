#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/log/codec.h"
#include "common/log/io.h"
#include "common/log/pieces.h"
#include "common/log/read_ahead.h"
#include "common/log/records.h"
#include "common/log/wire.h"

namespace mimesis::log {

/// Reads a log from front to back. Every sum in the file is checked: a chunk that fails is skipped
/// whole, never delivered in part. After an impossible record reading continues at the next
/// possible chunk. From a chunk whose end is missing at the end of the file the whole messages are
/// delivered; a damage reports that their sum could not be checked.
///
/// Two threads read, sum and unpack ahead in all but small files. Memory is bounded by the records
/// and chunks on their way: 64 MiB, or one larger record or chunk within the limits; and the
/// schemas.
class StreamReader {
 public:
  explicit StreamReader(const Source& source, const ReaderLimits& limits = {})
      : source_(source),
        limits_(limits),
        pieces_(source, limits),
        ahead_([this](Piece& piece) { return pieces_.claim(piece); },
               [this](Piece& piece) { pieces_.work(piece); }, &PieceReader::memory, limits.threads),
        known_channels_(kIds, false) {}

  /// The next record, or null at the end of what can be read. Views in it live until the next call.
  const Record* next() {
    while (true) {
      if (rest_.empty()) {
        if (!take_piece()) return nullptr;
      } else if (in_chunk_ ? read_inner() : read_record()) {
        return &record_;
      }
    }
  }

  /// Offset of the record just returned, or of the chunk that holds it.
  std::uint64_t offset() const { return offset_; }
  /// length of that record or chunk, with its head
  std::uint64_t length() const { return length_; }
  /// The head of the chunk that holds the record, or null; `records` in it is void.
  const Chunk* chunk() const { return in_chunk_ ? &piece_->chunk : nullptr; }
  /// Unpacked size that is delivered from a chunk whose end is missing; else 0 [bytes].
  std::size_t salvaged() const { return in_chunk_ && piece_->cut ? inner_size_ : 0; }

  const std::map<std::uint16_t, Schema>& schemas() const { return schemas_; }     ///< seen so far
  const std::map<std::uint16_t, Channel>& channels() const { return channels_; }  ///< seen so far

  /// The first schema or channel whose id was another's before, if any.
  const std::optional<Damage>& redefined() const { return redefined_; }

  /// Footer and closing magic were reached.
  bool complete() const { return complete_; }
  const std::vector<Damage>& damages() const { return damages_; }
  std::uint64_t damage_count() const { return damage_count_; }  ///< may exceed damages().size()

 private:
  static constexpr std::size_t kIds = 1 << 16;
  static constexpr std::uint64_t kSummaryPart = 256 * 1024;  // summed at once [bytes]

  void damage(std::uint64_t offset, std::string what) {
    ++damage_count_;
    if (damages_.size() < limits_.damages) damages_.push_back({offset, std::move(what)});
  }
  bool take_piece() {
    if (piece_ && piece_->failed) return false;
    if (piece_) data_crc_ = crc32_join(data_crc_, piece_->crc, piece_->length);
    ahead_.give_back(std::move(piece_));
    in_chunk_ = false;
    piece_ = ahead_.take();
    if (!piece_) return false;
    for (Damage& d : piece_->damages) damage(d.offset, std::move(d.what));
    offset_ = piece_->offset;
    length_ = piece_->length;
    if (piece_->failed) {
      damage(piece_->failed->offset, piece_->failed->what);
    } else if (piece_->kind == Piece::Kind::records) {
      rest_ = piece_->bytes;
    } else if (piece_->kind == Piece::Kind::chunk) {
      begin_chunk();
    }
    return true;
  }
  void begin_chunk() {
    const Chunk& chunk = piece_->chunk;
    const auto times =
        fmt::format("log times {} to {}", chunk.message_start_time, chunk.message_end_time);
    rest_ = piece_->unpacked;
    if (piece_->cut) {
      const Salvage saved = salvage(rest_, chunk, channels_);
      rest_ = rest_.substr(0, saved.bytes);
      damage(offset_,
             fmt::format("the file ends in a chunk of {}: its first {} messages are saved, "
                         "their sum cannot be checked",
                         times, saved.messages));
    } else if (!piece_->skipped.empty()) {
      rest_ = {};
      damage(offset_, fmt::format("chunk of {} is skipped: {}", times, piece_->skipped));
    }
    inner_size_ = rest_.size();
    in_chunk_ = inner_size_ > 0;
  }
  bool read_record() {
    const auto at = static_cast<std::size_t>(rest_.data() - piece_->bytes.data());
    Decoder d(rest_);
    const auto opcode = d.integer<Opcode>();
    const std::string_view content = d.raw(d.integer<std::uint64_t>());
    if (!d.ok()) {
      rest_ = {};
      damage(piece_->offset + at, "the file changed while it was read");
      return false;
    }
    offset_ = piece_->offset + at;
    length_ = kRecordHead + content.size();
    rest_.remove_prefix(static_cast<std::size_t>(length_));
    return read_content(opcode, content);
  }
  bool read_content(Opcode opcode, std::string_view content) {
    switch (opcode) {
      case Opcode::header:
        return deliver<Header>(content);
      case Opcode::schema:
        return define(content, schemas_);
      case Opcode::channel:
        return define(content, channels_);
      case Opcode::message:
        return deliver_message(content);
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
      case Opcode::data_end:
        return read_data_end(content);
      case Opcode::footer:
        return read_footer(content);
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
        return false;  // of a later version of the format, private, or an index for readers that
                       // seek
    }
  }
  bool read_inner() {
    Decoder d(rest_);
    const auto opcode = d.integer<Opcode>();
    const std::string_view content = d.raw(d.integer<std::uint64_t>());
    if (!d.ok()) {
      const std::size_t at = inner_size_ - rest_.size();
      rest_ = {};
      damage(offset_,
             fmt::format("the record at byte {} of the unpacked chunk does not fit into it", at));
      return false;
    }
    rest_.remove_prefix(kRecordHead + content.size());
    if (opcode == Opcode::message) return deliver_message(content);
    if (opcode == Opcode::schema) return define(content, schemas_);
    if (opcode == Opcode::channel) return define(content, channels_);
    return false;
  }
  bool deliver_message(std::string_view content) {
    if (!deliver<Message>(content)) return false;
    ++messages_;
    const std::uint16_t id = std::get_if<Message>(&record_)->channel_id;
    if (!known_channels_[id]) {
      known_channels_[id] = true;
      damage(offset_, fmt::format("messages of channel {}, which was not defined before", id));
    }
    return true;
  }
  bool read_data_end(std::string_view content) {
    data_end_ = offset_ + length_;
    if (!deliver<DataEnd>(content)) return false;
    const std::uint32_t stored = std::get<DataEnd>(record_).data_section_crc;
    if (stored != 0 && stored != data_crc_) {
      damage(offset_, fmt::format("data section: CRC-32 is {:08x}, the file says {:08x}", data_crc_,
                                  stored));
    }
    return true;
  }
  bool read_footer(std::string_view content) {
    if (!deliver<Footer>(content)) return false;
    if (data_end_ == 0) damage(offset_, "a footer without an end of the data before it");
    const std::uint64_t end = offset_ + length_;
    Window window(source_);
    const auto magic = window.view(end, kMagic.size() + 1);
    complete_ = magic && *magic == kMagic;
    if (!complete_) damage(end, "the file does not end with its magic bytes after the footer");
    check_summary(std::get<Footer>(record_));
    return true;
  }
  void check_summary(const Footer& footer) {
    if (footer.summary_crc == 0) return;
    std::uint64_t at = footer.summary_start != 0 ? footer.summary_start : data_end_;
    const std::uint64_t end = offset_ + length_ - sizeof footer.summary_crc;
    std::uint32_t crc = 0;
    if (at > end) {
      damage(offset_, "the footer names a summary behind itself");
      return;
    }
    Window window(source_);
    while (at < end) {
      const auto part = window.view(
          at, static_cast<std::size_t>(std::min<std::uint64_t>(end - at, kSummaryPart)));
      if (!part || part->empty()) {
        damage(at, part ? "the file became shorter while it was read" : part.error().reason);
        return;
      }
      crc = crc32(crc, *part);
      at += part->size();
    }
    if (crc != footer.summary_crc) {
      damage(offset_, fmt::format("summary: CRC-32 is {:08x}, the file says {:08x}", crc,
                                  footer.summary_crc));
    }
  }
  void check_counts(const Statistics& statistics) {
    if (statistics.message_count != messages_) {
      damage(offset_, fmt::format("{} messages were read, the summary counts {}", messages_,
                                  statistics.message_count));
    }
  }

  template <class T>
  bool deliver(std::string_view content) {
    if (!std::holds_alternative<T>(record_)) record_.emplace<T>();
    if (decode(content, *std::get_if<T>(&record_))) return true;
    damage(offset_, "the record is too short for its fields");
    return false;
  }
  template <class T>
  bool define(std::string_view content, std::map<std::uint16_t, T>& known) {
    if (!deliver<T>(content)) return false;
    const T& record = std::get<T>(record_);
    const auto [it, fresh] = known.try_emplace(record.id, record);
    if (!fresh && !(it->second == record)) {
      damage(offset_, fmt::format("id {} is defined a second time, differently", record.id));
      if (data_end_ > 0) return true;  // a cut summary: the messages went by the first
      if (!redefined_) redefined_ = Damage{offset_, fmt::format("id {}", record.id)};
      it->second = record;
    }
    if constexpr (std::is_same_v<T, Channel>) known_channels_[record.id] = true;
    return true;
  }

  const Source& source_;
  ReaderLimits limits_;
  PieceReader pieces_;
  ReadAhead<Piece> ahead_;
  std::unique_ptr<Piece> piece_;  ///< the current one

  std::uint64_t offset_ = 0,
                length_ = 0;    ///< length of the current record outside of chunks, or of the chunk
  std::uint32_t data_crc_ = 0;  ///< sum of the bytes before the piece
  std::uint64_t data_end_ = 0;  ///< first byte behind DataEnd; 0: not yet there
  bool complete_ = false;

  bool in_chunk_ = false;
  std::string_view rest_;  ///< rest of the unpacked chunk, or of the piece's records
  std::size_t inner_size_ = 0;

  std::optional<Damage> redefined_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::vector<bool> known_channels_;  ///< by id: defined, or reported as undefined
  std::uint64_t messages_ = 0;
  std::vector<Damage> damages_;
  std::uint64_t damage_count_ = 0;
  Record record_;
};

}  // namespace mimesis::log
