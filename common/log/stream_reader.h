#pragma once
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/log/codec.h"
#include "common/log/io.h"
#include "common/log/records.h"

namespace mimesis::log {

/// Something in a file that is not as it should be.
struct Damage {
  std::uint64_t offset = 0;  ///< in the file [bytes]
  std::string what;          ///< what was expected, what is there, what it costs
};

struct ReaderLimits {
  std::uint64_t record_size = 1ull << 30;  ///< larger records are skipped and reported [bytes]
  std::uint64_t chunk_size = 1ull << 30;   ///< the same for what a chunk says it unpacks to [bytes]
  std::size_t damages = 1000;              ///< so many are described, the rest is counted
};

/// Reads a log from front to back. Every sum in the file is checked: a chunk that fails is skipped
/// whole, never delivered in part. After a record that cannot be, reading goes on at the next chunk
/// that can be. Memory is bounded by the largest record and the largest chunk, within the limits,
/// and the schemas.
class StreamReader {
 public:
  explicit StreamReader(const Source& source, const ReaderLimits& limits = {});

  /// The next record, or null at the end of what can be read. Views in it live until the next call.
  const Record* next();

  /// Offset of the record just returned, or of the chunk that holds it.
  std::uint64_t offset() const { return offset_; }
  std::uint64_t length() const { return length_; }  ///< of that record or chunk, with its head
  /// The head of the chunk that holds the record, or null; `records` in it is void.
  const Chunk* chunk() const { return in_chunk_ ? &chunk_ : nullptr; }

  const std::map<std::uint16_t, Schema>& schemas() const { return schemas_; }     ///< seen so far
  const std::map<std::uint16_t, Channel>& channels() const { return channels_; }  ///< seen so far

  /// Footer and closing magic were reached.
  bool complete() const { return complete_; }
  const std::vector<Damage>& damages() const { return damages_; }
  std::uint64_t damage_count() const { return damage_count_; }  ///< may exceed damages().size()

 private:
  enum class Section { start, data, summary, end };

  void damage(std::uint64_t offset, std::string what);
  bool read_magic();
  bool read_record();
  bool read_content(Opcode opcode, std::string_view content);
  bool read_chunk(std::string_view content);
  bool read_inner();
  bool deliver_message(std::string_view content, std::uint64_t at);
  bool read_footer(const Footer& footer);
  void check_summary(const Footer& footer);
  void check_counts(const Statistics& statistics);
  void recover(std::string why);
  std::string_view view(std::uint64_t offset, std::size_t size);
  void pass(std::uint64_t size);

  template <class T>
  bool deliver(std::string_view content);
  template <class T>
  bool define(std::string_view content, std::map<std::uint16_t, T>& known);

  const Source& source_;
  ReaderLimits limits_;
  Window window_;
  Decompressor decompressor_;

  Section section_ = Section::start;
  std::uint64_t position_ = 0;             ///< of the next record outside chunks
  std::uint64_t offset_ = 0, length_ = 0;  ///< of the current one
  std::uint32_t data_crc_ = 0;             ///< of the bytes before position_
  std::uint64_t data_end_ = 0;             ///< first byte behind DataEnd
  bool complete_ = false;

  bool in_chunk_ = false;
  Chunk chunk_;
  std::string_view inner_;  ///< rest of the unpacked chunk
  std::size_t inner_size_ = 0;

  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::set<std::uint16_t> unknown_channels_;
  std::uint64_t messages_ = 0;
  std::vector<Damage> damages_;
  std::uint64_t damage_count_ = 0;
  Record record_;
};

}  // namespace mimesis::log
