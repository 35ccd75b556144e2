#include "common/runtime/wire.h"

#include <endian.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message.h>

#include <array>
#include <cstring>

namespace mimesis::runtime {
namespace {

constexpr std::size_t kWords = 5;
constexpr std::size_t kHeaderSize = kWords * sizeof(std::uint64_t);
constexpr char kHelloMark = '\xff';  // no topic begins with it: it is not UTF-8

using Words = std::array<std::uint64_t, kWords>;

Words to_words(const WireHeader& h) {
  Words words{h.seq, static_cast<std::uint64_t>(h.stamp.count()), h.type_hash, h.start_id, h.tick};
  for (std::uint64_t& w : words) w = htole64(w);
  return words;
}

}  // namespace

std::string encode_frame(std::string_view topic, const WireHeader& header) {
  std::string frame = subscription(topic);
  frame.resize(frame.size() + kHeaderSize);
  rewrite_header(frame, header);
  return frame;
}

void rewrite_header(std::string& frame, const WireHeader& header) {
  const Words words = to_words(header);
  std::memcpy(frame.data() + frame.size() - kHeaderSize, words.data(), kHeaderSize);
}

std::optional<WireMessage> decode_frame(std::string_view frame) {
  // The header may hold NULs, the topic may not: the separator is the first one.
  const std::size_t nul = frame.find('\0');
  if (nul == std::string_view::npos || nul == 0 || frame.size() != nul + 1 + kHeaderSize) {
    return std::nullopt;
  }
  Words words;
  std::memcpy(words.data(), frame.data() + nul + 1, kHeaderSize);
  for (std::uint64_t& w : words) w = le64toh(w);
  WireHeader h;
  h.seq = words[0];
  h.stamp = Time(static_cast<std::int64_t>(words[1]));
  h.type_hash = words[2];
  h.start_id = words[3];
  h.tick = words[4];
  if (h.seq == 0) return std::nullopt;
  return WireMessage{frame.substr(0, nul), h};
}

std::string subscription(std::string_view topic) {
  std::string s;
  s.reserve(topic.size() + 1 + kHeaderSize);
  s.append(topic).push_back('\0');
  return s;
}

std::string hello(std::uint64_t start_id) {
  const std::uint64_t word = htole64(start_id);
  std::string s(1 + sizeof word, kHelloMark);
  std::memcpy(s.data() + 1, &word, sizeof word);
  return s;
}

std::optional<std::uint64_t> decode_hello(std::string_view subscription) {
  std::uint64_t word = 0;
  if (subscription.size() != 1 + sizeof word || subscription[0] != kHelloMark) return std::nullopt;
  std::memcpy(&word, subscription.data() + 1, sizeof word);
  return le64toh(word);
}

std::string missed(std::uint64_t publisher_start_id, std::uint64_t messages) {
  return hello(publisher_start_id) + hello(messages).substr(1);
}

std::optional<std::uint64_t> decode_missed(std::string_view subscription,
                                           std::uint64_t publisher_start_id) {
  const std::string head = hello(publisher_start_id);
  if (!subscription.starts_with(head)) return std::nullopt;
  return decode_hello(kHelloMark + std::string(subscription.substr(head.size())));
}

void serialise(const google::protobuf::Message& message, void* out, std::size_t size) {
  google::protobuf::io::ArrayOutputStream array(out, static_cast<int>(size));
  google::protobuf::io::CodedOutputStream coded(&array);
  coded.SetSerializationDeterministic(true);
  message.SerializeWithCachedSizes(&coded);
}

}  // namespace mimesis::runtime
