#pragma once
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/log/replay_life.h"

namespace mimesis::tool {

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
