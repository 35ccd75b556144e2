#pragma once
#include <cstring>
#include <memory>

namespace mimesis::log {

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
  std::size_t capacity() const { return capacity_; }

 private:
  std::unique_ptr<char[]> bytes_;
  std::size_t capacity_ = 0;
};

}  // namespace mimesis::log
