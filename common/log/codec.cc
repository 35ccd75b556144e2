#include "common/log/codec.h"

#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

namespace mimesis::log {
namespace {

constexpr int kZstdLevel = 1;  // about eight times as fast as lz4's level 9, and smaller

/// Memory that is not cleared before use, and kept.
class Scratch {
 public:
  char* reserve(std::size_t size) {
    if (size > capacity_) {
      bytes_ = std::make_unique_for_overwrite<char[]>(size);
      capacity_ = size;
    }
    return bytes_.get();
  }

 private:
  std::unique_ptr<char[]> bytes_;
  std::size_t capacity_ = 0;
};

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
  ZSTD_CCtx* zstd = nullptr;
  Scratch out;
};

Compressor::Compressor(Compression compression) : impl_(std::make_unique<Impl>()) {
  impl_->compression = compression;
  if (compression == Compression::zstd) impl_->zstd = ZSTD_createCCtx();
}

Compressor::~Compressor() { ZSTD_freeCCtx(impl_->zstd); }

tl::expected<std::string_view, Status> Compressor::run(std::string_view bytes) {
  if (impl_->compression == Compression::zstd) {
    const std::size_t bound = ZSTD_compressBound(bytes.size());
    char* out = impl_->out.reserve(bound);
    const std::size_t n =
        ZSTD_compressCCtx(impl_->zstd, out, bound, bytes.data(), bytes.size(), kZstdLevel);
    if (ZSTD_isError(n)) return failed("zstd", ZSTD_getErrorName(n));
    return std::string_view(out, n);
  }
  if (impl_->compression == Compression::lz4) {
    LZ4F_preferences_t preferences = LZ4F_INIT_PREFERENCES;
    preferences.frameInfo.blockSizeID = LZ4F_max1MB;
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
  Scratch out;
};

Decompressor::Decompressor() : impl_(std::make_unique<Impl>()) {}

Decompressor::~Decompressor() {
  ZSTD_freeDCtx(impl_->zstd);
  LZ4F_freeDecompressionContext(impl_->lz4);
}

tl::expected<std::string_view, Status> Decompressor::run(Compression compression,
                                                         std::string_view bytes, std::size_t size) {
  if (compression == Compression::none) {
    if (bytes.size() == size) return bytes;
    return failed("uncompressed records",
                  fmt::format("{} bytes instead of {}", bytes.size(), size));
  }
  char* out = impl_->out.reserve(size);
  std::size_t produced = 0;
  if (compression == Compression::zstd) {
    if (impl_->zstd == nullptr) impl_->zstd = ZSTD_createDCtx();
    produced = ZSTD_decompressDCtx(impl_->zstd, out, size, bytes.data(), bytes.size());
    if (ZSTD_isError(produced)) return failed("zstd", ZSTD_getErrorName(produced));
  } else {
    if (impl_->lz4 == nullptr) {
      const auto error = LZ4F_createDecompressionContext(&impl_->lz4, LZ4F_VERSION);
      if (LZ4F_isError(error)) return failed("lz4", LZ4F_getErrorName(error));
    }
    LZ4F_resetDecompressionContext(impl_->lz4);
    std::size_t consumed = 0, hint = 1;
    while (consumed < bytes.size() && hint != 0) {
      std::size_t to = size - produced, from = bytes.size() - consumed;
      hint =
          LZ4F_decompress(impl_->lz4, out + produced, &to, bytes.data() + consumed, &from, nullptr);
      if (LZ4F_isError(hint)) return failed("lz4", LZ4F_getErrorName(hint));
      if (to == 0 && from == 0) break;  // no room for more output
      produced += to;
      consumed += from;
    }
    if (hint != 0) return failed("lz4", "the frame has no end, or is larger than its chunk says");
  }
  if (produced == size) return std::string_view(out, size);
  return failed(wire_name(compression), fmt::format("{} bytes instead of {}", produced, size));
}

}  // namespace mimesis::log
