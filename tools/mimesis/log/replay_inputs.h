#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "common/log/records.h"
#include "proto/steps.pb.h"

namespace mimesis::tool {

/// How much later than the step that took it a message may have reached the recorder [ns of log
/// time]. In lock-step there is no such delay; between hosts a second was never seen.
constexpr std::uint64_t kLate = 5'000'000'000;

/// Untaken inputs that are kept at most [bytes]: minutes of images that nobody looks at.
constexpr std::size_t kMostInputBytes = 256'000'000;

/// A message that waits for the step that took or made it.
struct KeptMessage {
  std::string payload;
  std::uint64_t seq = 0;
  std::uint64_t publish_time_ns = 0, log_time_ns = 0;
  const log::Schema* schema = nullptr;  ///< of the log
};

/// Logs keep the lower half of the sequence number.
constexpr std::uint64_t logged_seq(std::uint64_t seq) { return seq & 0xFFFF'FFFFu; }

/// The messages that steps of a node still to come may take. An input that keeps the latest can
/// take one until a newer one has replaced it; a queue may lag behind as far as it likes, so it is
/// bytes that limit what is kept, and what was let go for that is known.
class WaitingInputs {
 public:
  explicit WaitingInputs(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// The node hears `topic` on `port`, which keeps the latest message or (false) all of them.
  void add_port(const std::string& topic, const std::string& port, bool latest);
  bool hears(const std::string& topic) const { return ports_.contains(topic); }
  /// A start of a node publishes on a topic that is heard. After the ports.
  void add_publisher(const std::string& topic, std::uint64_t start_id);
  bool has_publisher(const std::string& topic, std::uint64_t start_id) const;

  /// Nothing if it is not heard, was there already or is no longer needed.
  void keep(const std::string& topic, std::uint64_t start_id, KeptMessage message);
  /// Null if it is not there (yet). Valid until the next call that changes something.
  const KeptMessage* find(const v1::InputSource& source, std::uint64_t seq) const;
  /// A step took it: its port takes no earlier one any more.
  void take(const v1::InputSource& source, std::uint64_t seq);
  /// It was here, but too many bytes waited.
  bool was_let_go(const v1::InputSource& source, std::uint64_t seq) const;
  /// The next steps were received later than `time_ns` (log time): lets go what none can take.
  void forget(std::uint64_t time_ns);

  std::size_t bytes() const { return bytes_; }

 private:
  struct Port {
    bool latest = false;
    std::uint64_t taken = 0;  ///< last seq
  };
  using Ports = std::map<std::string, Port>;
  using Messages = std::map<std::uint64_t, KeptMessage>;  ///< by seq
  /// What one start of a node published on one topic.
  struct Track {
    Ports ports;
    Messages messages;
    std::size_t bytes = 0;
    std::uint64_t done = 0;    ///< up to this seq nothing is needed any more
    std::uint64_t let_go = 0;  ///< up to this seq nothing is kept, needed or not
  };
  using Key = std::pair<std::string, std::uint64_t>;  ///< topic, start_id

  void drop_first(Track& track);
  void limit_bytes();

  std::size_t most_bytes_, bytes_ = 0;
  std::map<std::string, Ports> ports_;  ///< by topic
  std::map<Key, Track> tracks_;
};

}  // namespace mimesis::tool
