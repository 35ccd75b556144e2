#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/mimesis/log/replay_compare.h"
#include "tools/mimesis/log/replay_life.h"

namespace mimesis::tool {

/// Where a replay is not what the log says.
struct ReplayDifference {
  std::optional<std::uint64_t> step;  ///< of one node; nothing in the replay of a graph
  double time_s = 0.0;                ///< graph time
  std::string what;                   ///< one line: "planner/command #83: 2 fields differ"
  std::string topic;                  ///< of a message, else empty
  std::uint64_t seq = 0;
  MessageDifference fields;  ///< recorded and replayed values
};

/// What was compared in all steps.
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
