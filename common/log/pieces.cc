#include "common/log/pieces.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/log/codec.h"
#include "common/log/records.h"
#include "common/log/wire.h"

namespace mimesis::log {
namespace {

constexpr std::size_t kRun = 256 * 1024;   // small records taken together [bytes]
constexpr std::size_t kPart = 256 * 1024;  // bytes that are summed at once without being parsed
constexpr std::size_t kChunkHead = 4096;   // with room for any name of a codec [bytes]
// a sector: unit of missing data after a power cut [bytes]
constexpr std::size_t kZeroRun = 512;

constexpr std::size_t kSearchPiece = 64 * 1024;
constexpr std::size_t kDataEnd = kRecordHead + sizeof(std::uint32_t);
constexpr std::size_t kLeastChunkHead =
    kRecordHead + 3 * 8 + 4 + 4 + 4 + 8;  // with the longest name, "lz4"/"zstd"

bool chunk_starts(std::string_view bytes, std::uint64_t left) {
  Decoder d(bytes);
  if (d.integer<Opcode>() != Opcode::chunk) return false;
  const auto length = d.integer<std::uint64_t>();
  Chunk chunk;
  std::uint64_t size = 0;
  return length <= left - kRecordHead && decode_head(d.rest(), chunk, size) &&
         chunk.message_start_time <= chunk.message_end_time &&
         parse_compression(chunk.compression) &&
         length == 3 * 8 + 4 + 4 + chunk.compression.size() + 8 + size;
}

bool data_end_starts(std::string_view bytes, std::uint64_t left) {
  Decoder d(bytes);
  if (d.integer<Opcode>() != Opcode::data_end ||
      d.integer<std::uint64_t>() != sizeof(std::uint32_t)) {
    return false;
  }
  d.integer<std::uint32_t>();
  const std::uint64_t behind = left - std::min(left, std::uint64_t{kDataEnd});
  if (!d.ok() || behind < kRecordHead) return d.ok() && behind == 0;
  const auto opcode = d.integer<Opcode>();  // of the summary, or the footer
  return opcode >= Opcode::footer && opcode <= Opcode::summary_offset &&
         opcode != Opcode::message && opcode != Opcode::chunk &&
         d.integer<std::uint64_t>() <= behind - kRecordHead;
}

/// The first offset >= `from` where a Chunk or DataEnd record is certain to start: all lengths in
/// its head agree with each other and with the size of the file. O(size) once.
std::optional<std::uint64_t> find_record(Window& window, std::uint64_t file_size,
                                         std::uint64_t from) {
  while (from < file_size) {
    const auto bytes = window.view(from, kSearchPiece + kLeastChunkHead);
    if (!bytes || bytes->empty()) return std::nullopt;
    const std::size_t starts = bytes->size() <= kSearchPiece ? bytes->size() : kSearchPiece;
    for (std::size_t i = 0; i < starts; ++i) {
      const auto opcode = static_cast<Opcode>((*bytes)[i]);
      if (opcode != Opcode::chunk && opcode != Opcode::data_end) continue;
      const std::uint64_t left = file_size - from - i;
      if (left < kRecordHead) return std::nullopt;
      const std::string_view here = bytes->substr(i, kLeastChunkHead);
      if (chunk_starts(here, left) || data_end_starts(here, left)) return from + i;
    }
    from += starts;
  }
  return std::nullopt;
}

}  // namespace

PieceReader::PieceReader(const Source& source, const ReaderLimits& limits)
    : source_(source), limits_(limits), size_(source.size()), window_(source) {}

std::size_t PieceReader::memory(const Piece& piece) {
  if (piece.kind == Piece::Kind::gap) return kPart;
  const bool unpacks = piece.kind == Piece::Kind::chunk;
  return static_cast<std::size_t>(piece.length + (unpacks ? piece.chunk.uncompressed_size : 0));
}

std::string_view PieceReader::view(Piece& piece, std::uint64_t offset, std::size_t size) {
  auto bytes = window_.view(offset, size);
  if (bytes) return *bytes;
  piece.damages.push_back({offset, bytes.error().reason});
  section_ = Section::end;
  return {};
}

bool PieceReader::claim(Piece& piece) {
  piece.kind = Piece::Kind::nothing;
  piece.offset = position_;
  piece.length = 0;
  piece.crc = 0;
  piece.damages.clear();
  piece.cut = false;
  piece.skipped.clear();
  piece.failed.reset();
  if (section_ == Section::start) {
    claim_magic(piece);
  } else {
    while (section_ != Section::end && !claim_record(piece)) continue;
  }
  position_ = piece.offset + piece.length;
  return piece.kind != Piece::Kind::nothing || !piece.damages.empty();
}

void PieceReader::claim_magic(Piece& piece) {
  section_ = Section::data;
  const std::string_view head = view(piece, 0, kMagic.size() + 1);
  piece.kind = Piece::Kind::gap;
  piece.length = std::min(size_, std::uint64_t{kMagic.size()});
  if (head.size() == kMagic.size() + 1 && head.substr(0, kMagic.size()) == kMagic) return;
  if (section_ == Section::end) return;
  piece.damages.push_back({0, "the file does not start as an MCAP log does"});
  // One bad byte must not cost the file; another kind of file has no header record here.
  if (head.size() <= kMagic.size() || static_cast<Opcode>(head[kMagic.size()]) != Opcode::header) {
    section_ = Section::end;
  }
}

bool PieceReader::alone(Opcode opcode, std::uint64_t length) const {
  return opcode == Opcode::chunk || opcode == Opcode::data_end || opcode == Opcode::footer ||
         length > limits_.record_size;
}

/// Adds the record behind the piece to it. True: the piece is complete without or with it.
bool PieceReader::claim_record(Piece& piece) {
  const bool first = piece.length == 0;
  const std::uint64_t at = piece.offset + piece.length, left = size_ - at;
  const auto head = window_.view(at, kRecordHead);
  Decoder d(head ? *head : std::string_view());
  const auto opcode = d.integer<Opcode>();
  const auto length = d.integer<std::uint64_t>();
  const bool bad = !d.ok() || opcode == Opcode{0} || length > left - kRecordHead;
  if (!first && (bad || alone(opcode, length) || piece.length + length > kRun)) return true;
  if (bad) {
    if (!head) {
      view(piece, at, kRecordHead);
    } else if (head->size() < kRecordHead) {
      piece.damages.push_back(
          {at, left == 0 ? "the file ends here, without a footer"
                         : fmt::format("the file ends here, {} bytes into a record", left)});
      section_ = Section::end;
    } else if (opcode != Opcode::chunk || !claim_cut_chunk(piece)) {
      recover(piece,
              fmt::format("{} record (opcode 0x{:02x}) of {} bytes, {} bytes are left: cut "
                          "off or damaged",
                          name(opcode), static_cast<unsigned>(opcode), length, left - kRecordHead));
    }
    return piece.kind != Piece::Kind::nothing;
  }
  const bool index = opcode == Opcode::message_index;  // for readers that seek: its sum is enough
  if (length > limits_.record_size || (index && length > kRun)) {
    piece.kind = Piece::Kind::gap;
    if (!index) {
      piece.damages.push_back({at, fmt::format("{} record of {} bytes skipped: the limit is {}",
                                               name(opcode), length, limits_.record_size)});
    }
  } else if (opcode == Opcode::chunk) {
    return claim_chunk(piece, length);
  } else if (opcode == Opcode::footer && length != 8 + 8 + 4) {
    recover(piece, "no footer");
    return piece.kind != Piece::Kind::nothing;
  } else {
    piece.kind = Piece::Kind::records;
  }
  piece.length += kRecordHead + length;
  if (opcode == Opcode::data_end) section_ = Section::summary;
  if (opcode == Opcode::footer) section_ = Section::end;
  return alone(opcode, length) || piece.length >= kRun;
}

/// Always complete: a chunk, or the rest of it up to a place where reading continues.
bool PieceReader::claim_chunk(Piece& piece, std::uint64_t length) {
  const auto wanted = std::min<std::uint64_t>(length, kChunkHead);
  const std::string_view head =
      view(piece, piece.offset + kRecordHead, static_cast<std::size_t>(wanted));
  std::uint64_t size = 0;
  if (!decode_head(head, piece.chunk, size) ||
      size > length - static_cast<std::uint64_t>(piece.chunk.records.data() - head.data())) {
    if (section_ != Section::end) recover(piece, "a chunk is too short for its fields");
    return piece.kind != Piece::Kind::nothing;
  }
  piece.kind = Piece::Kind::chunk;
  piece.length = kRecordHead + length;
  return true;
}

/// A chunk longer than the rest of the file: is it one, and only its end missing?
bool PieceReader::claim_cut_chunk(Piece& piece) {
  if (!window_.view(piece.offset, kRecordHead + kChunkHead)) return false;
  const std::string_view bytes = view(piece, piece.offset, kRecordHead + kChunkHead);
  std::uint64_t length = 0, size = 0;
  std::memcpy(&length, bytes.data() + 1, sizeof length);
  const std::string_view content = bytes.substr(kRecordHead);
  if (!decode_head(content, piece.chunk, size)) return false;
  const auto head = static_cast<std::uint64_t>(piece.chunk.records.data() - content.data());
  const Chunk& chunk = piece.chunk;
  if (length != head + size || chunk.message_start_time > chunk.message_end_time ||
      !parse_compression(chunk.compression) || chunk.uncompressed_size > limits_.chunk_size ||
      size_ - piece.offset > limits_.record_size || find_record(window_, size_, piece.offset + 1)) {
    return false;
  }
  piece.kind = Piece::Kind::chunk;
  piece.cut = true;
  piece.length = size_ - piece.offset;
  section_ = Section::end;
  return true;
}

/// The record at the piece's offset is impossible: reports `why` and continues where a chunk, or
/// the end of the data, is certain again.
void PieceReader::recover(Piece& piece, std::string why) {
  const std::uint64_t from = piece.offset;
  if (section_ == Section::summary) {
    const std::uint64_t footer = size_ < kFooterSize ? 0 : size_ - kFooterSize;
    const bool whole_end = footer > from && view(piece, footer, kFooterSize).ends_with(kMagic);
    piece.damages.push_back({from, why + "; the rest of the summary is skipped"});
    piece.offset = footer;
    if (!whole_end) section_ = Section::end;
    return;
  }
  const auto found = find_record(window_, size_, from + 1);
  if (!found) {
    piece.damages.push_back({from, why + "; nothing can be read behind it"});
    section_ = Section::end;
    return;
  }
  piece.damages.push_back({from, fmt::format("{}; reading goes on at {}", why, *found)});
  piece.kind = Piece::Kind::gap;
  piece.length = *found - from;
}

void PieceReader::work(Piece& piece) const {
  if (piece.kind == Piece::Kind::nothing) return;
  if (piece.kind == Piece::Kind::gap) return sum_gap(piece);
  const auto size = static_cast<std::size_t>(piece.length);
  char* raw = piece.raw.reserve(size);
  const auto n = source_.read(piece.offset, raw, size);
  if (!n || *n < size) {
    piece.failed =
        Damage{piece.offset, n ? "the file became shorter while it was read" : n.error().reason};
    return;
  }
  piece.bytes = {raw, size};
  if (piece.kind == Piece::Kind::records) {
    piece.crc = crc32(0, piece.bytes);
  } else if (piece.cut) {
    unpack_cut(piece);
  } else {
    unpack(piece);
  }
}

void PieceReader::sum_gap(Piece& piece) const {
  char* raw = piece.raw.reserve(kPart);
  for (std::uint64_t done = 0; done < piece.length;) {
    const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(piece.length - done, kPart));
    const auto n = source_.read(piece.offset + done, raw, size);
    if (!n || *n < size) {
      piece.failed = Damage{piece.offset + done,
                            n ? "the file became shorter while it was read" : n.error().reason};
      return;
    }
    piece.crc = crc32(piece.crc, {raw, size});
    done += size;
  }
}

void PieceReader::unpack(Piece& piece) const {
  Chunk& chunk = piece.chunk;
  if (!decode(piece.bytes.substr(kRecordHead), chunk)) {
    piece.skipped = "the file changed while it was read";
    return;
  }
  const auto head = static_cast<std::size_t>(chunk.records.data() - piece.bytes.data());
  const std::uint32_t packed_crc = crc32(0, chunk.records);
  piece.crc = crc32_join(crc32(0, piece.bytes.substr(0, head)), packed_crc, chunk.records.size());
  piece.crc = crc32(piece.crc, piece.bytes.substr(head + chunk.records.size()));

  const auto compression = parse_compression(chunk.compression);
  if (!compression) {
    piece.skipped = fmt::format("unknown compression '{}'", chunk.compression);
    return;
  }
  if (chunk.uncompressed_size > limits_.chunk_size) {
    piece.skipped = fmt::format("it unpacks to {} bytes, the limit is {}", chunk.uncompressed_size,
                                limits_.chunk_size);
    return;
  }
  const auto unpacked = piece.decompressor.run(*compression, chunk.records,
                                               static_cast<std::size_t>(chunk.uncompressed_size));
  const bool as_is = compression == Compression::none;
  const std::uint32_t crc = !unpacked || as_is ? packed_crc : crc32(0, *unpacked);
  if (unpacked && (chunk.uncompressed_crc == 0 || crc == chunk.uncompressed_crc)) {
    piece.unpacked = *unpacked;
    return;
  }
  piece.skipped =
      unpacked ? fmt::format("CRC-32 is {:08x}, the chunk says {:08x}", crc, chunk.uncompressed_crc)
               : unpacked.error().reason;
  const std::size_t zeros = piece.bytes.size() - without_zeros(piece.bytes);
  if (zeros >= kZeroRun && zeros_follow(piece.offset + piece.length)) unpack_cut(piece);
}

/// Unpacks the beginning of a chunk whose end is missing, or was never written.
void PieceReader::unpack_cut(Piece& piece) const {
  Chunk& chunk = piece.chunk;
  std::uint64_t size = 0;
  const std::string_view content =
      piece.bytes.substr(kRecordHead, without_zeros(piece.bytes.substr(kRecordHead)));
  const auto compression = parse_compression(chunk.compression);
  piece.cut = true;
  piece.unpacked = {};
  if (!decode_head(content, chunk, size) || !compression) return;
  if (size < chunk.records.size()) chunk.records = chunk.records.substr(0, size);
  piece.unpacked = piece.decompressor.run_beginning(
      *compression, chunk.records, static_cast<std::size_t>(chunk.uncompressed_size));
}

bool PieceReader::zeros_follow(std::uint64_t from) const {
  Window window(source_);
  while (from < size_) {
    const auto bytes = window.view(from, kPart);
    if (!bytes || bytes->empty() || without_zeros(*bytes) > 0) return false;
    from += bytes->size();
  }
  return true;
}

}  // namespace mimesis::log
