#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "proto/steps.pb.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/log/replay_inputs.h"

namespace mimesis::tool {

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

}  // namespace mimesis::tool
