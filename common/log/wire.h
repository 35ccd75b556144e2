#pragma once
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace mimesis::log {

static_assert(std::endian::native == std::endian::little,
              "MCAP is little-endian, as are our machines");

/// Appends MCAP's primitive types to a buffer: little-endian integers, byte strings with their
/// length.
class Encoder {
 public:
  explicit Encoder(std::string& out) : out_(out) {}

  template <class Integer>
  void integer(Integer value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    out_.append(bytes, sizeof value);
  }
  void raw(std::string_view bytes) { out_.append(bytes); }
  void string(std::string_view bytes) {  ///< with a length of 32 bits
    integer(static_cast<std::uint32_t>(bytes.size()));
    raw(bytes);
  }

 private:
  std::string& out_;
};

/// Reads the same types back from memory it does not trust. After a read beyond the end every value
/// is zero or empty and `ok` is false: check once, at the end.
class Decoder {
 public:
  explicit Decoder(std::string_view bytes) : rest_(bytes) {}

  template <class Integer>
  Integer integer() {
    Integer value{};
    const std::string_view bytes = raw(sizeof value);
    if (ok_) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  std::string_view raw(std::uint64_t size) {
    if (!ok_ || size > rest_.size()) {
      ok_ = false;
      return {};
    }
    const std::string_view bytes = rest_.substr(0, static_cast<std::size_t>(size));
    rest_.remove_prefix(bytes.size());
    return bytes;
  }
  std::string_view string() { return raw(integer<std::uint32_t>()); }  ///< with a length of 32 bits
  std::string_view rest() { return raw(rest_.size()); }

  bool ok() const { return ok_; }
  std::size_t left() const { return rest_.size(); }

 private:
  std::string_view rest_;
  bool ok_ = true;
};

}  // namespace mimesis::log
