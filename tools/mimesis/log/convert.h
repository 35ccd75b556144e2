#pragma once
#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "proto/can.pb.h"
#include "tools/mimesis/log/new_log.h"

namespace mimesis::tool {

/// Kind of a file, by its first bytes.
enum class LogKind { mcap, candump, lcm };

/// @throws ConfigError for other kinds: it names the kind and its converter.
LogKind detect_kind(const log::Source& source, const std::string& path);

struct ConvertOptions {
  std::string input = {};
  OutputOptions output = {};  ///< path "-": standard output, for candump
  std::string from = {};      ///< "candump" or "lcm" instead of detection
  std::string compression = "zstd";
  bool json = false;
};

struct ConvertResult {
  LogKind from = LogKind::mcap;
  std::uint64_t messages = 0;
  std::uint64_t damages = 0;  ///< lines or places that could not be read; each was reported
  std::uint64_t lost = 0;     ///< LCM: events dropped by the logger, found by their numbers
  std::uint64_t untimed = 0;  ///< candump: lines without a time, which took that of the line before
};

/// candump -> MCAP: mimesis.v1.CanFrame on can/INTERFACE. LCM -> MCAP: the payloads as they are,
/// encoding "lcm", the type's fingerprint as metadata of the channel. MCAP -> candump: all messages
/// of type mimesis.v1.CanFrame.
/// @throws ConfigError if the input is of no such kind or the output cannot be written.
ConvertResult convert_log(const log::Source& source, const ConvertOptions& options);

/// One line of can-utils: of a log (`candump -l`, `-L`): "(1436509052.249713) vcan0
/// 044#2A366C2BBA", with "##" and flags for CAN FD, "#R" for remote requests; or as candump shows
/// it on a terminal: "  vcan0  044   [5]  2A 36 6C 2B BA", with or without a time. The header of
/// the frame stays empty.
struct CandumpLine {
  std::optional<std::uint64_t> time_ns;  ///< nothing: the line has none
  v1::CanFrame frame;
};

/// Empty for lines without a frame: empty ones, and explanations of `candump -e`. The reason of a
/// failure names the place and the expected text.
tl::expected<std::optional<CandumpLine>, Status> parse_candump(std::string_view line);

/// A line of a log, as `candump -l` writes it, without its end. Times are cut to microseconds.
std::string candump_line(std::uint64_t time_ns, const v1::CanFrame& frame);

/// One event of an LCM log. Wire, big-endian: sync word 0xEDA1DA01, event number (8 bytes), time
/// (8) [µs], length of the channel's name (4), of the data (4), name, data. Data of LCM types start
/// with the fingerprint of the type (8).
struct LcmEvent {
  std::uint64_t number = 0;
  std::uint64_t time_ns = 0;
  std::string_view channel, data;  ///< until the next call
};

/// Reads an LCM log from front to back. LCM has no sums: an event is delivered only if another one,
/// or the end of the file, follows at the place given by its lengths. After damage reading
/// continues at the next such event.
class LcmReader {
 public:
  explicit LcmReader(const log::Source& source) : source_(source), window_(source) {}
  /// The next event, or nothing at the end.
  std::optional<LcmEvent> next() {
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
      const std::string_view ahead = view(position_ + 1, kSearchBlock);
      const std::size_t found = ahead.find(kLcmSync);
      if (found != ahead.npos) {
        position_ += 1 + found;
      } else if (ahead.size() < kSearchBlock) {
        position_ = size;
      } else {
        position_ += 1 + ahead.size() - kLcmSync.size();
      }
    }
    if (damaged) {
      damages_.push_back(
          {from, fmt::format("expected an event, found none up to the end: {} bytes left out",
                             size - from)});
    }
    return std::nullopt;
  }

  std::uint64_t position() const { return position_; }  ///< behind the event [bytes]
  const std::vector<log::Damage>& damages() const { return damages_; }
  /// Event numbers that were passed over without damage: dropped when the log was written.
  std::uint64_t lost() const { return lost_; }

 private:
  static constexpr std::string_view kLcmSync{"\xED\xA1\xDA\x01", 4};
  static constexpr std::uint64_t kEventHead = 4 + 8 + 8 + 4 + 4;
  static constexpr std::uint64_t kLongestName = 1000;  // LCM's own limit is 63
  static constexpr std::uint64_t kLargestData = 1ull << 28;
  static constexpr std::uint64_t kLatestMicroseconds = 1ull << 53;  // year 2255; more is damage
  static constexpr std::uint64_t kSearchBlock = 1 << 16;

  static std::uint64_t big_endian(std::string_view bytes, std::size_t offset, std::size_t size) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      value = value << 8 | static_cast<unsigned char>(bytes[offset + i]);
    }
    return value;
  }

  std::optional<LcmEvent> event_at(std::uint64_t offset, std::uint64_t& end) {
    const std::string_view head = view(offset, kEventHead);
    if (head.size() < kEventHead || !head.starts_with(kLcmSync)) return std::nullopt;
    LcmEvent event;
    event.number = big_endian(head, 4, 8);
    const std::uint64_t time_us = big_endian(head, 12, 8);
    const std::uint64_t name = big_endian(head, 20, 4), data = big_endian(head, 24, 4);
    if (name > kLongestName || data > kLargestData || time_us > kLatestMicroseconds) {
      return std::nullopt;
    }
    event.time_ns = time_us * 1000;
    end = offset + kEventHead + name + data;
    if (end > source_.size()) return std::nullopt;
    const std::string_view whole = view(offset, end - offset + kLcmSync.size());
    if (whole.size() < end - offset) return std::nullopt;
    // The file may have been cut off within the next sync word.
    if (!kLcmSync.starts_with(whole.substr(static_cast<std::size_t>(end - offset))))
      return std::nullopt;
    event.channel = whole.substr(kEventHead, static_cast<std::size_t>(name));
    event.data =
        whole.substr(kEventHead + static_cast<std::size_t>(name), static_cast<std::size_t>(data));
    return event;
  }

  std::string_view view(std::uint64_t offset, std::uint64_t size) {
    return window_.view(offset, static_cast<std::size_t>(size)).value_or(std::string_view{});
  }

  const log::Source& source_;
  log::Window window_;
  std::uint64_t position_ = 0;
  std::optional<std::uint64_t> last_number_;  ///< before damage: nothing
  std::uint64_t lost_ = 0;
  std::vector<log::Damage> damages_;
};

}  // namespace mimesis::tool
