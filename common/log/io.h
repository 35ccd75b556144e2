#pragma once
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "common/error.h"

namespace mimesis::log {

using Result = tl::expected<void, Status>;

/// Where a writer's bytes go.
class Sink {
 public:
  virtual ~Sink() = default;
  [[nodiscard]] virtual Result write(std::string_view bytes) = 0;
  /// Hands everything written to the operating system: it survives the process's death.
  [[nodiscard]] virtual Result flush() = 0;
  /// Flushes and waits until the data is on the disk: it survives a power cut. Sinks without a disk
  /// only flush.
  [[nodiscard]] virtual Result sync() { return flush(); }
  /// Last call.
  [[nodiscard]] virtual Result close() = 0;
};

/// Random access to the bytes of a log.
class Source {
 public:
  virtual ~Source() = default;
  virtual std::uint64_t size() const = 0;
  /// Fills `out` from `offset`; fewer bytes than `size` only at the end.
  [[nodiscard]] virtual tl::expected<std::size_t, Status> read(std::uint64_t offset, char* out,
                                                               std::size_t size) const = 0;
};

/// A new file that its owner alone may read (logs hold pictures); one that exists is replaced and
/// keeps its mode. It is locked while it is open: fails if another process writes it.
tl::expected<std::unique_ptr<Sink>, Status> create_file(const std::string& path);
/// An existing file; its size is taken now.
tl::expected<std::unique_ptr<Source>, Status> open_file(const std::string& path);

/// Appends to a string.
class MemorySink final : public Sink {
 public:
  explicit MemorySink(std::string& bytes) : bytes_(bytes) {}
  Result write(std::string_view bytes) override;
  Result flush() override { return {}; }
  Result close() override { return {}; }

 private:
  std::string& bytes_;
};

/// Reads bytes that outlive it.
class MemorySource final : public Source {
 public:
  explicit MemorySource(std::string_view bytes) : bytes_(bytes) {}
  std::uint64_t size() const override { return bytes_.size(); }
  tl::expected<std::size_t, Status> read(std::uint64_t offset, char* out,
                                         std::size_t size) const override;

 private:
  std::string_view bytes_;
};

/// Memory that is not cleared before use, and kept: untouched parts cost nothing.
class Buffer {
 public:
  /// At least `size` bytes; the first `kept` of the former ones stay.
  char* reserve(std::size_t size, std::size_t kept = 0) {
    if (size > capacity_) {
      auto larger = std::make_unique_for_overwrite<char[]>(size);
      if (kept > 0) std::memcpy(larger.get(), bytes_.get(), kept);
      bytes_ = std::move(larger);
      capacity_ = size;
    }
    return bytes_.get();
  }

 private:
  std::unique_ptr<char[]> bytes_;
  std::size_t capacity_ = 0;
};

/// A window that slides over a Source, reading ahead.
class Window {
 public:
  explicit Window(const Source& source) : source_(source) {}
  /// The bytes [offset, offset + size), fewer at the end of the source; valid until the next call.
  tl::expected<std::string_view, Status> view(std::uint64_t offset, std::size_t size);

 private:
  const Source& source_;
  Buffer buffer_;
  std::size_t filled_ = 0;
  std::uint64_t start_ = 0;
};

}  // namespace mimesis::log
