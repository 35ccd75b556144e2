#pragma once
#include <cstdint>
#include <optional>
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
  std::string what;          ///< what was expected, what was found, what is lost
  bool operator==(const Damage&) const = default;
};

struct ReaderLimits {
  std::uint64_t record_size = 1ull << 30;  ///< larger records are skipped and reported [bytes]
  std::uint64_t chunk_size = 1ull << 30;   ///< the same for what a chunk says it unpacks to [bytes]
  std::size_t damages = 1000;              ///< so many are described, the rest is counted
  bool threads = true;                     ///< read and unpack ahead; false: in the caller's thread
};

/// A part of a file that can be read, summed and unpacked without its neighbours. Keeps its memory.
struct Piece {
  enum class Kind {
    nothing,  ///< only damages
    records,  ///< whole records that are no chunks
    chunk,
    gap,  ///< bytes that are summed but not parsed
  };
  // Known from the heads of the records.
  Kind kind = Kind::nothing;
  std::uint64_t offset = 0, length = 0;  ///< in the file [bytes]
  std::vector<Damage> damages;           ///< before it
  bool cut = false;                      ///< only the beginning of the chunk is there
  // Known when it was read.
  std::string_view bytes;        ///< bytes of a piece of records
  std::uint32_t crc = 0;         ///< sum of all its bytes in the file
  Chunk chunk;                   ///< `records` is void
  std::string_view unpacked;     ///< the chunk's records; of a cut one as far as they go, unchecked
  std::string skipped;           ///< why the chunk is not delivered; empty: it is
  std::optional<Damage> failed;  ///< reading the file failed; it is the last piece

  Buffer raw;
  Decompressor decompressor;
};

/// Cuts a file into pieces. `claim` one thread at a time and in order, `work` any: it needs nothing
/// but the piece.
class PieceReader {
 public:
  PieceReader(const Source& source, const ReaderLimits& limits);

  /// The next piece: looks at the heads of records only. After an impossible record, the next one
  /// begins at the next possible chunk. False: there are no more.
  bool claim(Piece& piece);
  /// Reads it, checks its sums, unpacks it.
  void work(Piece& piece) const;

  /// How much memory it takes [bytes].
  static std::size_t memory(const Piece& piece);

 private:
  enum class Section { start, data, summary, end };

  void claim_magic(Piece& piece);
  bool claim_record(Piece& piece);
  bool claim_chunk(Piece& piece, std::uint64_t length);
  bool claim_cut_chunk(Piece& piece);
  void recover(Piece& piece, std::string why);
  bool alone(Opcode opcode, std::uint64_t length) const;
  std::string_view view(Piece& piece, std::uint64_t offset, std::size_t size);
  void sum_gap(Piece& piece) const;
  void unpack(Piece& piece) const;
  void unpack_cut(Piece& piece) const;
  bool zeros_follow(std::uint64_t from) const;

  const Source& source_;
  ReaderLimits limits_;
  std::uint64_t size_;  ///< size of the file
  Window window_;
  Section section_ = Section::start;
  std::uint64_t position_ = 0;  ///< position of the next record
};

}  // namespace mimesis::log
