#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/log/codec.h"
#include "common/log/records.h"
#include "tools/mimesis/log/finding.h"

namespace mimesis::tool {

/// Holds the chunks of a log against their heads, the message indexes behind them and the chunk
/// indexes of the summary. Takes the records in the order of the file; `at` is where one stands,
/// `length` its bytes with the head.
class ChunkCheck {
 public:
  explicit ChunkCheck(Findings& findings) : findings_(findings) {}

  void take_chunk(std::uint64_t at, std::uint64_t length, std::string_view content);
  void take_message_index(std::uint64_t at, std::uint64_t length, std::string_view content);
  /// What comes now belongs no longer to the last chunk.
  void leave();
  void take_bare_message(std::uint64_t at) {
    if (!bare_message_) bare_message_ = at;
  }
  void take_chunk_index(std::uint64_t at, std::string_view content);
  std::size_t count() const { return chunks_.size(); }
  void conclude();  ///< behind the footer

 private:
  /// (log_time, offset) of messages in a chunk, by channel.
  using Places = std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>>;
  /// What is known of a chunk from the data.
  struct Facts {
    log::ChunkIndex index;  ///< as it should be
    Places messages;
    bool readable = false;
  };
  void error(std::string_view kind, std::uint64_t offset, std::string what) {
    findings_.add(Severity::error, kind, offset, std::move(what));
  }

  Findings& findings_;
  log::Decompressor decompressor_;
  std::map<std::uint64_t, Facts> chunks_;  ///< by offset
  Facts* open_ = nullptr;                  ///< the chunk whose message indexes follow
  std::set<std::uint64_t> indexed_;
  std::optional<std::uint64_t> bare_message_;
  bool any_index_ = false;
};

}  // namespace mimesis::tool
