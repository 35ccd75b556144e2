#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/log/summary.h"
#include "tools/mimesis/log/new_log.h"
#include "tools/mimesis/log/sequence.h"

namespace mimesis::tool {

/// A run of sequence numbers of one publisher that is not in the log.
struct MissingRun {
  std::uint32_t first_seq = 0;
  std::uint32_t messages = 0;
  std::uint64_t after_ns = 0, before_ns = 0;  ///< log times of its neighbours
  /// A damaged place of the file lies between the neighbours; false: the recorder had lost them.
  bool damaged = false;
};

struct RecoveredTopic {
  std::string topic, node;
  std::uint64_t messages = 0;
  /// That the file held by its own counts; nothing if these are gone.
  std::optional<std::uint64_t> expected;
  std::vector<MissingRun> missing;
  std::uint64_t last_ns = 0;
  bool placeholder = false;  ///< the definition of the channel is gone

  Sequence sequence;
  std::uint64_t damages_before = 0;  ///< when its last message was read
};

/// What could be read of a log, and what not.
struct Recovered {
  std::map<std::uint16_t, RecoveredTopic> topics;  ///< by id of the channel in the input
  std::vector<log::Damage> damages;
  std::uint64_t damage_count = 0;
  std::uint64_t attachments = 0, metadata = 0;
  bool complete = false;  ///< the input ends as a log does
  bool lost = false;      ///< something that the file held is not in the output
  bool interrupted = false;
};

/// Copies all that can be read from `in` to `out`, in the order of the file. `summary`: of `in`,
/// has definitions that the data may have lost.
tl::expected<Recovered, Status> recover(const log::Source& in, const log::Summary& summary,
                                        NewLog& out);

struct RecoverOptions {
  std::string input;
  OutputOptions output;
  bool json = false;
};

/// `mimesis log recover`. Exit code 0: the output holds all that was in the file; 1: it is good,
/// but something is missing, or it could not be written. @throws ConfigError
int log_recover(RecoverOptions options);

}  // namespace mimesis::tool
