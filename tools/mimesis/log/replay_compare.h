#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/mimesis/log/message_diff.h"
#include "tools/mimesis/log/replay_log.h"

namespace mimesis::tool {

/// Largest |recorded - replayed| that was tolerated, by topic and field ("q_rad" for all elements).
using Tolerated = std::map<std::pair<std::string, std::string>, double>;

/// Compares messages of a replay with recorded ones.
class ReplayCompare {
 public:
  /// @param tolerance  floating-point fields may differ by so much; 0: all bytes must be equal
  /// @param ignored    fields that may differ, by type
  explicit ReplayCompare(double tolerance,
                         std::map<std::string, std::set<std::string>> ignored = {})
      : tolerance_(tolerance), ignored_(std::move(ignored)) {}

  /// `schema`: of the recorded one, may be null.
  MessageDifference compare(const std::string& topic, const log::Schema* schema,
                            std::string_view recorded, std::string_view replayed);

  const Tolerated& tolerated() const { return tolerated_; }

 private:
  double tolerance_;
  std::map<std::string, std::set<std::string>> ignored_;
  PayloadDiff payloads_;
  Tolerated tolerated_;
};

/// Where a replay is not what the log says.
struct ReplayDifference {
  std::optional<std::uint64_t> step;  ///< of one node; nothing in the replay of a graph
  double time_s = 0.0;                ///< graph time
  std::string what;                   ///< one line: "planner/command #83: 2 fields differ"
  std::string topic;                  ///< of a message, else empty
  std::uint64_t seq = 0;
  MessageDifference fields;  ///< recorded and replayed values
};

/// Counts of all that was compared.
struct ReplayCounts {
  std::uint64_t steps = 0, inputs = 0, outputs = 0, writes = 0, responses = 0;
  std::uint64_t bytes = 0;  ///< of these messages
};

/// Compares what replayed steps of one life did with the record.
class StepComparison {
 public:
  /// All outlive it.
  StepComparison(const Life& life, LifeReader& reader, ReplayCompare& messages)
      : life_(life), reader_(reader), messages_(messages) {}

  /// All differences of a step, the likely cause first.
  std::vector<ReplayDifference> compare(const RecordedStep& step, const v1::ReplayOutcome& outcome);

  ReplayCounts& counts() { return counts_; }
  const ReplayCounts& counts() const { return counts_; }
  /// Outputs that the log does not hold, by topic: lost, or (all of a topic) left out.
  const std::map<std::string, std::uint64_t>& missing() const { return missing_; }

 private:
  ReplayDifference difference(const RecordedStep& step, std::string what) const;
  void compare_output(const RecordedStep& step, const v1::ReplayMessage& output,
                      std::vector<ReplayDifference>& found);
  void compare_count(const RecordedStep& step, const v1::ReplayOutcome& outcome,
                     std::vector<ReplayDifference>& found);
  void compare_writes(const RecordedStep& step, const v1::ReplayOutcome& outcome,
                      std::vector<ReplayDifference>& found);
  void compare_responses(const RecordedStep& step, const v1::ReplayOutcome& outcome,
                         std::vector<ReplayDifference>& found);

  const Life& life_;
  LifeReader& reader_;
  ReplayCompare& messages_;
  ReplayCounts counts_;
  std::map<std::string, std::uint64_t> missing_;
};

}  // namespace mimesis::tool
