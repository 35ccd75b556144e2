#pragma once
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/mimesis/log/message_diff.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

struct DiffOptions {
  std::function<bool(const std::string& topic)> topic = {};  ///< null: all
  double tolerance = 0.0;                                    ///< DiffRules::tolerance
  std::vector<std::string> field_tolerances = {};            ///< "TOPIC.FIELD=X"
  std::vector<std::string> ignore = {};                      ///< "TOPIC.FIELD"
  bool times = false;       ///< log and publish times must be equal, too
  bool wall_fields = true;  ///< compare durations on the wall clock (wall_fields())
  std::uint64_t end_ns = std::numeric_limits<std::uint64_t>::max();  ///< log time of the end
};

/// Topics that differ between equal runs, or that describe the run: those of the runtime.
bool is_runtime_topic(const std::string& topic);

/// Messages of one publisher on one topic in two logs. They are matched by sequence number, or by
/// their order if they have none.
struct StreamDiff {
  std::string topic, node;
  std::string type_a, type_b;  ///< empty: not there, or without a schema
  std::uint64_t a = 0, b = 0;  ///< messages
  std::uint64_t equal = 0, differing = 0;
  std::uint64_t only_a = 0, only_b = 0;
  struct First {
    std::uint64_t sequence = 0;
    std::uint64_t time_a_ns = 0, time_b_ns = 0;  ///< log times
    MessageDifference difference;
  };
  std::optional<First> first = {};  ///< first of the differing pairs
  WorstDifferences worst = {};

  bool same() const {
    return differing == 0 && only_a == 0 && only_b == 0 && (type_a == type_b || a == 0 || b == 0);
  }
};

/// The rules of one topic from options. @throws ConfigError with a suggestion if a log has no such
/// topic or field.
std::map<std::string, DiffRules> diff_rules(const DiffOptions& options, const OpenLog& a,
                                            const OpenLog& b);

/// Compares two logs, by topic and node. Messages that wait for their counterpart are held in
/// memory: as many as one log is ahead of the other in its time.
std::vector<StreamDiff> diff_logs(const OpenLog& a, const OpenLog& b, const DiffOptions& options,
                                  std::uint64_t& damages);

// Comparison of two runs of a graph in lock-step.

/// Up to when a recorded run is the same in every run.
struct RunLimit {
  std::uint64_t until_ns = 0;  ///< last log time to be compared
  std::string why;             ///< reason of the end
  bool cut_off = false;        ///< just the end of the log: its last messages may be incomplete
};

/// After the first message on `until_topic` (may be empty) the launcher stops the nodes, in wall
/// time; without one, the first node that stopped ends what can be compared.
RunLimit run_limit(const std::vector<OpenLog>& logs, const std::string& until_topic);

/// Fields, by type, that hold durations on the wall clock: they are not the same twice.
const std::map<std::string, std::set<std::string>>& wall_fields();

/// Whether metadata "mimesis.launch" says that the run was in lock-step.
bool in_lockstep(const std::vector<OpenLog>& logs);

}  // namespace mimesis::tool
