#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/log/io.h"
#include "common/log/pieces.h"
#include "common/log/read_ahead.h"
#include "common/log/records.h"

namespace mimesis::log {

/// Reads a log from front to back. Every sum in the file is checked: a chunk that fails is skipped
/// whole, never delivered in part. After a record that cannot be, reading goes on at the next chunk
/// that can be. Of a chunk whose end is missing at the end of the file those messages are delivered
/// that are whole; that their sum could not be checked is told as a damage.
///
/// Two threads read, sum and unpack ahead in all but small files. Memory is bounded by the records
/// and chunks on their way: 64 MiB, or one larger record or chunk within the limits; and the
/// schemas.
class StreamReader {
 public:
  explicit StreamReader(const Source& source, const ReaderLimits& limits = {});

  /// The next record, or null at the end of what can be read. Views in it live until the next call.
  const Record* next();

  /// Offset of the record just returned, or of the chunk that holds it.
  std::uint64_t offset() const { return offset_; }
  std::uint64_t length() const { return length_; }  ///< of that record or chunk, with its head
  /// The head of the chunk that holds the record, or null; `records` in it is void.
  const Chunk* chunk() const { return in_chunk_ ? &piece_->chunk : nullptr; }
  /// Of a chunk whose end is missing: size of what is delivered of it, unpacked; else 0 [bytes].
  std::size_t salvaged() const { return in_chunk_ && piece_->cut ? inner_size_ : 0; }

  const std::map<std::uint16_t, Schema>& schemas() const { return schemas_; }     ///< seen so far
  const std::map<std::uint16_t, Channel>& channels() const { return channels_; }  ///< seen so far

  /// Footer and closing magic were reached.
  bool complete() const { return complete_; }
  const std::vector<Damage>& damages() const { return damages_; }
  std::uint64_t damage_count() const { return damage_count_; }  ///< may exceed damages().size()

 private:
  void damage(std::uint64_t offset, std::string what);
  bool take_piece();
  void begin_chunk();
  bool read_record();
  bool read_content(Opcode opcode, std::string_view content);
  bool read_inner();
  bool deliver_message(std::string_view content);
  bool read_data_end(std::string_view content);
  bool read_footer(std::string_view content);
  void check_summary(const Footer& footer);
  void check_counts(const Statistics& statistics);

  template <class T>
  bool deliver(std::string_view content);
  template <class T>
  bool define(std::string_view content, std::map<std::uint16_t, T>& known);

  const Source& source_;
  ReaderLimits limits_;
  PieceReader pieces_;
  ReadAhead<Piece> ahead_;
  std::unique_ptr<Piece> piece_;  ///< the current one

  std::uint64_t offset_ = 0,
                length_ = 0;    ///< of the current record outside of chunks, or the chunk
  std::uint32_t data_crc_ = 0;  ///< of the bytes before the piece
  std::uint64_t data_end_ = 0;  ///< first byte behind DataEnd; 0: not yet there
  bool complete_ = false;

  bool in_chunk_ = false;
  std::string_view rest_;  ///< of the unpacked chunk, or of the piece's records
  std::size_t inner_size_ = 0;

  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::vector<bool> known_channels_;  ///< by id: defined, or reported as undefined
  std::uint64_t messages_ = 0;
  std::vector<Damage> damages_;
  std::uint64_t damage_count_ = 0;
  Record record_;
};

}  // namespace mimesis::log
