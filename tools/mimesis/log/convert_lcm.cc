#include "tools/mimesis/log/convert_lcm.h"

#include <fmt/format.h>

#include <algorithm>

namespace mimesis::tool {
namespace {

constexpr std::string_view kSync{"\xED\xA1\xDA\x01", 4};
constexpr std::uint64_t kHead = 4 + 8 + 8 + 4 + 4;
constexpr std::uint64_t kLongestName = 1000;  // LCM's own limit is 63
constexpr std::uint64_t kLargestData = 1ull << 28;
constexpr std::uint64_t kLatestMicroseconds = 1ull << 53;  // year 2255; more is damage
constexpr std::uint64_t kBlock = 1 << 16;

std::uint64_t big_endian(std::string_view bytes, std::size_t offset, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) {
    value = value << 8 | static_cast<unsigned char>(bytes[offset + i]);
  }
  return value;
}

}  // namespace

std::string_view LcmReader::view(std::uint64_t offset, std::uint64_t size) {
  return window_.view(offset, static_cast<std::size_t>(size)).value_or(std::string_view{});
}

std::optional<LcmEvent> LcmReader::event_at(std::uint64_t offset, std::uint64_t& end) {
  const std::string_view head = view(offset, kHead);
  if (head.size() < kHead || !head.starts_with(kSync)) return std::nullopt;
  LcmEvent event;
  event.number = big_endian(head, 4, 8);
  const std::uint64_t time_us = big_endian(head, 12, 8);
  const std::uint64_t name = big_endian(head, 20, 4), data = big_endian(head, 24, 4);
  if (name > kLongestName || data > kLargestData || time_us > kLatestMicroseconds) {
    return std::nullopt;
  }
  event.time_ns = time_us * 1000;
  end = offset + kHead + name + data;
  if (end > source_.size()) return std::nullopt;
  const std::string_view whole = view(offset, end - offset + kSync.size());
  if (whole.size() < end - offset) return std::nullopt;
  // The file may have been cut off within the next sync word.
  if (!kSync.starts_with(whole.substr(static_cast<std::size_t>(end - offset)))) return std::nullopt;
  event.channel = whole.substr(kHead, static_cast<std::size_t>(name));
  event.data = whole.substr(kHead + static_cast<std::size_t>(name), static_cast<std::size_t>(data));
  return event;
}

std::optional<LcmEvent> LcmReader::next() {
  const std::uint64_t size = source_.size(), from = position_;
  bool damaged = false;
  while (position_ < size) {
    std::uint64_t end = 0;
    if (const auto event = event_at(position_, end)) {
      if (damaged) {
        damages_.push_back({from, fmt::format("expected an event, found none before byte {}: {} "
                                              "bytes left out",
                                              position_, position_ - from)});
      } else if (last_number_ && event->number > *last_number_ + 1) {
        lost_ += event->number - *last_number_ - 1;
      }
      last_number_ = event->number;
      position_ = end;
      return event;
    }
    damaged = true;
    // On to the next sync word.
    const std::string_view ahead = view(position_ + 1, kBlock);
    const std::size_t found = ahead.find(kSync);
    if (found != ahead.npos) {
      position_ += 1 + found;
    } else if (ahead.size() < kBlock) {
      position_ = size;
    } else {
      position_ += 1 + ahead.size() - kSync.size();
    }
  }
  if (damaged) {
    damages_.push_back(
        {from, fmt::format("expected an event, found none up to the end: {} bytes left out",
                           size - from)});
  }
  return std::nullopt;
}

}  // namespace mimesis::tool
