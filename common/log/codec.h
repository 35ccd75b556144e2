#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <tl/expected.hpp>

#include "common/error.h"

namespace mimesis::log {

/// How the records of a chunk are compressed: lz4 as LZ4 frames at the fast level, zstd at level 1
/// unless a level is given.
enum class Compression { none, lz4, zstd };
inline constexpr int kZstdLevel = 1;  ///< eight times as fast as lz4 at its level 9, and smaller

/// Name in a file ("" for none).
std::string_view wire_name(Compression compression);
/// Inverse; "none" is also accepted. Empty for an unknown name.
std::optional<Compression> parse_compression(std::string_view name);

/// Compresses whole buffers; keeps its context and buffer between calls.
class Compressor {
 public:
  /// `zstd_level`: 1 (fast) to 19 (small); the other codecs know none.
  explicit Compressor(Compression compression, int zstd_level = kZstdLevel);
  ~Compressor();
  /// The result lives until the next call; for Compression::none it is `bytes` itself.
  tl::expected<std::string_view, Status> run(std::string_view bytes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Decompresses untrusted data.
class Decompressor {
 public:
  Decompressor();
  ~Decompressor();
  /// Exactly `size` bytes, or the reason of the failure. The result is valid until the next call;
  /// for Compression::none it is `bytes` itself. Memory is taken only as far as data arrives,
  /// independent of `size`.
  tl::expected<std::string_view, Status> run(Compression compression, std::string_view bytes,
                                             std::size_t size);
  /// Unpacks the beginning of compressed bytes: whole blocks (zstd: 128 kB, our lz4: 64 kB), at
  /// most `size` bytes. The result is valid until the next call.
  std::string_view run_beginning(Compression compression, std::string_view bytes, std::size_t size);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// CRC-32 of `bytes` (reflected polynomial 0xEDB88320, as in zlib), continuing `crc`. Start with 0.
std::uint32_t crc32(std::uint32_t crc, std::string_view bytes);

/// CRC of A followed by B, from crc(A), crc(B) and |B|. O(log |B|): data is read once where two
/// sums cover it.
std::uint32_t crc32_join(std::uint32_t crc_a, std::uint32_t crc_b, std::uint64_t size_b);

}  // namespace mimesis::log
