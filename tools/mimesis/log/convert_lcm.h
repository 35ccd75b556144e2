#pragma once
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "common/log/io.h"
#include "common/log/stream_reader.h"

namespace mimesis::tool {

/// One event of an LCM log. Wire, big-endian: sync word 0xEDA1DA01, event number (8 bytes), time
/// (8) [µs], length of the channel's name (4), of the data (4), name, data. Data of LCM types start
/// with the fingerprint of the type (8).
struct LcmEvent {
  std::uint64_t number = 0;
  std::uint64_t time_ns = 0;
  std::string_view channel, data;  ///< until the next call
};

/// Reads an LCM log from front to back. LCM has no sums: an event is delivered only if another one,
/// or the end of the file, follows where its lengths say. After damage reading goes on at the next
/// event of which that holds.
class LcmReader {
 public:
  explicit LcmReader(const log::Source& source) : source_(source), window_(source) {}
  /// The next event, or nothing at the end.
  std::optional<LcmEvent> next();

  std::uint64_t position() const { return position_; }  ///< behind the event [bytes]
  const std::vector<log::Damage>& damages() const { return damages_; }
  /// Event numbers that were passed over without damage: dropped when the log was written.
  std::uint64_t lost() const { return lost_; }

 private:
  std::optional<LcmEvent> event_at(std::uint64_t offset, std::uint64_t& end);
  std::string_view view(std::uint64_t offset, std::uint64_t size);

  const log::Source& source_;
  log::Window window_;
  std::uint64_t position_ = 0;
  std::optional<std::uint64_t> last_number_;  ///< before damage: nothing
  std::uint64_t lost_ = 0;
  std::vector<log::Damage> damages_;
};

}  // namespace mimesis::tool
