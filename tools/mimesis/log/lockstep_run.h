#pragma once
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tools/mimesis/log/open_log.h"

// Comparison of two runs of a graph in lock-step.
namespace mimesis::tool {

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
