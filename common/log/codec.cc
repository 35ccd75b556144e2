#include "common/log/codec.h"

#include <fmt/format.h>
#include <libdeflate.h>
#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>

#include "common/log/io.h"

namespace mimesis::log {
namespace {

constexpr std::size_t kEager = 16 << 20;  // memory taken before data arrived [bytes]
constexpr std::size_t kFailed = ~std::size_t{0};

/// Size of the blocks of an LZ4 frame, as its head says.
std::size_t lz4_block(std::string_view frame) {
  const unsigned id = frame.size() > 5 ? static_cast<unsigned char>(frame[5]) >> 4 & 7u : 0;
  return id < 4 ? 0 : std::size_t{1} << (8 + 2 * id);  // 64 kB, 256 kB, 1 MB, 4 MB
}

tl::unexpected<Status> failed(std::string_view what, std::string_view why) {
  return tl::unexpected(Status{fmt::format("{}: {}", what, why)});
}

}  // namespace

std::string_view wire_name(Compression compression) {
  switch (compression) {
    case Compression::lz4:
      return "lz4";
    case Compression::zstd:
      return "zstd";
    case Compression::none:
      break;
  }
  return "";
}

std::optional<Compression> parse_compression(std::string_view name) {
  if (name.empty() || name == "none") return Compression::none;
  if (name == "lz4") return Compression::lz4;
  if (name == "zstd") return Compression::zstd;
  return std::nullopt;
}

struct Compressor::Impl {
  Compression compression;
  int zstd_level;
  ZSTD_CCtx* zstd = nullptr;
  Buffer out;
};

Compressor::Compressor(Compression compression, int zstd_level) : impl_(std::make_unique<Impl>()) {
  impl_->compression = compression;
  impl_->zstd_level = zstd_level;
  if (compression == Compression::zstd) impl_->zstd = ZSTD_createCCtx();
}

Compressor::~Compressor() { ZSTD_freeCCtx(impl_->zstd); }

tl::expected<std::string_view, Status> Compressor::run(std::string_view bytes) {
  if (impl_->compression == Compression::zstd) {
    const std::size_t bound = ZSTD_compressBound(bytes.size());
    char* out = impl_->out.reserve(bound);
    const std::size_t n =
        ZSTD_compressCCtx(impl_->zstd, out, bound, bytes.data(), bytes.size(), impl_->zstd_level);
    if (ZSTD_isError(n)) return failed("zstd", ZSTD_getErrorName(n));
    return std::string_view(out, n);
  }
  if (impl_->compression == Compression::lz4) {
    LZ4F_preferences_t preferences = LZ4F_INIT_PREFERENCES;
    preferences.frameInfo.blockSizeID = LZ4F_max64KB;
    const std::size_t bound = LZ4F_compressFrameBound(bytes.size(), &preferences);
    char* out = impl_->out.reserve(bound);
    const std::size_t n = LZ4F_compressFrame(out, bound, bytes.data(), bytes.size(), &preferences);
    if (LZ4F_isError(n)) return failed("lz4", LZ4F_getErrorName(n));
    return std::string_view(out, n);
  }
  return bytes;
}

struct Decompressor::Impl {
  ZSTD_DCtx* zstd = nullptr;
  LZ4F_dctx* lz4 = nullptr;
  Buffer out;
  std::size_t produced = 0;
  std::string_view reason;  // reason of the last failure

  Result start(Compression compression) {
    produced = 0;
    if (compression == Compression::zstd) {
      if (zstd == nullptr) zstd = ZSTD_createDCtx();
      ZSTD_DCtx_reset(zstd, ZSTD_reset_session_only);
      return {};
    }
    if (lz4 == nullptr) {
      const auto error = LZ4F_createDecompressionContext(&lz4, LZ4F_VERSION);
      if (LZ4F_isError(error)) return failed("lz4", LZ4F_getErrorName(error));
    }
    LZ4F_resetDecompressionContext(lz4);
    return {};
  }
  /// Unpacks block by block into memory that begins with `room` bytes and grows to `limit`; returns
  /// why it ended before the frame did.
  Result stream(Compression compression, std::string_view bytes, std::size_t room,
                std::size_t limit) {
    if (auto done = start(compression); !done) return done;
    std::size_t hint = 1, consumed = 0;
    while (hint != 0) {
      out.reserve(room, produced);
      std::size_t to = room - produced, from = bytes.size() - consumed;
      hint = step(compression, bytes.data() + consumed, from, to);
      if (hint == kFailed) return failed(wire_name(compression), reason);
      const bool stuck = from == 0 && to == 0;
      consumed += from;
      produced += to;
      if (produced == room && room < limit) {
        room = std::min(limit, 2 * room);
      } else if (stuck) {
        return failed(wire_name(compression),
                      "the frame has no end, or is larger than its chunk says");
      }
    }
    return {};
  }

  /// One call of the codec: `from` and `to` become the bytes consumed and produced.
  std::size_t step(Compression compression, const char* in, std::size_t& from, std::size_t& to) {
    char* const at = out.reserve(0) + produced;
    if (compression == Compression::lz4) {
      const std::size_t hint = LZ4F_decompress(lz4, at, &to, in, &from, nullptr);
      if (!LZ4F_isError(hint)) return hint;
      reason = LZ4F_getErrorName(hint);
      return kFailed;
    }
    ZSTD_inBuffer source{in, from, 0};
    ZSTD_outBuffer target{at, to, 0};
    const std::size_t hint = ZSTD_decompressStream(zstd, &target, &source);
    from = source.pos;
    to = target.pos;
    if (!ZSTD_isError(hint)) return hint;
    reason = ZSTD_getErrorName(hint);
    return kFailed;
  }
  std::string_view result() { return {out.reserve(0), produced}; }
};

Decompressor::Decompressor() : impl_(std::make_unique<Impl>()) {}

Decompressor::~Decompressor() {
  ZSTD_freeDCtx(impl_->zstd);
  LZ4F_freeDecompressionContext(impl_->lz4);
}

tl::expected<std::string_view, Status> Decompressor::run(Compression compression,
                                                         std::string_view bytes, std::size_t size) {
  const auto wrong_size = [&](std::size_t is) {
    return failed(
        compression == Compression::none ? "uncompressed records" : wire_name(compression),
        fmt::format("{} bytes instead of {}", is, size));
  };
  if (compression == Compression::none) {
    if (bytes.size() == size) return bytes;
    return wrong_size(bytes.size());
  }
  Impl& d = *impl_;
  // Such ratios are rare: memory then grows with the arriving data.
  const bool doubtful = size > kEager && size / 256 > bytes.size();
  if (doubtful) {
    if (auto done = d.stream(compression, bytes, kEager, size); !done)
      return tl::unexpected(done.error());
  } else if (compression == Compression::zstd) {
    if (auto done = d.start(compression); !done) return tl::unexpected(done.error());
    char* out = d.out.reserve(size);
    d.produced = ZSTD_decompressDCtx(d.zstd, out, size, bytes.data(), bytes.size());
    if (ZSTD_isError(d.produced)) return failed("zstd", ZSTD_getErrorName(d.produced));
  } else {
    // With room for a whole block behind its end lz4 unpacks all of them where they belong.
    const std::size_t room = size + lz4_block(bytes);
    if (auto done = d.stream(compression, bytes, room, room); !done)
      return tl::unexpected(done.error());
  }
  if (d.produced == size) return d.result();
  return wrong_size(d.produced);
}

std::string_view Decompressor::run_beginning(Compression compression, std::string_view bytes,
                                             std::size_t size) {
  if (compression == Compression::none) return bytes.substr(0, size);
  // It ends early: that is why we are here.
  static_cast<void>(impl_->stream(compression, bytes, std::min(size, kEager), size));
  return impl_->result();
}

std::uint32_t crc32(std::uint32_t crc, std::string_view bytes) {
  return ::libdeflate_crc32(crc, bytes.data(), bytes.size());
}

std::uint32_t crc32_join(std::uint32_t crc_a, std::uint32_t crc_b, std::uint64_t size_b) {
  return static_cast<std::uint32_t>(::crc32_combine(crc_a, crc_b, static_cast<z_off_t>(size_b)));
}

}  // namespace mimesis::log
