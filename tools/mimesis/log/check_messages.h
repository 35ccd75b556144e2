#pragma once
#include <google/protobuf/message.h>

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>

#include "common/log/stream_reader.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/log/finding.h"
#include "tools/mimesis/log/loss_counts.h"
#include "tools/mimesis/log/sequence.h"

namespace mimesis::tool {

/// Sequence numbers by topic, node and start of the node: they go on in the next part of a split
/// recording.
using Sequences = std::map<std::tuple<std::string, std::string, std::string>, Sequence>;

/// Looks at all messages of a log in the order of the file: sums, times, sequence numbers,
/// contents.
class MessageCheck {
 public:
  MessageCheck(const log::Source& source, Sequences& sequences, Findings& findings);

  /// One record on; false at the end. Then `conclude`.
  bool next();
  std::uint64_t offset() const { return reader_.offset(); }
  void conclude();

  std::uint64_t messages() const { return statistics_.message_count; }
  const log::Statistics& statistics() const { return statistics_; }  ///< of what was read
  /// Of metadata "mimesis.split": key -> value, empty if it has none.
  const std::map<std::string, std::string>& split() const { return split_; }
  bool is_log() const { return is_log_; }

 private:
  struct Tally {  ///< of one kind of finding on one channel
    std::uint64_t times = 0, sum = 0;
    std::uint64_t first_offset = 0;
    std::string first;
    void add(std::uint64_t offset, std::uint64_t amount, const std::string& text);
  };
  struct ChannelState {
    std::string name;  ///< "topic (node)"
    const log::Channel* channel = nullptr;
    Sequence* sequence = nullptr;
    bool ours = false, latched = false;
    bool unknown_fields = false;
    std::uint64_t messages = 0, repeats = 0;
    std::uint64_t last_time = 0;
    Tally gap, repeat, back, disorder, invalid;
  };
  void take_message(const log::Message& message);
  void check_sequence(const log::Message& message, ChannelState& state);
  void check_content(const log::Message& message, ChannelState& state);
  void take_schema(const log::Schema& schema);
  void take_channel(const log::Channel& channel);
  ChannelState& state_of(std::uint16_t id);
  void report(const ChannelState& state);
  void check_statistics(const log::Statistics& stored);
  void check_losses();

  const log::Source& source_;
  Sequences& sequences_;
  Findings& findings_;
  log::StreamReader reader_;
  runtime::TypePool types_;  // before the messages that it makes
  std::map<std::uint16_t, std::unique_ptr<google::protobuf::Message>> prototypes_;  ///< by schema
  std::map<std::uint16_t, ChannelState> states_;
  std::map<std::string, std::string> definitions_;  ///< of schemas, by name
  log::Statistics statistics_;
  std::uint64_t last_time_ = 0;
  Tally disorder_;
  LossCounts losses_;
  bool recovered_ = false;  ///< from a damaged log: what is missing is known
  bool has_losses_ = false, in_summary_ = false, is_log_ = false;
  std::map<std::string, std::string> split_;
};

}  // namespace mimesis::tool
