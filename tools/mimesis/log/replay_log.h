#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "common/log/records.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/log/open_log.h"

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
  /// Messages that one start of a node published on one topic.
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

/// A node from its start to its end, as logs tell it. A restarted node has several lives.
struct Life {
  v1::NodeStart start;
  std::uint64_t log_time_ns = 0;  ///< of its first message
  std::uint64_t step_logs = 0;    ///< messages on NODE/steps [1]
  std::uint64_t other_steps = 0;  ///< on this topic of starts unknown: old logs do not tell [1]

  const std::string& node() const { return start.node(); }
  /// Graph time for people [s]: on the wall clock since the node's start.
  double seconds(std::uint64_t time_ns) const;
};

/// Every life in the logs that left a NODE/start, in order of time.
std::vector<Life> find_lives(const std::vector<OpenLog>& logs);

/// `start_of` as a number; 0 in older logs.
std::uint64_t start_id_of(const log::Channel& channel);

/// One step with all that belongs to it.
struct RecordedStep {
  std::uint64_t number = 0;  ///< 0: the constructor
  v1::StepRecord record;
  std::vector<v1::InputSource> sources;  ///< of record.taken
};

/// Reads the steps of one life, front to back in one pass. Holds only what steps still to come may
/// need: inputs as long as a step may take them, outputs until they are asked for. Messages may
/// stand some seconds behind the step they belong to: others received them first.
class LifeReader {
 public:
  /// Both outlive the reader.
  LifeReader(const std::vector<OpenLog>& logs, const Life& life,
             std::size_t most_input_bytes = kMostInputBytes);

  /// Next step; nothing at the end of what can be replayed: see `problem`.
  std::optional<RecordedStep> next();
  /// Why there are no more steps though there should be; empty at the end of the life.
  const std::string& problem() const { return problem_; }

  /// A message that the step just returned took, or null if it is not in the log. In the order of
  /// `taken`; valid until the next call.
  const KeptMessage* input(const v1::InputSource& source, std::uint64_t seq);
  /// An output of the life, or null; valid until the next call. Earlier ones of the topic are let
  /// go then.
  const KeptMessage* output(const std::string& topic, std::uint64_t seq);
  /// The log holds this topic as one of this life; messages of it may be missing all the same.
  bool has_output(const std::string& topic) const { return outputs_.contains(topic); }
  bool has_input(const v1::InputSource& source) const {
    return inputs_.has_publisher(source.topic(), source.start_id());
  }
  /// The input was in the log, but too many bytes of inputs waited for a step.
  bool was_let_go(const v1::InputSource& source, std::uint64_t seq) const {
    return inputs_.was_let_go(source, seq);
  }
  /// The first recorded output that no step has asked for up to now, if it is not later than the
  /// step just returned; null if there is none.
  const KeptMessage* unclaimed(std::string& topic) const;

  std::uint64_t log_time_ns() const { return log_time_ns_; }  ///< read so far
  std::vector<log::Damage> damages() const;

 private:
  /// Messages of one output, by seq.
  struct Track {
    std::map<std::uint64_t, KeptMessage> messages;
    std::uint64_t done = 0;  ///< up to this seq nothing is needed any more
  };

  log::Selection selection();
  bool read();  ///< one message of the log; false at its end
  void read_step_log(const log::Message& message);
  bool next_step_log();
  std::string no_step_log() const;
  std::string wrong_number() const;
  bool makes_sense(const v1::StepRecord& step);
  const KeptMessage* find(const std::function<const KeptMessage*()>& kept);
  void forget();

  const std::vector<OpenLog>& logs_;
  const Life& life_;
  WaitingInputs inputs_;
  std::map<std::string, Track> outputs_;                        ///< by topic
  v1::StepLog step_log_;                                        ///< whose steps are being returned
  std::uint64_t step_log_time_ns_ = 0;                          ///< when it was received
  int next_step_ = 0;                                           ///< in it
  std::vector<std::pair<std::uint64_t, v1::StepLog>> waiting_;  ///< read ahead
  std::uint64_t next_number_ = 0;
  std::uint64_t step_logs_read_ = 0, step_logs_unreadable_ = 0;
  std::uint64_t last_step_log_seq_ = 0;
  v1::StepKind last_kind_ = v1::STEP_KIND_UNSPECIFIED;
  std::uint64_t log_time_ns_ = 0;
  std::string problem_;
  log::MergedReader reader_;
};

/// Topic and node that publishes on it.
using TopicOfNode = std::pair<std::string, std::string>;

/// The messages of a recorded run in the order of each topic of each node, read as they are asked
/// for. Without the topics that every node has about itself.
class RecordedRun {
 public:
  /// @param until_ns  last log time that counts. The logs outlive the object.
  RecordedRun(const std::vector<OpenLog>& logs, std::uint64_t until_ns);

  bool has(const TopicOfNode& key) const { return waiting_.contains(key); }
  /// The next one if its log time is `time_ns` at most (or it was read already), or nothing.
  std::optional<KeptMessage> next(const TopicOfNode& key, std::uint64_t time_ns);
  /// All were asked for.
  bool finished();
  /// The earliest that was not asked for; null if there is none. Reads no further.
  const KeptMessage* earliest(TopicOfNode& key) const;

  std::uint64_t log_time_ns() const { return log_time_ns_; }  ///< read so far
  std::size_t topics() const { return waiting_.size(); }

 private:
  struct Track {
    std::deque<KeptMessage> messages;
    std::map<std::uint64_t, std::uint64_t> last_seq;  ///< by start_id
  };
  bool read();

  std::map<TopicOfNode, Track> waiting_;
  std::size_t waiting_count_ = 0;
  std::uint64_t log_time_ns_ = 0;
  log::MergedReader reader_;
};

/// Up to when a recorded run is the same in every run.
struct RunLimit {
  std::uint64_t until_ns = 0;  ///< last log time to be compared
  std::string why;             ///< what happened then
  bool cut_off = false;        ///< just the end of the log: its last messages may be incomplete
};

/// After the first message on `until_topic` (may be empty) the launcher stops the nodes, in wall
/// time; without one, the first node that stopped ends what can be compared.
RunLimit run_limit(const std::vector<OpenLog>& logs, const std::string& until_topic);

}  // namespace mimesis::tool
