#pragma once
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace mimesis::log {

inline constexpr std::size_t kRecordHead = 9;  ///< opcode and length

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

/// Writes opcode and length around what is appended during its life; `beyond` bytes follow later.
class RecordFrame {
 public:
  RecordFrame(std::string& out, char opcode, std::uint64_t beyond = 0)
      : out_(out), start_(out.size()), beyond_(beyond) {
    out_.push_back(opcode);
    out_.append(8, '\0');
  }
  ~RecordFrame() {
    const std::uint64_t length = out_.size() - start_ - kRecordHead + beyond_;
    std::memcpy(out_.data() + start_ + 1, &length, sizeof length);
  }
  RecordFrame(const RecordFrame&) = delete;
  RecordFrame& operator=(const RecordFrame&) = delete;

 private:
  std::string& out_;
  std::size_t start_;
  std::uint64_t beyond_;
};

/// An integer, a string, or a map or list of pairs: its size in bytes, then its elements.
template <class T>
void put(std::string& out, const T& value) {
  if constexpr (requires { value.substr(0); }) {
    Encoder(out).string(value);
  } else if constexpr (requires { value.begin(); }) {
    const std::size_t start = out.size();
    out.append(4, '\0');
    for (const auto& [first, second] : value) {
      put(out, first);
      put(out, second);
    }
    const auto bytes = static_cast<std::uint32_t>(out.size() - start - 4);
    std::memcpy(out.data() + start, &bytes, sizeof bytes);
  } else {
    Encoder(out).integer(value);
  }
}

/// False if the value does not end where it should.
template <class T>
bool take(Decoder& d, T& value) {
  if constexpr (requires { value.substr(0); }) {
    value = d.string();
  } else if constexpr (requires { value.clear(); }) {
    using Pair = typename T::value_type;
    value.clear();
    Decoder elements(d.string());
    while (elements.left() > 0 && elements.ok()) {
      std::remove_const_t<typename Pair::first_type> first;
      typename Pair::second_type second;
      take(elements, first);
      take(elements, second);
      if constexpr (requires { typename T::key_type; }) {
        value.insert_or_assign(std::move(first), std::move(second));
      } else {
        value.emplace_back(std::move(first), std::move(second));
      }
    }
    return elements.ok();
  } else {
    value = d.integer<T>();
  }
  return true;
}

}  // namespace mimesis::log
